// SPDX-License-Identifier: Apache-2.0
#include "solid/curve_order.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace hpccd {
namespace {

constexpr int digit = 10;
constexpr std::uint32_t cells = 1u << digit;

// Every third bit of the result is one of the lowest ten of x.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ff;
  x = (x | x << 8) & 0x0300f00f;
  x = (x | x << 4) & 0x030c30c3;
  return (x | x << 2) & 0x09249249;
}

}  // namespace

Curve::Curve(const Vec3<double>& low, double size) : low_(low), per_cell_(cells / size) {
  if (!(per_cell_ < std::numeric_limits<double>::infinity())) per_cell_ = 0;
}

std::uint32_t Curve::code(const Vec3<double>& point) const {
  const auto cell = [&](double x, double low) {
    return spread_bits(static_cast<std::uint32_t>(std::clamp((x - low) * per_cell_, 0.0, cells - 1.0)));
  };
  return cell(point.x, low_.x) | cell(point.y, low_.y) << 1 | cell(point.z, low_.z) << 2;
}

void sort_by_code(std::vector<OnCurve>& points, const Cancellation& cancellation) {
  std::vector<OnCurve> sorted(points.size());
  for (int shift = 0; shift < 3 * digit; shift += digit) {
    cancellation.heed();
    std::vector<std::size_t> begin(cells, 0);
    for (const OnCurve& p : points) ++begin[p.code >> shift & (cells - 1)];
    std::size_t sum = 0;
    for (std::size_t& b : begin) sum += std::exchange(b, sum);
    for (const OnCurve& p : points) sorted[begin[p.code >> shift & (cells - 1)]++] = p;
    points.swap(sorted);
  }
}

}  // namespace hpccd
