// SPDX-License-Identifier: Apache-2.0
#include "solid/containment.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>

#include "solid/closed.h"
#include "solid/winding.h"

namespace hpccd {
namespace {

constexpr std::uint32_t none = Tree::none;

bool overlap(const Extent& a, const Extent& b) {
  for (int k = 0; k < 3; ++k)
    if (a.high[k] < b.low[k] || b.high[k] < a.low[k]) return false;
  return true;
}

bool within(const double* x, const Extent& e) {
  for (int k = 0; k < 3; ++k)
    if (!(e.low[k] < x[k] && x[k] < e.high[k])) return false;
  return true;
}

bool within(const Extent& a, const Extent& b) { return within(a.low, b) && within(a.high, b); }

// Following the list reads all vertices of the mesh: 1,000 of them in the time of one decision.
bool list_would_pay(std::size_t vertices, std::size_t of_mesh) { return vertices >= 16 && 1000 * vertices >= of_mesh; }

}  // namespace

// Whether a component of `inner` lies inside `outer`.
struct Containment::Question {
  Gap& gap;
  Inside answer;
  std::size_t key;
  std::uint32_t inner, outer;
  std::vector<std::uint32_t> candidates = {};  // components that may be inside, in ascending order
  std::vector<std::uint32_t> open = {};        // those that the memory does not decide
  std::atomic<std::uint32_t> found = none;     // one that is inside
};

std::size_t ContainmentMemory::bytes() const {
  std::size_t n = 0;
  for (const auto& [key, m] : of_pair) n += sizeof key + sizeof m + (m.outside ? m.outside->bytes() : 0);
  return n;
}

// Only of meshes that may lie inside others or contain them.
Containment::Containment(const Scene& scene, const Features& features, const PairRules& rules, const MeshPairs& pairs,
                         const Cancellation& cancellation)
    : scene_(scene), features_(features), rules_(rules), pairs_(pairs), closed_(scene.meshes().size(), false) {
  std::vector<char> paired(closed_.size(), false);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (pairs[i][0] != pairs[i][1]) paired[pairs[i][0]] = paired[pairs[i][1]] = true;
  const std::vector<std::uint32_t> component = connected_components(features, cancellation);
  first_.push_back(0);
  for (std::uint32_t m = 0; m < closed_.size(); ++m) {
    const Scene::Mesh& mesh = scene.meshes()[m];
    const std::span faces(features.faces);
    closed_[m] = paired[m] && is_closed(faces.subspan(mesh.first_face, mesh.n_faces), cancellation);
    for (std::uint32_t v = mesh.first_vertex; paired[m] && v < mesh.first_vertex + mesh.n_vertices; ++v)
      if (component[v] == v) vertices_.push_back(v);
    first_.push_back(static_cast<std::uint32_t>(vertices_.size()));
  }
}

// Of the mesh at its pose, computed from all its vertices.
Extent Containment::least_extent(std::uint32_t mesh, const MotionBounds& snapshot, const PlacedMeshes& placed) const {
  const Scene::Mesh& m = scene_.meshes()[mesh];
  Extent extent;
  for (std::uint32_t v = m.first_vertex; v < m.first_vertex + m.n_vertices; ++v) {
    const std::array<double, 3> x = position(snapshot, &placed, v);
    for (int k = 0; k < 3; ++k)
      extent.low[k] = std::min(extent.low[k], x[k]), extent.high[k] = std::max(extent.high[k], x[k]);
  }
  return extent;
}

std::deque<Containment::Question> Containment::questions_of(std::span<Gap> gaps, const MotionBounds& snapshot,
                                                            const PlacedMeshes* placed) const {
  std::deque<Question> questions;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    Gap& gap = gaps[i];
    if (gap.mesh_a == gap.mesh_b || !(gap.distance > 0)) continue;
    const auto ask = [&](Inside answer, std::uint32_t inner, std::uint32_t outer) {
      if (!closed_[outer]) return;
      const Extent &whole = snapshot.extent_of_mesh(outer), &part = snapshot.extent_of_mesh(inner);
      const std::span<const std::uint32_t> vertices = components(inner);
      // The extents of meshes at poses are not the least ones: then the inner one may extend beyond the outer one.
      const bool connected = vertices.size() == 1;
      if (connected && !placed ? !within(part, whole) : !overlap(part, whole)) return;
      Question& q = questions.emplace_back(gap, answer, 2 * i + (answer == Inside::b), inner, outer);
      for (std::uint32_t c = 0; c < vertices.size(); ++c)
        if (within(position(snapshot, placed, vertices[c]).data(), whole)) q.candidates.push_back(c);
      // Surfaces with ignored contacts may intersect unnoticed: then the answer must not depend on which boxes are
      // known.
      const bool least_decide = connected && placed && rules_.rule(inner, outer).filtered;
      if (q.candidates.empty() ||
          (least_decide && !within(least_extent(inner, snapshot, *placed), least_extent(outer, snapshot, *placed))))
        questions.pop_back();
    };
    ask(Inside::a, gap.mesh_a, gap.mesh_b), ask(Inside::b, gap.mesh_b, gap.mesh_a);
  }
  return questions;
}

void Containment::decide(std::span<Gap> gaps, const Tree& tree, const MotionBounds& snapshot,
                         const PlacedMeshes* placed, ContainmentMemory& memory, ThreadPool& pool) const {
  std::deque<Question> questions = questions_of(gaps, snapshot, placed);
  if (questions.empty()) return;
  // At most points_at_once components.
  const auto test = [&](Question& q, std::span<const std::uint32_t> which, OutsideList* outside) {
    if (q.found.load(std::memory_order_relaxed) != none) return;
    const std::span<const std::uint32_t> vertices = components(q.inner);
    std::array<Vec3<double>, points_at_once> points;
    std::array<Winding, points_at_once> windings;
    for (std::size_t i = 0; i < which.size(); ++i) {
      const std::array<double, 3> x = position(snapshot, placed, vertices[which[i]]);
      points[i] = {x[0], x[1], x[2]};
    }
    winding_numbers(tree, snapshot, features_, q.outer, std::span(points).first(which.size()),
                    std::span(windings).first(which.size()), placed);
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (windings[i].number != 0)
        q.found.store(which[i], std::memory_order_relaxed);
      else if (outside)
        outside->measure(tree, snapshot, features_, q.outer, which[i], vertices[which[i]]);
    }
  };

  // First, of each pair, the one that was inside last.
  constexpr std::size_t grain = 4;  // about 20 us, less than it takes to wake a thread
  parallel_for(pool, questions.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      Question& q = questions[i];
      if (q.candidates.size() == 1) test(q, q.candidates, nullptr);
      const auto memory_of_pair = memory.of_pair.find(q.key);
      if (q.candidates.size() == 1 || memory_of_pair == memory.of_pair.end()) continue;
      const std::uint32_t last = memory_of_pair->second.found;
      if (std::ranges::binary_search(q.candidates, last)) test(q, {&last, 1}, nullptr);
    }
  });

  for (Question& q : questions) {
    if (q.candidates.size() > 1) {
      ContainmentMemory::OfPair& of_pair = memory.of_pair[q.key];
      if (q.found == none) {
        const Scene::Mesh& outer = scene_.meshes()[q.outer];
        // A list follows every vertex, which meshes at poses do not compute.
        if (placed) {
          of_pair.outside.reset();
        } else if (of_pair.outside) {
          of_pair.outside->follow(snapshot, pool);
        } else if (list_would_pay(q.candidates.size(), outer.n_vertices)) {
          const VertexRange range{outer.first_vertex, std::size_t{outer.first_vertex} + outer.n_vertices};
          of_pair.outside = std::make_unique<OutsideList>(snapshot, range, components(q.inner).size(), pool);
        }
        OutsideList* outside = of_pair.outside.get();
        for (const std::uint32_t c : q.candidates)
          if (!outside || !outside->still_outside(snapshot, c, components(q.inner)[c])) q.open.push_back(c);
        parallel_for(pool, q.open.size(), points_at_once, [&](std::size_t begin, std::size_t end, int) {
          test(q, std::span<const std::uint32_t>(q.open).subspan(begin, end - begin), outside);
        });
      }
      if (q.found != none) of_pair.outside.reset();  // it does not follow while this one is inside
      of_pair.found = q.found;
    }
    if (q.found != none) q.gap.inside = q.gap.inside == Inside::none ? q.answer : Inside::both;
  }
}

}  // namespace hpccd
