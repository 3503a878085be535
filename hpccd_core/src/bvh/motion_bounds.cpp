// SPDX-License-Identifier: Apache-2.0
#include "bvh/motion_bounds.h"

#include <cmath>
#include <string>

namespace hpccd {
namespace {

struct Extent {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  bool good = true;
};

// NaN fails the comparison as well.
bool acceptable(double x) { return std::fabs(x) <= largest_coordinate; }

template <class Real>
Extent extent_of(const Real* x, std::size_t begin, std::size_t end) {
  Extent e;
  for (std::size_t i = begin; i < end; ++i)
    for (int k = 0; k < 3; ++k) {
      const double value = x[3 * i + k];
      e.good = e.good && acceptable(value);
      e.low[k] = std::min(e.low[k], value);
      e.high[k] = std::max(e.high[k], value);
    }
  return e;
}

template <class Real>
[[noreturn]] void report_bad(const char* name, const Real* x, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      const double value = x[3 * i + k];
      if (acceptable(value)) continue;
      const std::string where = std::string(name) + "[" + std::to_string(i) + ", " + std::to_string(k) + "] is ";
      if (!std::isfinite(value))
        throw InvalidArgument(where + (std::isnan(value) ? "NaN" : "infinite") + "; all coordinates must be finite");
      throw InvalidArgument(where + std::to_string(value) +
                            ", beyond 1e150: intermediate results could overflow; scale the scene down");
    }
  throw InvalidArgument(std::string(name) + " changed while it was being read");
}

template <class Real>
void copy_motion(const Real* t0, const Real* t1, const CoordinateMap& map, double margin, std::size_t begin,
                 std::size_t end, VertexRow* rows, Box* boxes) {
  for (std::size_t i = begin; i < end; ++i)
    for (int k = 0; k < 3; ++k) {
      const double a = t0[3 * i + k], b = t1[3 * i + k];
      rows[i].t0[k] = a;
      rows[i].t1[k] = b;
      boxes[i].low[k] = map((a < b ? a : b) - margin, k);
      boxes[i].high[k] = map((a < b ? b : a) + margin, k);
    }
}

template <class Real>
void take_positions(MotionBounds& m, const Real* t0, const Real* t1, std::size_t n, double separation,
                    ThreadPool& pool) {
  constexpr std::size_t grain = 1024;
  std::vector<Extent> extents((n + grain - 1) / grain * 2);
  parallel_for(pool, extents.size(), 1, [&](std::size_t from, std::size_t to, int) {
    for (std::size_t i = from; i < to; ++i) {
      const std::size_t begin = i / 2 * grain;
      extents[i] = extent_of(i % 2 ? t1 : t0, begin, std::min(begin + grain, n));
    }
  });
  Extent whole;
  for (const Extent& e : extents) {
    whole.good = whole.good && e.good;
    for (int k = 0; k < 3; ++k) {
      whole.low[k] = std::min(whole.low[k], e.low[k]);
      whole.high[k] = std::max(whole.high[k], e.high[k]);
    }
  }
  if (!whole.good) {
    if (!extent_of(t0, 0, n).good) report_bad("vertices_t0", t0, n);
    report_bad("vertices_t1", t1, n);
  }
  if (n > 0) m.map = CoordinateMap::around(whole.low, whole.high);
  // Half the separation to each side, and what rounding x - margin and x + margin can lose.
  double most = 0;
  for (int k = 0; k < 3 && n > 0; ++k) most = std::max({most, std::fabs(whole.low[k]), std::fabs(whole.high[k])});
  const double margin = separation > 0 ? 0.5 * separation + 4.5e-16 * (most + separation) : 0;
  m.rows.resize(n);
  m.boxes.resize(n);
  parallel_for(pool, n, grain, [&](std::size_t begin, std::size_t end, int) {
    copy_motion(t0, t1, m.map, margin, begin, end, m.rows.data(), m.boxes.data());
  });
}

}  // namespace

void MotionBounds::take(Positions t0, Positions t1, double separation, ThreadPool& pool) {
  if (t0.is_double)
    take_positions(*this, static_cast<const double*>(t0.data), static_cast<const double*>(t1.data), t0.n, separation,
                   pool);
  else
    take_positions(*this, static_cast<const float*>(t0.data), static_cast<const float*>(t1.data), t0.n, separation,
                   pool);
}

}  // namespace hpccd
