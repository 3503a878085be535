// SPDX-License-Identifier: Apache-2.0
#include "backends/gpu_undecided.h"

#include <algorithm>

#include "elementary/batch.h"
#include "elementary/intersection_batch.h"

namespace hpccd {
namespace {

Geometry topology(const Features& features) { return {nullptr, features.edges.data(), features.faces.data()}; }

}  // namespace

Vec3<double> position(Positions p, std::uint32_t vertex) {
  const std::size_t i = 3 * std::size_t{vertex};
  if (p.is_double) {
    const auto* x = static_cast<const double*>(p.data) + i;
    return {x[0], x[1], x[2]};
  }
  const auto* x = static_cast<const float*>(p.data) + i;
  return {x[0], x[1], x[2]};
}

UndecidedPair undecided_pair(const Features& features, const Separations& separations, const Candidate& pair,
                             Positions t0, Positions t1) {
  std::uint32_t v[4];
  pair_vertices(topology(features), pair.kind, pair.first, pair.second, v);
  UndecidedPair q{pair.kind, {}, {}, separations.look_up(v[0], v[2])};
  for (int k = 0; k < 4; ++k) q.t0[k] = position(t0, v[k]), q.t1[k] = position(t1, v[k]);
  return q;
}

void edge_face_positions(const Features& features, const Candidate& pair, Positions vertices, Vec3<double> q[5]) {
  std::uint32_t v[5];
  edge_face_vertices(topology(features), pair.first, pair.second, v);
  for (int k = 0; k < 5; ++k) q[k] = position(vertices, v[k]);
}

DecidedContacts decided_contacts(const std::vector<Candidate>& pairs,
                                 const std::vector<std::optional<double>>& values) {
  DecidedContacts decided;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!values[i]) continue;
    auto& list = pairs[i].kind == Kind::vertex_face ? decided.vertex_face : decided.edge_edge;
    list.push_back({pairs[i].first, pairs[i].second, *values[i]});
  }
  for (auto* list : {&decided.vertex_face, &decided.edge_edge}) std::sort(list->begin(), list->end(), before);
  return decided;
}

}  // namespace hpccd
