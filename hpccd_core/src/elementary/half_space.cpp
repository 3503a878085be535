// SPDX-License-Identifier: Apache-2.0
#include "elementary/half_space.h"

#include <algorithm>
#include <limits>

#include "base/double_double.h"
#include "elementary/exact/integers.h"

namespace hpccd {
namespace {

using exact::Big;
using exact::BitRange;
using exact::OddMantissa;

constexpr double huge = std::numeric_limits<double>::infinity();

// normal . x - offset = f 2^low, exactly, for the vertices of a motion.
struct ExactValues {
  Big f[2];
  int low;
};

ExactValues exact_values(const Plane& plane, const Vec3<double>& x0, const Vec3<double>& x1) {
  const Vec3<double>* ends[] = {&x0, &x1};
  OddMantissa n[3], x[2][3];
  const OddMantissa c(plane.offset);
  BitRange of_n, of_x;
  for (int k = 0; k < 3; ++k) {
    of_n.include(n[k] = OddMantissa(plane.normal[static_cast<std::size_t>(k)]));
    for (int end = 0; end < 2; ++end) {
      const Vec3<double>& v = *ends[end];
      of_x.include(x[end][k] = OddMantissa(k == 0 ? v.x : k == 1 ? v.y : v.z));
    }
  }
  const int low_x = of_x.low > of_x.high ? 0 : of_x.low;  // all coordinates may be zero
  const int of_products = of_n.low + low_x, low = c.mantissa ? std::min(of_products, c.exponent) : of_products;
  ExactValues v{{}, low};
  const Big offset = c.mantissa ? Big(Big(c.mantissa) << (c.exponent - low)) : Big(0);
  for (int end = 0; end < 2; ++end) {
    Big sum = 0;
    for (int k = 0; k < 3; ++k)
      sum += exact::scaled_integer<Big>(n[k], of_n.low) * exact::scaled_integer<Big>(x[end][k], low_x);
    v.f[end] = (sum << (of_products - low)) - offset;
  }
  return v;
}

// (s |normal|)^2 = square 2^(2 low), with an integer.
struct ExactSquare {
  Big square;
  int low;
};

ExactSquare exact_square(const Plane& plane, double separation) {
  OddMantissa n[3];
  BitRange of_n;
  for (int k = 0; k < 3; ++k) of_n.include(n[k] = OddMantissa(plane.normal[static_cast<std::size_t>(k)]));
  const OddMantissa s(separation);
  Big sum = 0;
  for (const OddMantissa& x : n) {
    const Big y = exact::scaled_integer<Big>(x, of_n.low);
    sum += y * y;
  }
  return {sum * s.mantissa * s.mantissa, of_n.low + s.exponent};
}

// The sign of f^2 - square, for both in units of their own, and the difference.
Big excess(const Big& f, int low_f, const ExactSquare& s, int& low) {
  low = std::min(low_f, s.low);
  return ((f * f) << (2 * (low_f - low))) - (s.square << (2 * (s.low - low)));
}

bool within_exactly(const Plane& plane, double separation, const Vec3<double>& x) {
  const ExactValues v = exact_values(plane, x, x);
  if (v.f[0].sign() <= 0) return true;
  if (!(separation > 0)) return false;
  int low;
  return excess(v.f[0], v.low, exact_square(plane, separation), low).sign() <= 0;
}

// A number, as a fraction in [0.5, 1) or 0 times a power of two.
struct Scaled {
  double fraction;
  int exponent;
  Scaled(const Big& x, int low) {
    fraction = exact::magnitude_of(x, exponent);
    exponent += low;
    if (x.sign() < 0) fraction = -fraction;
  }
  Scaled(double f, int e) : fraction(f), exponent(e) {}
  friend Scaled operator*(Scaled a, Scaled b) { return {a.fraction * b.fraction, a.exponent + b.exponent}; }
  friend Scaled operator/(Scaled a, Scaled b) { return {a.fraction / b.fraction, a.exponent - b.exponent}; }
  double value() const { return std::ldexp(fraction, exponent); }
};

Scaled root_of(const ExactSquare& s) {
  Scaled x(s.square, 2 * s.low);
  if (x.exponent & 1) x.fraction *= 2, --x.exponent;
  return {std::sqrt(x.fraction), x.exponent / 2};
}

// f0 > s |normal| >= f1. With the root r = s |normal|, t = (f0 - r) / (f0 - f1) = (f0^2 - r^2) / ((f0 + r) (f0 - f1)):
// no factor cancels.
double time_exactly(const Plane& plane, double separation, const Vec3<double>& x0, const Vec3<double>& x1) {
  const ExactValues v = exact_values(plane, x0, x1);
  const Scaled f0(v.f[0], v.low), way(Big(v.f[0] - v.f[1]), v.low);
  if (!(separation > 0)) return (f0 / way).value();
  const ExactSquare s = exact_square(plane, separation);
  int low;
  const Big difference = excess(v.f[0], v.low, s, low);
  const Scaled r = root_of(s);
  const int shift = r.exponent - f0.exponent;
  const Scaled sum(f0.fraction + (shift < -1100 ? 0 : std::ldexp(r.fraction, shift)), f0.exponent);  // r < f0
  return (Scaled(difference, 2 * low) / (sum * way)).value();
}

// normal . x - offset.
DoubleDouble twice_double(const Vec3<double>& n, double offset, const Vec3<double>& x) {
  using detail::two_product;
  return ((two_product(n.x, x.x) + two_product(n.y, x.y)) + two_product(n.z, x.z)) - DoubleDouble(offset);
}

}  // namespace

HalfSpace::HalfSpace(const Plane& plane, double separation) : plane_(plane), separation_(separation) {
  const auto& n = plane.normal;
  int exponent;
  std::frexp(std::max({std::fabs(n[0]), std::fabs(n[1]), std::fabs(n[2])}), &exponent);
  --exponent;
  double scaled[3];
  int n_ones = 0, at = 0;
  bool exact_products = true;
  for (int k = 0; k < 3; ++k) {
    scaled[k] = std::ldexp(n[static_cast<std::size_t>(k)], -exponent);
    bounds_hold_ = bounds_hold_ && std::ldexp(scaled[k], exponent) == n[static_cast<std::size_t>(k)];
    const bool is_one = std::fabs(scaled[k]) == 1;
    if (is_one) ++n_ones, at = k;
    exact_products = exact_products && (is_one || scaled[k] == 0);
  }
  normal_ = {scaled[0], scaled[1], scaled[2]};
  offset_ = std::ldexp(plane.offset, -exponent);
  bounds_hold_ = bounds_hold_ && std::isfinite(offset_) && std::ldexp(offset_, exponent) == plane.offset;
  length_ = std::sqrt(dot(normal_, normal_));
  unit_ = 1 / length_ * normal_;
  if (exact_products) lost_ = 0;
  // The length has an error of at most 3 u, and the product one of u, or what is lost to underflow.
  const double reach = separation * length_;
  least_ = separation > 0 ? reach * (1 - 0x1p-50) - 0x1p-1070 : 0;
  most_ = separation > 0 ? reach * (1 + 0x1p-50) + 0x1p-1070 : 0;
  bounds_hold_ = bounds_hold_ && std::isfinite(most_);
  if (bounds_hold_ && exact_products && n_ones == 1) {
    // f is one difference, whose rounding is monotonic: f > s implies that the difference is above s, and f < s that
    // it is below. The difference has the sign of f.
    axis_ = at, side_ = scaled[at];
    relative_ = 0;
    most_ = separation;
    least_ = separation > 0 ? std::nextafter(separation, -huge) : 0;
  }
  far_ = axis_ >= 0 ? most_ : (most_ + relative_ * std::fabs(offset_) + lost_) * (1 + 0x1p-50);
  if (!bounds_hold_) far_ = most_ = huge, least_ = -huge;  // nothing is decided without integers
}

bool HalfSpace::within(const Vec3<double>& x) const {
  const auto [f, error] = value(x.x, x.y, x.z);
  if (f + error <= least_) return true;
  if (f - error > most_) return false;
  return within_exactly(plane_, separation_, x);
}

std::optional<double> HalfSpace::time(const Vec3<double>& x0, const Vec3<double>& x1) const {
  if (within(x0)) return 0.0;
  if (!within(x1)) return std::nullopt;
  if (bounds_hold_) {
    // Each value has an error below 2^-50 of its bound in double precision: DoubleDouble has relative errors below
    // 2^-102 of the same sum of magnitudes, and may lose 2^-1070 too.
    const DoubleDouble f0 = twice_double(normal_, offset_, x0), f1 = twice_double(normal_, offset_, x1);
    const DoubleDouble square =
        (detail::two_product(normal_.x, normal_.x) + detail::two_product(normal_.y, normal_.y)) +
        detail::two_product(normal_.z, normal_.z);
    const DoubleDouble reach = DoubleDouble(separation_) * square_root(square), way = f0 - f1;
    const double magnitude = std::fabs(normal_.x * x0.x) + std::fabs(normal_.y * x0.y) + std::fabs(normal_.z * x0.z) +
                             std::fabs(normal_.x * x1.x) + std::fabs(normal_.y * x1.y) + std::fabs(normal_.z * x1.z) +
                             std::fabs(offset_) + reach.high;
    if (0x1p-95 * magnitude + 0x1p-1000 < 0x1p-45 * way.high) {
      const DoubleDouble t = (f0 - reach) / way;
      return std::clamp(t.high, 0.0, 1.0);
    }
  }
  return std::clamp(time_exactly(plane_, separation_, x0, x1), 0.0, 1.0);
}

double HalfSpace::change(const Vec3<double>& x0, const Vec3<double>& x1) const {
  return (twice_double(normal_, 0, x1) - twice_double(normal_, 0, x0)).high / length_;
}

double HalfSpace::distance(const Vec3<double>& x) const {
  if (axis_ >= 0) return value(x.x, x.y, x.z).f;
  if (bounds_hold_) {
    const DoubleDouble f = twice_double(normal_, offset_, x);
    const double magnitude =
        std::fabs(normal_.x * x.x) + std::fabs(normal_.y * x.y) + std::fabs(normal_.z * x.z) + std::fabs(offset_);
    if (0x1p-95 * magnitude + 0x1p-1000 < 0x1p-50 * std::fabs(f.high)) return f.high / length_;
  }
  const ExactValues v = exact_values(plane_, x, x);
  return (Scaled(v.f[0], v.low) / root_of(exact_square(plane_, 1))).value();
}

}  // namespace hpccd
