// SPDX-License-Identifier: Apache-2.0
#include "scene/separation_table.h"

#include <algorithm>

#include "base/length.h"

namespace hpccd {

SeparationTable::SeparationTable(const Scene& scene, double otherwise) : n_(scene.meshes().size()) {
  check_length("minimum_separation", otherwise);
  of_.resize(n_ * n_);
  for (std::uint32_t a = 0; a < n_; ++a)
    for (std::uint32_t b = 0; b < n_; ++b) of_[a * n_ + b] = scene.pair_separation(a, b, otherwise);
  settle();
}

void SeparationTable::set(std::uint32_t a, std::uint32_t b, double separation) {
  of_[a * n_ + b] = of_[b * n_ + a] = separation;
  ++version_;
}

void SeparationTable::settle() {
  const auto differs = [&](double d) { return d != of_[0]; };
  uniform_ = std::none_of(of_.begin(), of_.end(), differs);
  most_ = of_.empty() ? 0 : *std::max_element(of_.begin(), of_.end());
  any_ = most_ > 0;
  largest_.clear();
  for (std::size_t a = 0; any_ && a < n_; ++a)
    largest_.push_back(*std::max_element(of_.begin() + a * n_, of_.begin() + (a + 1) * n_));
}

}  // namespace hpccd
