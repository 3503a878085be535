// SPDX-License-Identifier: Apache-2.0
#include "separation.h"

#include <algorithm>
#include <vector>

#include "algebraic.h"
#include "distance.h"
#include "motion.h"
#include "pieces.h"

namespace oracle {
namespace {

bool is_distance_at(const Piece<Polynomial>& piece, Root& t) {
  return t.sign_of(piece.over) != 0 && std::all_of(piece.feet.begin(), piece.feet.end(),
                                                   [&](const Polynomial& foot) { return t.sign_of(foot) >= 0; });
}

// The features are farther apart than d at t=0. Their distance is continuous: when it first is d, so is that of one of
// its pieces. A piece that is d throughout gives no time: it was not the distance just before, so a foot has just
// arrived on a border, where a lower piece is the distance too.
std::optional<double> earliest(const std::vector<Piece<Polynomial>>& pieces, const Integer& d) {
  const Polynomial square({d * d});
  std::optional<double> best;
  for (const Piece<Polynomial>& piece : pieces) {
    const Polynomial excess = piece.square - square * piece.over;
    if (excess.is_zero()) continue;
    for (Root& t : roots_in_unit_interval(excess)) {
      if (!is_distance_at(piece, t)) continue;
      const double time = t.rounded_down();
      best = best ? std::min(*best, time) : time;
      break;
    }
  }
  return best;
}

Points at_start(const Query& query) { return {query[0], query[1], query[2], query[3]}; }

const Polynomial one({Integer(1)});

}  // namespace

std::optional<double> separation_vertex_face(const Query& query, double d) {
  if (within_vertex_face(at_start(query), d)) return 0.0;
  const auto [points, distance] = motion_and_distance(query, d);
  return earliest(vertex_face_pieces(points, one), distance);
}

std::optional<double> separation_edge_edge(const Query& query, double d) {
  if (within_edge_edge(at_start(query), d)) return 0.0;
  const auto [points, distance] = motion_and_distance(query, d);
  return earliest(edge_edge_pieces(points, one), distance);
}

}  // namespace oracle
