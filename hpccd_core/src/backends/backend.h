// SPDX-License-Identifier: Apache-2.0
// The interface of a backend: a place where a step can be computed. Positions are those of all worlds, one world after
// the other, and so are the results, with their slices if there are several worlds. A backend for one world takes the
// positions of one; WorldByWorld turns it into a backend for many.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backends/failures.h"
#include "base/vec3.h"
#include "hpccd/hpccd.h"

namespace hpccd {

struct Detection {
  Contacts contacts;
  Backend computed_by;  // also the CPU, if it completed the work of failed devices
};

class DetectionBackend {
 public:
  virtual ~DetectionBackend() = default;

  // Nothing if the backend failed: the CPU must compute the step. Positions may be on a device only for the GPU. Throws
  // InvalidArgument for invalid coordinates, and Cancelled.
  virtual std::optional<Detection> detect(Positions t0, Positions t1) = 0;

  // By world: the earliest time of a contact, never late if the tier promises that; infinity without contacts. Also
  // nothing if the backend leaves the query to the CPU.
  virtual std::optional<std::vector<double>> earliest(Positions, Positions) { return std::nullopt; }

  // The ends of a shortened motion. Also nothing if the backend leaves the query to the CPU.
  virtual std::optional<CollisionFreeMotion> free_motion(Positions, Positions, std::span<const std::int64_t>) {
    return std::nullopt;
  }

  // For one snapshot. Also nothing if the backend leaves the query to the CPU.
  virtual std::optional<Contacts> proximity(Positions, double) { return std::nullopt; }  // distances instead of times
  virtual std::optional<Intersections> intersections(Positions) { return std::nullopt; }
  virtual std::optional<std::vector<Gap>> distances(Positions) { return std::nullopt; }
  // Of points and a closed mesh.
  virtual std::optional<WindingNumbers> winding_numbers(Positions, Positions, std::uint32_t) { return std::nullopt; }
  virtual std::optional<SignedDistances> signed_distances(Positions, Positions, std::uint32_t) { return std::nullopt; }
  // For one world.
  virtual std::optional<double> separating_translation(Positions, std::array<std::uint32_t, 2>, const Vec3<double>&) {
    return std::nullopt;
  }
  virtual std::optional<Penetration> penetration(Positions, std::array<std::uint32_t, 2>,
                                                 const std::optional<Vec3<double>>&) {
    return std::nullopt;
  }

  // Adds the counts of the last step, and its stages on a device.
  virtual void count(std::map<std::string, std::uint64_t>& stats) const = 0;
  virtual void add_stages(std::map<std::string, double>&) const {}

  const Failures& failures() const { return failures_; }

 protected:
  Failures failures_;
};

}  // namespace hpccd
