// SPDX-License-Identifier: Apache-2.0
// A backend for many worlds made of backends for one: each world is computed by itself, and the results are
// concatenated.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "backends/backend.h"
#include "backends/resources.h"

namespace hpccd {

class WorldByWorld : public DetectionBackend {
 public:
  // Nothing where one of the worlds has no answer. Throws InvalidArgument for the first world with bad coordinates, and
  // names it.
  std::optional<Detection> detect(Positions t0, Positions t1) final;
  std::optional<std::vector<double>> earliest(Positions t0, Positions t1) final;
  std::optional<Contacts> proximity(Positions vertices, double distance) final;
  std::optional<Intersections> intersections(Positions vertices) final;
  std::optional<std::vector<Gap>> distances(Positions vertices) final;

 protected:
  explicit WorldByWorld(Resources& shared) : shared_(shared) {}

  // Asks a backend of one world for this one; false: it has no answer.
  using Ask = std::function<bool(DetectionBackend& backend, std::size_t world)>;
  // Of each world once, from any threads. False where one has no answer: then the others need not be asked for.
  virtual bool each_world(const Ask& ask) = 0;

  std::size_t n_worlds() const { return shared_.options.worlds; }
  Resources& shared_;

 private:
  template <class Answer, class Query>
  bool answer(std::vector<Answer>& answers, Query&& query);
  Positions of_world(Positions all, std::size_t world) const;

  // Kept by a call that is cancelled: to give the memory of 10 million back to the system takes longer than to end it.
  std::vector<Contacts> contacts_of_worlds_;
  Contacts contacts_;
};

}  // namespace hpccd
