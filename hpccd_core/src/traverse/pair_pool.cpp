// SPDX-License-Identifier: Apache-2.0
#include "traverse/pair_pool.h"

#include <algorithm>
#include <mutex>

namespace hpccd {
namespace {

std::size_t first_leaf(const Tree& tree, std::uint32_t node) {
  while (tree.nodes[node].children) node = tree.nodes[node].children;
  return tree.nodes[node].leaf;
}

}  // namespace

PairPool::PairPool(const Tree& tree, const std::vector<NodePair>& pairs, int threads)
    : tree_(tree), lists_(static_cast<std::size_t>(threads) + 1), waiting_pairs_(pairs.size()) {
  for (const NodePair& p : pairs)
    lists_[first_leaf(tree, p.a) * static_cast<std::size_t>(threads) / tree.leaves.size()].push_back(p);
}

void PairPool::push_half(std::vector<NodePair>& stack) {
  // Below this a pair costs less than its transfer.
  constexpr int worth_moving = 16 * Tree::leaf_size;
  const std::size_t half = stack.size() / 2;
  if (half == 0 || tree_.nodes[stack[0].a].primitives + tree_.nodes[stack[0].b].primitives < worth_moving) return;
  const auto end = stack.begin() + static_cast<std::ptrdiff_t>(half);
  {
    std::lock_guard lock(lock_);
    lists_.back().insert(lists_.back().end(), stack.begin(), end);
    waiting_pairs_ += half;
  }
  stack.erase(stack.begin(), end);
}

bool PairPool::pop_one(int thread, std::vector<NodePair>& stack) {
  std::lock_guard lock(lock_);
  std::vector<NodePair>* list = &lists_[static_cast<std::size_t>(thread)];
  if (list->empty()) list = &lists_.back();
  if (list->empty())
    list = &*std::max_element(lists_.begin(), lists_.end(), [](auto& a, auto& b) { return a.size() < b.size(); });
  if (list->empty()) return false;
  stack.push_back(list->back());
  list->pop_back();
  ++busy_;
  --waiting_pairs_;
  return true;
}

// No pair is lost: a thread that gives pairs away asks for another one before it ends.
bool PairPool::wait(int thread, std::vector<NodePair>& stack) {
  bool got = false;
  for (ActiveWait wait; !got && !abandoned_;) {
    // Read `busy` first: a thread that gives pairs stays busy until it has given them.
    const bool all_idle = busy_ == 0;
    if (waiting_pairs_ > 0)
      got = pop_one(thread, stack);
    else if (all_idle)
      break;
    wait.turn();
  }
  return got;
}

}  // namespace hpccd
