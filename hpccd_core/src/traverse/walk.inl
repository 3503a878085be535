// SPDX-License-Identifier: Apache-2.0
// The traversal of node pairs, in two forms: of all pairs, or until any contact is found. It is included in an unnamed
// namespace of several sources: the number of box types in a source affects how much of the traversal the compiler
// inlines, and three more types in one source slowed down each of the others by a tenth.

const Block& block_of(const Tree& tree, std::uint32_t node) {
  return tree.blocks[tree.block_of_leaf[tree.nodes[node].leaf]];
}

// Starts from pairs worth visiting. `between` is called between two pairs and may take pairs from the stack; the
// traversal ends if it returns false.
template <class Boxes, class Query, class Between>
void walk(Boxes boxes, const Query& search, std::vector<NodePair>& stack, Worker& worker, Between&& between) {
  const Tree& tree = search.tree;
  const PairRules& rules = search.rules;
  const Cancellation& cancellation = *search.cancellation;
  const bool bounded = search.bounded();
  constexpr typename Boxes::Ends ends;
  const auto at_leaves = [&](LeafPair leaves) {
    const std::uint64_t before = worker.leaf_pairs++;
    if (!worker.sink)
      worker.leaf_pairs_time.run(before, worker.elementary_seconds, [&] { search.test_leaves(leaves, worker); });
    else
      for (const LeafPair left : worker.sink->push(leaves)) search.test_leaves(left, worker);
  };
  std::size_t stale = 0;  // pairs at the bottom that were pushed when boxes were larger
  while (!stack.empty()) {
    cancellation.heed();
    if (bounded && search.gave_up()) return stack.clear();
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
        const std::uint32_t n = boxes.leaf_pairs(block_of(tree, p.a), block_of(tree, p.b), found);
        for (std::uint32_t i = 0; i < n; ++i) {
          // Leaves of a large scene are not in the cache, and hardware does not foresee which ones come.
          if (i + 1 < n) {
            if (found[i + 1].first != found[i].first) tree.prefetch(found[i + 1].first);
            tree.prefetch(found[i + 1].second);
          }
          at_leaves(found[i]);
        }
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

Contact least(const std::vector<Contact>& found) { return *std::min_element(found.begin(), found.end(), before); }

// Keeps one contact: vertex-face before edge-edge, the first one in canonical order.
void keep_least(Worker& worker) {
  if (!worker.vertex_face.empty())
    worker.vertex_face = {least(worker.vertex_face)}, worker.edge_edge.clear();
  else
    worker.edge_edge = {least(worker.edge_edge)};
}

// The task with the lowest number that has a contact decides, by its first batches that find one. Each task is
// traversed separately and starts with empty batches, so the result does not depend on the threads.
template <class Boxes, class Query>
void traverse_any(const Boxes& boxes, Query& search, ThreadPool& pool, std::vector<Worker>& workers) {
  // The list of tasks affects which contact is reported, so it must not depend on the threads.
  constexpr std::size_t enough = 4096;
  const std::vector<NodePair> tasks = traversal_tasks(search.tree, search.rules, boxes, enough);
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
      walk(boxes, search, stack, worker,
           [&] { return !worker.has_found() && task < found.load(std::memory_order_relaxed); });
      if (task > found.load()) return;  // so are all later tasks
      if (!worker.has_found()) worker.flush();
      if (!worker.has_found()) continue;
      keep_least(worker);
      worker.best_task = task;
      for (std::size_t before = found.load(); task < before && !found.compare_exchange_weak(before, task);) {
      }
      return;  // any task it would take next comes later
    }
  });
  for (Worker& w : workers)
    if (w.best_task != found.load()) w.vertex_face.clear(), w.edge_edge.clear();
}

template <class Boxes, class Query>
void traverse_all(const Boxes& boxes, Query& search, ThreadPool& pool, std::vector<Worker>& workers) {
  for (Worker& w : workers) w.begin(search);
  // Enough tasks for the threads to begin with; creating 4096 instead took 0.9 of the 4.6 ms of a scene of 18 K
  // triangles.
  constexpr std::size_t enough = 64;
  std::vector<NodePair> tasks = traversal_tasks(search.tree, search.rules, boxes, enough);
  if constexpr (Boxes::shrink) boxes.sort(tasks, 0);  // the last pair is processed first
  // A few pairs of leaves take less time than to wake a thread.
  constexpr typename Boxes::Ends ends;
  const bool few = std::is_same_v<typename Boxes::Ends, AtLeaves> && tasks.size() <= enough &&
                   std::ranges::all_of(tasks, [&](NodePair p) { return is_end(search.tree.nodes, p, ends); });
  PairPool pairs(search.tree, tasks, few ? 1 : pool.size());
  const auto job = [&](int thread) {
    Worker& worker = workers[thread];
    BusyThread busy(pairs, thread);
    std::vector<NodePair> stack;
    // Incomplete batches are tested while the thread has nothing else to do; a sink sends its own segments.
    const auto meanwhile = [&] {
      if (!worker.sink) worker.flush();
    };
    while (busy.next(stack, meanwhile))
      walk(boxes, search, stack, worker, [&] {
        if (pairs.wanted()) pairs.push_half(stack);
        return true;
      });
    worker.flush();
  };
  few ? job(0) : pool.share(job);
}
