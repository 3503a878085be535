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
  // Nothing if one of the worlds has no result. Throws InvalidArgument for the first world with invalid coordinates,
  // and names it.
  std::optional<Detection> detect(Positions t0, Positions t1) final;
  std::optional<std::vector<double>> earliest(Positions t0, Positions t1) final;
  std::optional<CollisionFreeMotion> free_motion(Positions t0, Positions t1,
                                                 std::span<const std::int64_t> groups) final;
  std::optional<Contacts> proximity(Positions vertices, double distance) final;
  std::optional<Intersections> intersections(Positions vertices) final;
  std::optional<std::vector<Gap>> distances(Positions vertices) final;
  std::optional<WindingNumbers> winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) final;
  std::optional<SignedDistances> signed_distances(Positions vertices, Positions points, std::uint32_t mesh) final;

 protected:
  explicit WorldByWorld(Resources& shared) : shared_(shared) {}

  // Runs a query of this world on a backend for one world; false: no result.
  using Ask = std::function<bool(DetectionBackend& backend, std::size_t world)>;
  // Calls it once per world, from any threads. False if a world has no result: then the other worlds may be skipped.
  virtual bool each_world(const Ask& ask) = 0;

  std::size_t n_worlds() const { return shared_.options.worlds; }
  Resources& shared_;

 private:
  template <class Answer, class Query>
  bool answer(std::vector<Answer>& answers, Query&& query);
  Positions of_world(Positions all, std::size_t world) const;
  Positions points_of_world(Positions all, std::size_t world) const;

  // Kept after a cancelled call: returning the memory of 10 million contacts to the system takes longer than ending the
  // call.
  std::vector<Contacts> contacts_of_worlds_;
  Contacts contacts_;
};

}  // namespace hpccd
