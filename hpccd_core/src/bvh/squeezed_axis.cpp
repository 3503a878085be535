// SPDX-License-Identifier: Apache-2.0
#include "bvh/squeezed_axis.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace hpccd {
namespace {

// The length to which longer gaps are shortened so that the total is `wanted` instead of `length`. `gaps`: those above
// `least`.
double longest_gap(std::vector<double>& gaps, double length, double wanted, double least) {
  std::ranges::sort(gaps, std::greater());
  double without = length;  // length without the gaps that are shortened
  for (std::size_t n = 0; n < gaps.size(); ++n) {
    without -= gaps[n];
    const double gap = (wanted - without) / static_cast<double>(n + 1);
    if (gap >= (n + 1 < gaps.size() ? gaps[n + 1] : least)) return gap;
  }
  return least;
}

}  // namespace

SqueezedAxis::SqueezedAxis(std::vector<Stretch>& stretches, double wanted, double least) {
  std::ranges::sort(stretches, {}, &Stretch::low);
  std::vector<double> gaps;
  const double low = stretches.front().low;
  double high = low;
  for (const Stretch& s : stretches) {
    if (s.low - high > least) gaps.push_back(s.low - high);
    high = std::max(high, s.high);
  }
  const double longest = longest_gap(gaps, high - low, wanted, least);
  for (const Stretch& s : stretches) {
    if (!segments_.empty() && s.low - segments_.back().high <= longest) {
      segments_.back().high = std::max(segments_.back().high, s.high);
      continue;
    }
    if (!segments_.empty()) length_ += (segments_.back().high - segments_.back().low) + longest;
    segments_.push_back({s.low, s.high, length_, 0});
  }
  length_ += segments_.back().high - segments_.back().low;
  for (std::size_t i = segments_.size(); i-- > 0;) {
    segments_[i].begin -= 0.5 * length_;
    segments_[i].end = i + 1 < segments_.size() ? segments_[i + 1].begin : std::numeric_limits<double>::infinity();
  }
}

// Monotonic, since each operation is.
float SqueezedAxis::operator()(double x) const {
  auto segment = std::ranges::upper_bound(segments_, x, {}, &Segment::low);
  if (segment != segments_.begin()) --segment;
  const auto [low, high, begin, end] = *segment;
  return static_cast<float>(std::min(begin + (std::clamp(x, low, high) - low), end) * scale_);
}

}  // namespace hpccd
