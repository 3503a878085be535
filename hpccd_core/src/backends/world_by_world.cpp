// SPDX-License-Identifier: Apache-2.0
#include "backends/world_by_world.h"

#include <atomic>
#include <string>
#include <utility>

#include "backends/world_positions.h"
#include "base/spin_lock.h"
#include "contacts/worlds.h"

namespace hpccd {
namespace {

// Errors name the first invalid world, however worlds are distributed to threads.
class FirstBadWorld {
 public:
  // True: the result of the world no longer matters.
  bool before(std::size_t world) const { return first_.load(std::memory_order_relaxed) < world; }
  void note(std::size_t world, std::string why) {
    const std::lock_guard lock(lock_);
    if (before(world)) return;
    first_ = world, why_ = std::move(why);
  }
  void report() const {
    if (first_ != none) throw InvalidArgument(why_);
  }

 private:
  static constexpr std::size_t none = ~std::size_t{0};
  std::atomic<std::size_t> first_{none};
  SpinLock lock_;
  std::string why_;
};

template <class Row>
void append(std::vector<Row>& all, const std::vector<Row>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

Positions WorldByWorld::of_world(Positions all, std::size_t world) const {
  return hpccd::of_world(all, shared_.features.n_vertices, world);
}

// Of points, of which each world has the same number.
Positions WorldByWorld::points_of_world(Positions all, std::size_t world) const {
  return hpccd::of_world(all, all.n / n_worlds(), world);
}

// True: each world has a result.
template <class Answer, class Query>
bool WorldByWorld::answer(std::vector<Answer>& answers, Query&& query) {
  answers.clear();
  answers.resize(n_worlds());
  FirstBadWorld bad;
  const bool complete = each_world([&](DetectionBackend& backend, std::size_t world) {
    if (bad.before(world)) return true;
    try {
      auto found = query(backend, world);
      if (found) answers[world] = std::move(*found);
      return found.has_value();
    } catch (const InvalidArgument& error) {
      bad.note(world, with_world(error.what(), world));
      return true;
    }
  });
  bad.report();
  return complete;
}

std::optional<Detection> WorldByWorld::detect(Positions t0, Positions t1) {
  std::atomic<bool> all_there{true};
  Backend there = Backend::cpu;
  const bool complete = answer(contacts_of_worlds_, [&](DetectionBackend& backend, std::size_t world) {
    auto found = backend.detect(of_world(t0, world), of_world(t1, world));
    if (!found) return std::optional<Contacts>();
    if (found->computed_by == Backend::cpu)
      all_there = false;
    else
      there = found->computed_by;
    return std::optional(std::move(found->contacts));
  });
  if (!complete) return std::nullopt;
  contacts_ = {};
  join_worlds(contacts_of_worlds_, shared_.pool, contacts_);
  shared_.profiler.mark("contacts");
  return Detection{std::move(contacts_), all_there ? there : Backend::cpu};
}

std::optional<std::vector<double>> WorldByWorld::earliest(Positions t0, Positions t1) {
  std::vector<double> times;
  const bool complete = answer(times, [&](DetectionBackend& backend, std::size_t world) {
    const auto found = backend.earliest(of_world(t0, world), of_world(t1, world));
    return found ? std::optional(found->front()) : std::nullopt;
  });
  return complete ? std::optional(std::move(times)) : std::nullopt;
}

std::optional<CollisionFreeMotion> WorldByWorld::free_motion(Positions t0, Positions t1,
                                                             std::span<const std::int64_t> groups) {
  std::vector<CollisionFreeMotion> motions;
  const bool complete = answer(motions, [&](DetectionBackend& backend, std::size_t world) {
    return backend.free_motion(of_world(t0, world), of_world(t1, world), groups);
  });
  if (!complete) return std::nullopt;
  CollisionFreeMotion all;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const CollisionFreeMotion& m = motions[k];
    all.vertices.insert(all.vertices.end(), m.vertices.begin(), m.vertices.end());
    all.factors.insert(all.factors.end(), m.factors.begin(), m.factors.end());
    for (const std::uint32_t v : m.stuck)
      all.stuck.push_back(static_cast<std::uint32_t>(k * shared_.features.n_vertices) + v);
  }
  return all;
}

std::optional<Contacts> WorldByWorld::proximity(Positions vertices, double distance) {
  const bool complete = answer(contacts_of_worlds_, [&](DetectionBackend& backend, std::size_t world) {
    return backend.proximity(of_world(vertices, world), distance);
  });
  if (!complete) return std::nullopt;
  contacts_ = {};
  join_worlds(contacts_of_worlds_, shared_.pool, contacts_);
  shared_.profiler.mark("contacts");
  return std::move(contacts_);
}

std::optional<Intersections> WorldByWorld::intersections(Positions vertices) {
  std::vector<Intersections> found;
  const bool complete = answer(found, [&](DetectionBackend& backend, std::size_t world) {
    return backend.intersections(of_world(vertices, world));
  });
  if (!complete) return std::nullopt;
  Intersections all = join_worlds(found, shared_.pool);
  shared_.profiler.mark("contacts");
  return all;
}

std::optional<std::vector<Gap>> WorldByWorld::distances(Positions vertices) {
  std::vector<std::vector<Gap>> found;
  const bool complete = answer(found, [&](DetectionBackend& backend, std::size_t world) {
    return backend.distances(of_world(vertices, world));
  });
  if (!complete) return std::nullopt;
  std::vector<Gap> all;
  for (const auto& gaps : found) all.insert(all.end(), gaps.begin(), gaps.end());
  return all;
}

std::optional<WindingNumbers> WorldByWorld::winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) {
  std::vector<WindingNumbers> found;
  const bool complete = answer(found, [&](DetectionBackend& backend, std::size_t world) {
    return backend.winding_numbers(of_world(vertices, world), points_of_world(points, world), mesh);
  });
  if (!complete) return std::nullopt;
  WindingNumbers all;
  for (const WindingNumbers& w : found) append(all.numbers, w.numbers), append(all.on_surface, w.on_surface);
  return all;
}

std::optional<SignedDistances> WorldByWorld::signed_distances(Positions vertices, Positions points,
                                                              std::uint32_t mesh) {
  std::vector<SignedDistances> found;
  const bool complete = answer(found, [&](DetectionBackend& backend, std::size_t world) {
    return backend.signed_distances(of_world(vertices, world), points_of_world(points, world), mesh);
  });
  if (!complete) return std::nullopt;
  SignedDistances all;
  for (const SignedDistances& w : found)
    append(all.distance, w.distance), append(all.faces, w.faces), append(all.closest, w.closest);
  return all;
}

}  // namespace hpccd
