// SPDX-License-Identifier: Apache-2.0
// The interface of a backend: a place where a step can be computed. Positions are those of all worlds, one world after
// the other, and so are the results, with their slices if there are several worlds. A backend for one world takes the
// positions of one; WorldByWorld turns it into a backend for many.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backends/failures.h"
#include "hpccd/hpccd.h"

namespace hpccd {

struct Detection {
  Contacts contacts;
  Backend computed_by;  // the CPU, too, where it did what failing devices left undone
};

class DetectionBackend {
 public:
  virtual ~DetectionBackend() = default;

  // Nothing where the backend failed: the CPU shall compute the step. Positions may be on a device for the GPU only.
  // Throws InvalidArgument for bad coordinates, and Cancelled.
  virtual std::optional<Detection> detect(Positions t0, Positions t1) = 0;

  // By world: the earliest time, of contacts that are reported no later than they are where their tier can; infinity
  // where there is none. Nothing as well where a backend leaves the query to the CPU.
  virtual std::optional<std::vector<double>> earliest(Positions, Positions) { return std::nullopt; }

  // Of one snapshot. Nothing as well where a backend leaves the query to the CPU.
  virtual std::optional<Contacts> proximity(Positions, double) { return std::nullopt; }  // distances in place of times
  virtual std::optional<Intersections> intersections(Positions) { return std::nullopt; }
  virtual std::optional<std::vector<Gap>> distances(Positions) { return std::nullopt; }

  // Adds what the last step counted, and its stages on a device.
  virtual void count(std::map<std::string, std::uint64_t>& stats) const = 0;
  virtual void add_stages(std::map<std::string, double>&) const {}

  const Failures& failures() const { return failures_; }

 protected:
  Failures failures_;
};

}  // namespace hpccd
