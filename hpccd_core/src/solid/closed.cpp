// SPDX-License-Identifier: Apache-2.0
#include "solid/closed.h"

#include <algorithm>
#include <functional>
#include <numeric>

namespace hpccd {
namespace {

// A side of a face: its vertices, the lower one first, and whether the face has it in that order.
struct FaceSide {
  std::uint32_t low, high;
  bool ascending;
  auto operator<=>(const FaceSide&) const = default;
};

bool has_three(const std::array<std::uint32_t, 3>& f) { return f[0] != f[1] && f[1] != f[2] && f[2] != f[0]; }

}  // namespace

std::optional<std::array<std::uint32_t, 2>> open_edge(std::span<const std::array<std::uint32_t, 3>> faces,
                                                      const Cancellation& cancellation) {
  std::vector<FaceSide> sides;
  sides.reserve(3 * faces.size());
  for (const auto& f : faces) {
    if (!has_three(f)) continue;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = f[i], b = f[(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  std::ranges::sort(sides, heeding(cancellation, std::less<>()));
  // In pairs of opposite directions, each pair of another edge.
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    const auto same_edge = [&](std::size_t j) {
      return j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;
    };
    if (!same_edge(i + 1) || sides[i].ascending == sides[i + 1].ascending || same_edge(i + 2))
      return std::array{sides[i].low, sides[i].high};
  }
  return std::nullopt;
}

bool is_closed(std::span<const std::array<std::uint32_t, 3>> faces, const Cancellation& cancellation) {
  return std::ranges::any_of(faces, has_three) && !open_edge(faces, cancellation);
}

std::vector<std::uint32_t> connected_components(const Features& features, const Cancellation& cancellation) {
  std::vector<std::uint32_t> lowest(features.n_vertices);
  std::iota(lowest.begin(), lowest.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (lowest[v] != v) v = lowest[v] = lowest[lowest[v]];
    return v;
  };
  in_pieces(cancellation, features.edges.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t a = find(features.edges[i][0]), b = find(features.edges[i][1]);
      lowest[std::max(a, b)] = std::min(a, b);
    }
  });
  // Entries point to lower vertices, whose own are final.
  for (std::uint32_t v = 0; v < lowest.size(); ++v) lowest[v] = lowest[lowest[v]];
  return lowest;
}

}  // namespace hpccd
