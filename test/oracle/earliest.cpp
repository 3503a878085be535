// SPDX-License-Identifier: Apache-2.0
// Every pair of features, in the order of the times up to which they are proven to be apart: the exact tests end where
// no other pair can be earlier.
#include "earliest.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "apart.h"
#include "elementary.h"
#include "separation.h"

namespace oracle {
namespace {

struct Candidate {
  double apart_until;
  Query query;
  bool vertex_face;
};

using Motion = std::array<const std::vector<Point>*, 2>;

template <class A, class B>
void add_candidates(const Meshes& meshes, const Features<A>& first, const Features<B>& second, const Motion& motion,
                    double distance, std::vector<Candidate>& candidates) {
  const bool one_list = static_cast<const void*>(&first) == static_cast<const void*>(&second);
  for (std::size_t i = 0; i < first.list.size(); ++i)
    for (std::size_t j = one_list ? i + 1 : 0; j < second.list.size(); ++j) {
      const A& a = first.list[i];
      const B& b = second.list[j];
      if (!meshes.tested[meshes.mesh_of(a[0])][meshes.mesh_of(b[0])] ||
          farther_apart(first.boxes[i], second.boxes[j], distance) || share_a_vertex(a, b))
        continue;
      Candidate pair{0, {}, a.size() == 1};
      std::size_t row = 0;
      for (const auto* vertices : motion) {
        for (const auto v : a) pair.query[row++] = (*vertices)[v];
        for (const auto v : b) pair.query[row++] = (*vertices)[v];
      }
      pair.apart_until = apart_until(pair.query, a.size(), distance);
      if (pair.apart_until < 1) candidates.push_back(pair);
    }
}

std::optional<double> time_of(const Candidate& pair, double distance) {
  if (pair.vertex_face) return distance == 0 ? vertex_face(pair.query) : separation_vertex_face(pair.query, distance);
  return distance == 0 ? edge_edge(pair.query) : separation_edge_edge(pair.query, distance);
}

}  // namespace

double earliest_contact(const Meshes& meshes, const std::vector<Point>& t0, const std::vector<Point>& t1,
                        double distance) {
  const auto edges = with_boxes(edges_of(meshes), t0, t1);
  std::vector<Candidate> candidates;
  add_candidates(meshes, with_boxes(vertices_of(meshes), t0, t1), with_boxes(meshes.faces, t0, t1), {&t0, &t1},
                 distance, candidates);
  add_candidates(meshes, edges, edges, {&t0, &t1}, distance, candidates);
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.apart_until < b.apart_until; });
  double best = std::numeric_limits<double>::infinity();
  for (const Candidate& pair : candidates) {
    if (best <= pair.apart_until) break;
    if (const auto time = time_of(pair, distance)) best = std::min(best, *time);
  }
  return best;
}

}  // namespace oracle
