// SPDX-License-Identifier: Apache-2.0
// The distance of two features by pieces: of each, the closed form and where it is the distance of two of their
// points. T: an integer, or a polynomial in time with integer coefficients.
#pragma once

#include <vector>

#include "vec.h"

namespace oracle {

// Where `over` is not 0 and no foot is negative, square / over is the squared distance of a point of one feature and a
// point of the other. The smallest of a pair's pieces is the distance of the features: their nearest points lie
// inside the face, inside an edge or at a vertex, and at right angles there; pieces of features that are degenerate
// (`over` is 0) are covered by the lower ones.
template <class T>
struct Piece {
  T square, over;
  std::vector<T> feet;
};

template <class T>
Piece<T> point_point(const Vec<T>& p, const Vec<T>& q, const T& one) {
  const Vec<T> r = q - p;
  return {dot(r, r), one, {}};
}

template <class T>
Piece<T> point_line(const Vec<T>& p, const Vec<T>& a, const Vec<T>& b) {
  const Vec<T> e = b - a, r = p - a, area = cross(r, e);
  const T along = dot(r, e), length = dot(e, e);
  return {dot(area, area), length, {along, length - along}};
}

template <class T>
Piece<T> point_plane(const Vec<T>& p, const Vec<T>& a, const Vec<T>& b, const Vec<T>& c) {
  const Vec<T> u = b - a, v = c - a, r = p - a, n = cross(u, v);
  const T height = dot(r, n), over = dot(n, n);
  // The foot's barycentric coordinates, times |n|^2.
  const T of_b = dot(cross(r, v), n), of_c = dot(cross(u, r), n);
  return {height * height, over, {of_b, of_c, over - of_b - of_c}};
}

template <class T>
Piece<T> line_line(const Vec<T>& a0, const Vec<T>& a1, const Vec<T>& b0, const Vec<T>& b1) {
  const Vec<T> u = a1 - a0, v = b1 - b0, w = b0 - a0, n = cross(u, v);
  const T height = dot(w, n), over = dot(n, n);
  // Places of the feet on both lines, from 0 to 1, times |n|^2.
  const T on_a = dot(cross(w, v), n), on_b = dot(cross(w, u), n);
  return {height * height, over, {on_a, over - on_a, on_b, over - on_b}};
}

// q: v f0 f1 f2.
template <class T>
std::vector<Piece<T>> vertex_face_pieces(const std::array<Vec<T>, 4>& q, const T& one) {
  const auto& [v, a, b, c] = q;
  return {point_plane(v, a, b, c), point_line(v, a, b),    point_line(v, b, c),   point_line(v, c, a),
          point_point(v, a, one),  point_point(v, b, one), point_point(v, c, one)};
}

// q: a0 a1 b0 b1.
template <class T>
std::vector<Piece<T>> edge_edge_pieces(const std::array<Vec<T>, 4>& q, const T& one) {
  const auto& [a0, a1, b0, b1] = q;
  return {line_line(a0, a1, b0, b1), point_line(a0, b0, b1),   point_line(a1, b0, b1),
          point_line(b0, a0, a1),    point_line(b1, a0, a1),   point_point(a0, b0, one),
          point_point(a0, b1, one),  point_point(a1, b0, one), point_point(a1, b1, one)};
}

}  // namespace oracle
