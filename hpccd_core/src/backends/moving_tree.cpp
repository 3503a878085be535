// SPDX-License-Identifier: Apache-2.0
#include "backends/moving_tree.h"

#include <utility>

namespace hpccd {

void MovingTree::bound(Positions t0, Positions t1, std::span<const double> separations) {
  followed_ = std::exchange(fits_, false);
  motion_.update(scene_, t0, t1, separations, pool_);
}

void MovingTree::bound(Positions vertices) {
  followed_ = std::exchange(fits_, false);
  motion_.update(scene_, vertices, pool_);
}

void MovingTree::fit(Profiler& profiler) {
  if (built_) {
    refit(tree_, motion_, followed_ ? motion_.resting : std::vector<char>(), pool_);
    profiler.mark("refit");
    fits_ = true;
    if (!worn_out(tree_.area, tree_.area_when_built)) return;
  }
  build_anew();
  profiler.mark("build");
}

void MovingTree::fit_leaves(std::span<const std::uint32_t> leaves) {
  fits_ = false;
  refit_leaves(tree_, motion_, leaves, pool_);
}

void MovingTree::build_anew() {
  fits_ = built_ = false;  // should this be cancelled, or find no memory
  ++builds_;
  build(tree_, scene_, features_, motion_, pool_);
  fits_ = built_ = true;
}

const std::vector<Box>& MovingTree::swept() {
  motion_.sweep(pool_);
  return motion_.swept;
}

}  // namespace hpccd
