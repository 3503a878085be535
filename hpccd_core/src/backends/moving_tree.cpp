// SPDX-License-Identifier: Apache-2.0
#include "backends/moving_tree.h"

#include <utility>

namespace hpccd {

void MovingTree::bound(Positions t0, Positions t1, const Growth& growth) {
  followed_ = std::exchange(fits_, false);
  motion_.update(scene_, t0, t1, growth, pool_);
}

void MovingTree::bound(Positions vertices, double distance) {
  followed_ = std::exchange(fits_, false);
  motion_.update(scene_, vertices, pool_, distance);
}

void MovingTree::fit(Profiler& profiler) {
  if (refitted(profiler)) return;
  if (own_ && own_->kept && !always_own_) {
    give_up_own();
    if (refitted(profiler)) return;
  }
  if (own_ && !own_->kept && kept_.built && std::exchange(own_->wore_out_common, true)) take_own();
  build_anew();
  profiler.mark("build");
}

// Whether the tree is usable after a refit.
bool MovingTree::refitted(Profiler& profiler) {
  if (!kept_.built) return false;
  refit(kept_.tree, motion_, followed_ ? motion_.resting : std::vector<char>(), pool_);
  profiler.mark("refit");
  fits_ = true;
  const bool serves = !worn_out(kept_.tree.wear, kept_.tree.wear_when_built);
  if (serves && own_ && !own_->kept) own_->wore_out_common = false;
  return serves;
}

void MovingTree::fit_leaves(std::span<const std::uint32_t> leaves) {
  fits_ = false;
  refit_leaves(kept_.tree, motion_, leaves, pool_);
}

void MovingTree::build_anew() {
  static std::atomic<std::uint64_t> number{0};
  fits_ = kept_.built = false;  // in case this is cancelled or runs out of memory
  kept_.number = ++number;
  build(kept_.tree, scene_, features_, motion_, pool_);
  fits_ = kept_.built = true;
}

void MovingTree::take_own() {
  const std::size_t bytes = kept_.tree.bytes();
  if (!budget_->take(bytes)) return;
  own_->bytes = bytes;
  own_->kept = std::make_unique<KeptTree>();
  std::swap(kept_, *own_->kept);
  fits_ = followed_ = false;
}

void MovingTree::give_up_own() {
  std::swap(kept_, *own_->kept);
  budget_->give_back(std::exchange(own_->bytes, 0));
  own_->kept.reset();
  fits_ = followed_ = false;
}

void MovingTree::begin_world(OwnTree& own, TreeBudget& budget, bool always) {
  // The first tree determines the size, which decides whether all worlds may have one.
  own_ = &own, budget_ = &budget, always_own_ = always || (kept_.built && budget.holds_all(kept_.tree.bytes()));
  if (!own.kept && always_own_) own.kept = std::make_unique<KeptTree>();
  if (!own.kept) return;
  std::swap(kept_, *own.kept);
  fits_ = false;
}

void MovingTree::end_world() {
  if (own_->kept) {
    std::swap(kept_, *own_->kept);
    fits_ = false;
  }
  own_ = nullptr, budget_ = nullptr;
}

const std::vector<Box>& MovingTree::swept() {
  motion_.sweep(pool_);
  return motion_.swept;
}

}  // namespace hpccd
