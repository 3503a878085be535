// SPDX-License-Identifier: Apache-2.0
#include "traverse/traverse.h"

#include <algorithm>

#include "traverse/boxes_until.h"
#include "traverse/leaf_hulls.h"
#include "traverse/pair_pool.h"
#include "traverse/snapshot.h"

namespace hpccd {
namespace {

// Nodes that may hold a pair that comes before what was found so far. Boxes count by their Euclidean distance: along
// each axis alone, most of a mesh that is far away along a diagonal is within the smallest distance. Two meshes are met
// with a bound (NearestPairs::begin), so that what is far is not looked at before what is near. Of a cloth of 6 K
// triangles and a ball 7 m away that leaves 85 pairs of leaves of 95,000, and 1.4 ms in place of 170 to 360.
struct NearerBoxes {
  using Ends = AtLeaves;
  static constexpr bool shrink = true;
  const Tree& tree;
  NearestPairs& nearest;
  bool changed() { return true; }
  bool overlap(const Node& a, const Node& b) const {
    float reach = nearest.reach(a.mesh, b.mesh);
    if (reach == std::numeric_limits<float>::infinity()) {
      if (a.mesh == mixed_meshes || b.mesh == mixed_meshes) return true;
      if (a.mesh != b.mesh) nearest.begin(number(a), number(b)), reach = nearest.reach(a.mesh, b.mesh);
    }
    const bool apart = nearest.fine() ? nearest.fine()->farther_apart(number(a), number(b),
                                                                      std::max(nearest.limit(a.mesh, b.mesh), 0.0))
                                      : !a.near_in_snapshot(b, reach) || a.square_of_gap(b) > reach * reach;
    return !apart && open({number(a), number(b)});
  }
  bool within(const Node&) const { return true; }
  bool open(NodePair p) const { return nearest.may_come_before(p.a, p.b); }
  // So that the nearest is taken first, of what overlaps the lowest edge.
  void sort(std::vector<NodePair>& stack, std::size_t begin) const {
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(begin), stack.end(),
              [&](NodePair p, NodePair q) { return key(p) > key(q); });
  }

 private:
  std::uint32_t number(const Node& node) const { return static_cast<std::uint32_t>(&node - tree.nodes.data()); }
  std::pair<double, std::uint32_t> key(NodePair p) const {
    const double square = p.a == p.b       ? 0
                          : nearest.fine() ? nearest.fine()->square_of_gap(p.a, p.b)
                                           : tree.nodes[p.a].square_of_gap(tree.nodes[p.b]);
    return {square, nearest.least_edge(p.a, p.b)};
  }
};

// Nodes that may hold a pair that touches and is not listed.
struct UnlistedBoxes {
  using Ends = AtLeaves;
  static constexpr bool shrink = false;
  const Tree& tree;
  const Drift& drift;
  float until;
  bool overlap(const Node& a, const Node& b) const { return drift.may_touch(number(a), number(b), until); }
  bool within(const Node& a) const { return overlap(a, a); }

 private:
  std::uint32_t number(const Node& node) const { return static_cast<std::uint32_t>(&node - tree.nodes.data()); }
};

const Block& block_of(const Tree& tree, std::uint32_t node) {
  return tree.blocks[tree.block_of_leaf[tree.nodes[node].leaf]];
}

// From pairs that are worth visiting. `between` is called between two of them and may take from the stack; false ends
// the walk.
template <class Boxes, class Between>
void walk(const Tree& tree, const PairRules& rules, Boxes boxes, const Cancellation& cancellation,
          std::vector<NodePair>& stack, Worker& worker, Between&& between) {
  const bool bounded = worker.search().bounded();
  constexpr typename Boxes::Ends ends;
  const auto at_leaves = [&](LeafPair leaves) {
    const std::uint64_t before = worker.leaf_pairs++;
    if (!worker.sink)
      worker.leaf_pairs_time.run(before, worker.elementary_seconds, [&] { test_leaves(tree, rules, leaves, worker); });
    else
      for (const LeafPair left : worker.sink->push(leaves)) test_leaves(tree, rules, left, worker);
  };
  std::size_t stale = 0;  // so many at the bottom were put there when boxes were larger
  while (!stack.empty()) {
    cancellation.heed();
    if (bounded && worker.search().gave_up()) return stack.clear();
    const NodePair p = stack.back();
    stack.pop_back();
    if constexpr (Boxes::shrink) {
      if (boxes.changed()) stale = stack.size() + 1;
      if (stack.size() < stale) {
        stale = stack.size();
        if (!boxes.open(p) || !worth_visiting(tree.nodes, rules, boxes, p)) continue;
      }
    }
    if (is_end(tree.nodes, p, ends)) {
      if constexpr (std::is_same_v<typename Boxes::Ends, AtBlocks>) {
        LeafPair found[block_pairs_capacity];
        const Search& search = worker.search();
        const Block &a = block_of(tree, p.a), &b = block_of(tree, p.b);
        const float excess = search.excess.of(tree.nodes[p.a], tree.nodes[p.b]);
        const std::uint32_t n = excess > 0 ? search.block_pairs_less_excess(tree, a, b, excess, found)
                                           : search.block_pairs(tree, a, b, found);
        for (std::uint32_t i = 0; i < n; ++i) at_leaves(found[i]);
      } else {
        at_leaves({tree.nodes[p.a].leaf, tree.nodes[p.b].leaf});
      }
    } else {
      const std::size_t below = stack.size();
      refine(tree.nodes, p, ends, [&](NodePair q) {
        ++worker.node_pairs;
        if (worth_visiting(tree.nodes, rules, boxes, q)) stack.push_back(q);
      });
      if constexpr (Boxes::shrink) boxes.sort(stack, below);
    }
    if (!between()) return stack.clear();
  }
}

// Whether boxes leave far more pairs of features to be tested than are near: long ones that are slanted to every
// direction of the boxes. Then hulls of leaves are worth their price.
bool boxes_leave_much(const Worker& worker) {
  std::uint64_t tested = 0, near = 0;
  for (const BatchCounts& c : worker.counts) tested += c.tested, near += c.contacts + c.undecided;
  return tested > 4096 && tested > 64 * near;
}

Contact least(const std::vector<Contact>& found) { return *std::min_element(found.begin(), found.end(), before); }

// One contact: vertex-face before edge-edge, of either the first in canonical order.
void keep_least(Worker& worker) {
  if (!worker.vertex_face.empty())
    worker.vertex_face = {least(worker.vertex_face)}, worker.edge_edge.clear();
  else
    worker.edge_edge = {least(worker.edge_edge)};
}

// The task with the lowest number that holds a contact decides, and of it what the first batches find that find
// anything: each task is walked alone, from empty batches on. So the answer does not depend on the threads.
template <class Boxes>
void traverse_any(const Tree& tree, const PairRules& rules, const Boxes& boxes, Search& search, ThreadPool& pool,
                  std::vector<Worker>& workers) {
  // Which contact is reported depends on the list, so it must not depend on the threads.
  constexpr std::size_t enough = 4096;
  const std::vector<NodePair> tasks = traversal_tasks(tree, rules, boxes, enough);
  std::atomic<std::size_t> next{0}, found{tasks.size()};
  pool.run([&](int thread) {
    Worker& worker = workers[thread];
    worker.begin(search);
    worker.best_task = tasks.size();
    std::vector<NodePair> stack;
    for (;;) {
      const std::size_t task = next.fetch_add(1);
      if (task >= tasks.size() || task > found.load()) return;
      worker.begin_task();
      stack.push_back(tasks[task]);
      walk(tree, rules, boxes, *search.cancellation, stack, worker,
           [&] { return !worker.has_found() && task < found.load(std::memory_order_relaxed); });
      if (task > found.load()) return;  // all later ones are too
      if (!worker.has_found()) worker.flush();
      if (!worker.has_found()) continue;
      keep_least(worker);
      worker.best_task = task;
      for (std::size_t before = found.load(); task < before && !found.compare_exchange_weak(before, task);) {
      }
      return;  // what it would take next comes later
    }
  });
  for (Worker& w : workers)
    if (w.best_task != found.load()) w.vertex_face.clear(), w.edge_edge.clear();
}

}  // namespace

void test_leaves(const Tree& tree, const PairRules& rules, LeafPair pair, Worker& worker) {
  const auto node = [&](std::uint32_t leaf) -> const Node& { return tree.nodes[tree.leaf_nodes[leaf]]; };
  const Node &node_a = node(pair.first), &node_b = node(pair.second);
  const LeafRange &a = tree.leaves[pair.first], &b = tree.leaves[pair.second];
  const Search& search = worker.search();
  const Rule rule = rules.rule(node_a, node_b);
  if (search.leaf_pairs) {
    const PartOfMotion part = search.part();
    worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
      const float excess = search.excess.of(node_a, node_b);
      if (part.until < 1 && part.reach >= 0)
        search.leaf_pairs_at_start(tree, a, b, rule.features, part.reach - excess, edge_edge, vertex_face);
      else if (excess > 0)
        search.leaf_pairs_less_excess(tree, a, b, rule.features, excess, edge_edge, vertex_face);
      else if (part.until < 1)
        search.leaf_pairs_until(tree, a, b, rule.features, part.until, edge_edge, vertex_face);
      else
        search.leaf_pairs(tree, a, b, rule.features, edge_edge, vertex_face);
    });
  }
  // Boxes of leaves that do not touch hold no features that do.
  if (search.leaf_edge_faces && (pair.first == pair.second || node_a.near_in_snapshot(node_b, 0)))
    worker.test_edge_faces([&](CandidateBuffer& edge_face) { search.leaf_edge_faces(tree, a, b, edge_face); });
  if (!search.leaf_pairs_in_snapshot) return;
  float reach = search.reach;
  bool first_look = false, far = false;
  if (search.nearest) {
    const double limit = search.nearest->limit(node_a.mesh, node_b.mesh);
    if (limit < 0) return;  // they intersect
    reach = search.nearest->reach(node_a.mesh, node_b.mesh);
    first_look = reach == std::numeric_limits<float>::infinity();
    if (const FineBoxes* fine = search.nearest->fine()) {
      worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
        fine->add_near(a, b, limit, edge_edge, vertex_face);
      });
      if (first_look) worker.flush();
      return;
    }
    far = node_a.mesh != node_b.mesh && !first_look && far_apart(node_a, node_b, reach) && !tree.grown;
    if (far && farther_apart(tree, a, b, reach)) return;
  }
  const bool hulls_tell = pair.first != pair.second && reach > 0 && reach < std::numeric_limits<float>::infinity() &&
                          !tree.grown && !tree.bent;
  if (!far && hulls_tell && boxes_leave_much(worker) && farther_apart(tree, a, b, reach)) return;
  // Smallest distances are of whole surfaces.
  const TestedFeatures tested = search.nearest ? TestedFeatures{} : rule.features;
  worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
    (far ? search.far_pairs : search.leaf_pairs_in_snapshot)(tree, a, b, tested, reach, edge_edge, vertex_face);
  });
  if (first_look) worker.flush();  // any bound is better than none
}

namespace {

template <class Boxes>
void traverse_all(const Tree& tree, const PairRules& rules, const Boxes& boxes, Search& search, ThreadPool& pool,
                  std::vector<Worker>& workers) {
  for (Worker& w : workers) w.begin(search);
  // Enough for the threads to begin with; making 4096 instead took 0.9 of the 4.6 ms of a scene of 18 K triangles.
  constexpr std::size_t enough = 64;
  std::vector<NodePair> tasks = traversal_tasks(tree, rules, boxes, enough);
  if constexpr (Boxes::shrink) boxes.sort(tasks, 0);  // the last is taken first
  PairPool pairs(tree, tasks, pool.size());
  pool.share([&](int thread) {
    Worker& worker = workers[thread];
    BusyThread busy(pairs, thread);
    std::vector<NodePair> stack;
    // What waits for a full batch is tested while there is nothing better to do; a sink's segments are for it to send.
    const auto meanwhile = [&] {
      if (!worker.sink) worker.flush();
    };
    while (busy.next(stack, meanwhile))
      walk(tree, rules, boxes, *search.cancellation, stack, worker, [&] {
        if (pairs.wanted()) pairs.push_half(stack);
        return true;
      });
    worker.flush();
  });
}

}  // namespace

void traverse(const Tree& tree, const PairRules& rules, Search& search, ThreadPool& pool,
              std::vector<Worker>& workers) {
  if (search.nearest)
    traverse_all(tree, rules, NearerBoxes{tree, *search.nearest}, search, pool, workers);
  else if (!search.leaf_pairs)
    traverse_all(tree, rules, SnapshotBoxes{search.reach}, search, pool, workers);
  else if (search.report == Report::any && search.excess.any())
    traverse_any(tree, rules, MotionBoxesLessExcess{search.excess}, search, pool, workers);
  else if (search.report == Report::any)
    traverse_any(tree, rules, MotionBoxes(), search, pool, workers);
  else if (search.drift)
    traverse_all(tree, rules, UnlistedBoxes{tree, *search.drift, std::min(search.until(), 1.0f)}, search, pool,
                 workers);
  else if (search.prunes && search.excess.any())
    traverse_all(tree, rules, BoxesUntilLessExcess{{search}}, search, pool, workers);
  else if (search.prunes)
    traverse_all(tree, rules, BoxesUntil{search}, search, pool, workers);
  else if (search.excess.any())
    traverse_all(tree, rules, MotionBoxesOfBlocksLessExcess{{search.excess}}, search, pool, workers);
  else
    traverse_all(tree, rules, MotionBoxesOfBlocks(), search, pool, workers);
}

}  // namespace hpccd
