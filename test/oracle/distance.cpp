// SPDX-License-Identifier: Apache-2.0
#include "distance.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "pieces.h"

namespace oracle {
namespace {

using Corners = std::array<Vec<Integer>, 4>;

struct Scaled {
  Corners corners;
  Integer distance;
  int exponent;
};

Scaled scaled(const Points& points, double distance) {
  std::vector<double> numbers{distance};
  for (const auto& point : points) numbers.insert(numbers.end(), point.begin(), point.end());
  const Integers integers = to_integers(numbers);
  Scaled all{{}, integers.values[0], integers.exponent};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) all.corners[i][axis] = integers.values[1 + 3 * i + axis];
  return all;
}

const Piece<Integer>& smallest(const std::vector<Piece<Integer>>& pieces) {
  const Piece<Integer>* best = nullptr;
  for (const Piece<Integer>& piece : pieces) {
    const bool on_both =
        piece.over != 0 && std::all_of(piece.feet.begin(), piece.feet.end(), [](const Integer& x) { return x >= 0; });
    if (on_both && (!best || piece.square * best->over < best->square * piece.over)) best = &piece;
  }
  return *best;  // that of two vertices is always one
}

using Pieces = std::vector<Piece<Integer>>(const Corners&, const Integer&);

SquaredDistance squared_distance(const Points& points, Pieces pieces_of) {
  const Scaled q = scaled(points, 0.0);
  const auto pieces = pieces_of(q.corners, Integer(1));
  const auto& piece = smallest(pieces);
  return {piece.square, piece.over, q.exponent};
}

bool within(const Points& points, double d, Pieces pieces_of) {
  const Scaled q = scaled(points, d);
  const auto pieces = pieces_of(q.corners, Integer(1));
  const auto& piece = smallest(pieces);
  return piece.square <= q.distance * q.distance * piece.over;
}

double rounded(const SquaredDistance& s) { return nearest_root(s.numerator, s.denominator, s.exponent); }

}  // namespace

SquaredDistance squared_distance_vertex_face(const Points& points) {
  return squared_distance(points, vertex_face_pieces<Integer>);
}
SquaredDistance squared_distance_edge_edge(const Points& points) {
  return squared_distance(points, edge_edge_pieces<Integer>);
}

bool within_vertex_face(const Points& points, double d) { return within(points, d, vertex_face_pieces<Integer>); }
bool within_edge_edge(const Points& points, double d) { return within(points, d, edge_edge_pieces<Integer>); }

double distance_vertex_face(const Points& points) { return rounded(squared_distance_vertex_face(points)); }
double distance_edge_edge(const Points& points) { return rounded(squared_distance_edge_edge(points)); }

}  // namespace oracle
