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

// A list costs about as much as deciding its vertices, and following it reads all vertices of the mesh: 1,000 of them
// in the time of one decision.
bool list_would_pay(std::size_t vertices, std::size_t of_mesh) { return vertices >= 16 && 1000 * vertices >= of_mesh; }

}  // namespace

// Whether a component of `inner` lies inside `outer`.
struct Containment::Question {
  Gap& gap;
  Inside answer;
  std::size_t key;
  std::uint32_t inner, outer;
  std::vector<std::uint32_t> candidates = {};  // vertices of components that may be inside, in ascending order
  std::uint32_t first = none;                  // the candidate that is decided first
  std::vector<std::uint32_t> open = {};        // others that the memory does not decide
  std::atomic<std::uint32_t> found = none;     // one that is inside
};

std::size_t ContainmentMemory::bytes() const {
  std::size_t n = 0;
  for (const auto& [key, m] : of_pair) n += sizeof key + sizeof m + (m.outside ? m.outside->bytes() : 0);
  return n;
}

// Only of meshes that may lie inside others or contain them.
Containment::Containment(const Scene& scene, const Features& features, const MeshPairs& pairs)
    : scene_(scene), features_(features), pairs_(pairs), closed_(scene.meshes().size(), false) {
  std::vector<char> paired(closed_.size(), false);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (pairs[i][0] != pairs[i][1]) paired[pairs[i][0]] = paired[pairs[i][1]] = true;
  const std::vector<std::uint32_t> component = connected_components(features);
  first_.push_back(0);
  for (std::uint32_t m = 0; m < closed_.size(); ++m) {
    const Scene::Mesh& mesh = scene.meshes()[m];
    const std::span faces(features.faces);
    closed_[m] = paired[m] && is_closed(faces.subspan(mesh.first_face, mesh.n_faces));
    for (std::uint32_t v = mesh.first_vertex; paired[m] && v < mesh.first_vertex + mesh.n_vertices; ++v)
      if (component[v] == v) vertices_.push_back(v);
    first_.push_back(static_cast<std::uint32_t>(vertices_.size()));
  }
}

std::deque<Containment::Question> Containment::questions_of(std::span<Gap> gaps, const MotionBounds& snapshot) const {
  std::deque<Question> questions;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    Gap& gap = gaps[i];
    if (gap.mesh_a == gap.mesh_b || !(gap.distance > 0)) continue;
    const auto ask = [&](Inside answer, std::uint32_t inner, std::uint32_t outer) {
      if (!closed_[outer]) return;
      const Extent &whole = snapshot.extent_of_mesh(outer), &part = snapshot.extent_of_mesh(inner);
      const std::span<const std::uint32_t> vertices = components(inner);
      if (vertices.size() == 1 ? !(within(part.low, whole) && within(part.high, whole)) : !overlap(part, whole)) return;
      Question& q = questions.emplace_back(gap, answer, 2 * i + (answer == Inside::b), inner, outer);
      for (const std::uint32_t v : vertices)
        if (within(snapshot.vertices[v].t0, whole)) q.candidates.push_back(v);
      if (q.candidates.empty()) questions.pop_back();
    };
    ask(Inside::a, gap.mesh_a, gap.mesh_b), ask(Inside::b, gap.mesh_b, gap.mesh_a);
  }
  return questions;
}

void Containment::decide(std::span<Gap> gaps, const Tree& tree, const MotionBounds& snapshot, ContainmentMemory& memory,
                         ThreadPool& pool) const {
  std::deque<Question> questions = questions_of(gaps, snapshot);
  if (questions.empty()) return;
  // At most points_at_once vertices.
  const auto test = [&](Question& q, std::span<const std::uint32_t> vertices) {
    if (q.found.load(std::memory_order_relaxed) != none) return;
    std::array<Vec3<double>, points_at_once> points;
    std::array<Winding, points_at_once> windings;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const double* x = snapshot.vertices[vertices[i]].t0;
      points[i] = {x[0], x[1], x[2]};
    }
    winding_numbers(tree, snapshot, features_, q.outer, std::span(points).first(vertices.size()),
                    std::span(windings).first(vertices.size()));
    for (std::size_t i = 0; i < vertices.size(); ++i)
      if (windings[i].number != 0) q.found.store(vertices[i], std::memory_order_relaxed);
  };

  for (Question& q : questions) {
    q.first = q.candidates.front();
    if (q.candidates.size() == 1) continue;
    const std::uint32_t last = memory.of_pair[q.key].found;
    if (std::ranges::binary_search(q.candidates, last)) q.first = last;
  }
  constexpr std::size_t grain = 4;  // about 20 us, less than it takes to wake a thread
  parallel_for(pool, questions.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) test(questions[i], {&questions[i].first, 1});
  });

  for (Question& q : questions) {
    if (q.candidates.size() == 1 || q.found != none) continue;
    OutsideList* outside = memory.of_pair[q.key].outside.get();
    if (outside) outside->follow(snapshot, pool);
    for (const std::uint32_t v : q.candidates) {
      if (v == q.first) continue;
      const bool known = outside && outside->still_outside(snapshot, v);
      if (outside) ++(known ? outside->decided : outside->open);
      if (!known) q.open.push_back(v);
    }
    parallel_for(pool, q.open.size(), points_at_once, [&](std::size_t begin, std::size_t end, int) {
      test(q, std::span<const std::uint32_t>(q.open).subspan(begin, end - begin));
    });
  }

  for (Question& q : questions) {
    if (q.found != none) q.gap.inside = q.gap.inside == Inside::none ? q.answer : Inside::both;
    if (q.candidates.size() > 1) remember(q, tree, snapshot, memory.of_pair[q.key], pool);
  }
}

// Makes a list when all candidates are outside, and another one when the last has left as many open as it has.
void Containment::remember(const Question& q, const Tree& tree, const MotionBounds& snapshot,
                           ContainmentMemory::OfPair& memory, ThreadPool& pool) const {
  constexpr int pause = 16;  // snapshots without a list, after one that has not paid
  if (q.found != none) {
    memory.found = q.found;
    return;
  }
  if (memory.outside) {
    if (memory.outside->open < memory.outside->size()) return;
    memory.rests = memory.outside->decided < 2 * memory.outside->size() ? pause : 0;
    memory.outside.reset();
  }
  if (memory.rests > 0) {
    --memory.rests;
    return;
  }
  const Scene::Mesh& outer = scene_.meshes()[q.outer];
  if (!list_would_pay(q.candidates.size(), outer.n_vertices)) return;
  const VertexRange range{outer.first_vertex, std::size_t{outer.first_vertex} + outer.n_vertices};
  memory.outside = std::make_unique<OutsideList>(tree, snapshot, q.outer, range, q.candidates, pool);
}

}  // namespace hpccd
