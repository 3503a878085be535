// SPDX-License-Identifier: Apache-2.0
#include "winding.h"

#include <algorithm>
#include <cstddef>
#include <random>
#include <stdexcept>

#include "distance.h"
#include "parallel.h"

namespace oracle {
namespace {

constexpr int tries = 16;  // one is nearly always enough

// Random directions: on a grid of points small ones run through vertices and along faces.
Vec<Integer> direction_number(int number) {
  std::minstd_rand random(static_cast<unsigned>(number) + 1U);
  random.discard(10);
  const auto component = [&] {
    const auto n = static_cast<int>(random() % 1'000'000) + 1;
    return Integer(random() % 2 ? n : -n);
  };
  return {component(), component(), component()};
}

[[noreturn]] void fail() { throw std::runtime_error("winding number: each direction meets a border of a face"); }

}  // namespace

View::View(const std::vector<Corner>& corners, const std::vector<Triangle>& faces, const Vec<Integer>& direction)
    : corners_(corners), faces_(faces), direction_(direction) {
  for (const Corner& corner : corners_) flat_.push_back(flat(corner));
  for (const auto& [a, b, c] : faces_) {
    Box box;
    for (std::size_t i = 0; i < 2; ++i) {
      box.low[i] = std::min({flat_[a][i], flat_[b][i], flat_[c][i]});
      box.high[i] = std::max({flat_[a][i], flat_[b][i], flat_[c][i]});
    }
    boxes_.push_back(box);
  }
}

View::Flat View::flat(const Corner& x) const {
  return {direction_[2] * x[0] - direction_[0] * x[2], direction_[2] * x[1] - direction_[1] * x[2]};
}

std::optional<int> View::crossings(const Corner& point) const {
  const Flat p = flat(point);
  int sum = 0;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const auto& [low, high] = boxes_[f];
    if (p[0] < low[0] || p[0] > high[0] || p[1] < low[1] || p[1] > high[1]) continue;
    const auto& [a, b, c] = faces_[f];
    const auto side = [&](std::uint32_t i, std::uint32_t j) {
      const Flat &x = flat_[i], &y = flat_[j];
      return Integer((x[0] - p[0]) * (y[1] - p[1]) - (x[1] - p[1]) * (y[0] - p[0])).sign();
    };
    const int ab = side(a, b), bc = side(b, c), ca = side(c, a);
    if (std::min({ab, bc, ca}) < 0 && std::max({ab, bc, ca}) > 0) continue;  // the line misses the face
    if (ab == 0 || bc == 0 || ca == 0) return std::nullopt;
    // The line meets the plane at point + t direction, t = (corner - point) . normal / (direction . normal).
    const Vec<Integer> normal = cross(corners_[b] - corners_[a], corners_[c] - corners_[a]);
    const int leaves = dot(direction_, normal).sign();
    if (dot(corners_[a] - point, normal).sign() * leaves > 0) sum += leaves;
  }
  return sum;
}

int winding_number(const std::vector<Corner>& corners, const std::vector<Triangle>& faces, const Corner& point) {
  for (int i = 0; i < tries; ++i)
    if (const auto number = View(corners, faces, direction_number(i)).crossings(point)) return *number;
  fail();
}

Windings winding_numbers(const std::vector<std::array<double, 3>>& vertices, const std::vector<Triangle>& faces,
                         const std::vector<std::array<double, 3>>& points, unsigned threads) {
  const Integers all = coordinates(vertices, points);
  const std::vector<Corner> corners = corners_of(all.values, 0, vertices.size());
  const std::vector<Corner> centres = corners_of(all.values, vertices.size(), vertices.size() + points.size());
  const auto is_on = [&](const std::array<double, 3>& p, const Triangle& face) {
    const auto &a = vertices[face[0]], &b = vertices[face[1]], &c = vertices[face[2]];
    for (std::size_t i = 0; i < 3; ++i)
      if (p[i] < std::min({a[i], b[i], c[i]}) || p[i] > std::max({a[i], b[i], c[i]})) return false;
    return within_vertex_face({p, a, b, c}, 0.0);
  };
  Windings found{std::vector<std::int32_t>(points.size()), std::vector<std::uint8_t>(points.size())};
  std::vector<std::uint8_t> known(points.size());
  for (int i = 0; std::count(known.begin(), known.end(), 0) > 0; ++i) {
    if (i == tries) fail();
    const View view(corners, faces, direction_number(i));
    parallel_for(points.size(), threads, [&](std::size_t p) {
      if (known[p]) return;
      found.on_surface[p] =
          std::any_of(faces.begin(), faces.end(), [&](const Triangle& face) { return is_on(points[p], face); });
      const auto number = found.on_surface[p] ? 0 : view.crossings(centres[p]);
      found.numbers[p] = number.value_or(0);
      known[p] = number.has_value();
    });
  }
  return found;
}

}  // namespace oracle
