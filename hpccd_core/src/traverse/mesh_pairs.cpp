// SPDX-License-Identifier: Apache-2.0
#include "traverse/mesh_pairs.h"

namespace hpccd {

MeshPairs::MeshPairs(const PairRules& rules, std::size_t n_meshes) : n_(n_meshes), number_(n_meshes * n_meshes) {
  for (std::uint32_t a = 0; a < n_; ++a)
    for (std::uint32_t b = a; b < n_; ++b) {
      if (!rules.tested(a, b)) continue;
      number_[a * n_ + b] = number_[b * n_ + a] = static_cast<std::uint32_t>(pairs_.size());
      pairs_.push_back({a, b});
    }
}

}  // namespace hpccd
