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
  if (kept_.built) {
    refit(kept_.tree, motion_, followed_ ? motion_.resting : std::vector<char>(), pool_);
    profiler.mark("refit");
    fits_ = true;
    if (!worn_out(kept_.tree.area, kept_.tree.area_when_built)) return;
    if (own_ && !*own_ && common_is_new_ && own_trees_->room_for(kept_.tree.bytes())) set_common_aside();
  }
  build_anew();
  profiler.mark("build");
}

void MovingTree::fit_leaves(std::span<const std::uint32_t> leaves) {
  fits_ = false;
  refit_leaves(kept_.tree, motion_, leaves, pool_);
}

void MovingTree::build_anew() {
  static std::atomic<std::uint64_t> number{0};
  fits_ = kept_.built = false;  // should this be cancelled, or find no memory
  if (own_ && !*own_) common_is_new_ = true;
  kept_.number = ++number;
  build(kept_.tree, scene_, features_, motion_, pool_);
  fits_ = kept_.built = true;
}

void MovingTree::set_common_aside() {
  own_trees_->add(kept_.tree.bytes());
  *own_ = std::make_unique<Kept>();
  std::swap(kept_, **own_);
  fits_ = false;
}

void MovingTree::begin_world(std::unique_ptr<Kept>& own, OwnTrees& all, bool always) {
  own_ = &own, own_trees_ = &all;
  if (!own && always) own = std::make_unique<Kept>();
  if (!own) return;
  std::swap(kept_, *own);
  fits_ = false;
}

void MovingTree::end_world() {
  if (*own_) {
    std::swap(kept_, **own_);
    fits_ = false;
  }
  own_ = nullptr, own_trees_ = nullptr;
}

const std::vector<Box>& MovingTree::swept() {
  motion_.sweep(pool_);
  return motion_.swept;
}

}  // namespace hpccd
