// SPDX-License-Identifier: Apache-2.0
#include "scene/separation_table.h"

#include <algorithm>

#include "base/length.h"

namespace hpccd {

SeparationTable::SeparationTable(const Scene& scene, double otherwise)
    : tested_(scene), of_(scene.meshes().size(), otherwise) {
  check_length("minimum_separation", otherwise);
  if (tested_.n_pairs() > 0) n_with_value_[otherwise] = tested_.n_pairs();
  for (const auto& [pair, separation] : ScenePairs(scene).separation()) set(pair.first, pair.second, separation);
  largest_.resize(scene.meshes().size());
  for (std::uint32_t a = 0; a < largest_.size(); ++a) largest_[a] = largest_of(a);
  look_at_all();
}

void SeparationTable::set(std::uint32_t a, std::uint32_t b, double separation) {
  if (!tested_.of(a, b)) return of_.set(a, b, separation);
  const double before = of(a, b);
  // This line and the next two may throw bad_alloc, so nothing is counted before them.
  std::size_t& n = n_with_value_[separation];
  changed_.push_back({a, b});
  of_.set(a, b, separation);
  ++n, ++version_;
  const auto as_before = n_with_value_.find(before);
  if (--as_before->second == 0) n_with_value_.erase(as_before);
}

double SeparationTable::largest_of(std::uint32_t mesh) const {
  double largest = 0;
  std::size_t n = 0;
  of_.for_pairs_of(mesh, [&](std::uint32_t other, double d) {
    if (!tested_.of(mesh, other)) return;
    largest = std::max(largest, d);
    ++n;
  });
  return n < tested_.n_with(mesh) ? std::max(largest, of_.otherwise()) : largest;
}

void SeparationTable::settle() {
  std::vector<std::uint32_t> meshes;
  for (const auto& pair : changed_) meshes.insert(meshes.end(), pair.begin(), pair.end());
  std::ranges::sort(meshes);
  meshes.erase(std::ranges::unique(meshes).begin(), meshes.end());
  for (const std::uint32_t mesh : meshes) largest_[mesh] = largest_of(mesh);
  look_at_all();
}

void SeparationTable::look_at_all() {
  changed_.clear();
  std::erase_if(n_with_value_, [](const auto& entry) { return entry.second == 0; });
  uniform_ = n_with_value_.size() <= 1;
  first_ = n_with_value_.empty() ? 0 : n_with_value_.begin()->first;
  most_ = n_with_value_.empty() ? 0 : n_with_value_.rbegin()->first;
}

}  // namespace hpccd
