// SPDX-License-Identifier: Apache-2.0
// What a list of near pairs leaves open where the motion goes farther than it reaches: pairs of leaves that go apart by
// more. On meshes that hang together these are few, and only their boxes are looked at.
#include <algorithm>
#include <utility>

#include "backends/cpu_backend.h"
#include "traverse/traverse.h"

namespace hpccd {
namespace {

// By leaf. A search of the whole tree comes to about eight; more than two, with their boxes and the list, cost as much.
constexpr std::size_t most_open = 2;

// Keeps the pairs of leaves of a search that finds so many at most, instead of testing them; for as long as it lives.
class OpenPairs {
 public:
  OpenPairs(Search& search, std::vector<Worker>& workers, std::size_t most)
      : search_(search), workers_(workers), sinks_(workers.size(), Sink(search)) {
    search.most_found = most, search.n_found = 0;
    for (std::size_t i = 0; i < workers.size(); ++i) workers[i].sink = &sinks_[i];
  }
  ~OpenPairs() {
    for (Worker& w : workers_) w.sink = nullptr;
    search_.most_found = std::numeric_limits<std::size_t>::max();
  }
  OpenPairs(const OpenPairs&) = delete;
  OpenPairs& operator=(const OpenPairs&) = delete;

  std::vector<LeafPair> all() const {
    std::vector<LeafPair> pairs;
    for (const Sink& s : sinks_) pairs.insert(pairs.end(), s.pairs.begin(), s.pairs.end());
    return pairs;
  }

 private:
  class Sink final : public PairSink {
   public:
    explicit Sink(Search& search) : search_(search) {}
    std::span<const LeafPair> push(LeafPair pair) override {
      ++search_.n_found;
      pairs.push_back(pair);
      return {};
    }
    void flush() override {}
    std::vector<LeafPair> pairs;

   private:
    Search& search_;
  };

  Search& search_;
  std::vector<Worker>& workers_;
  std::vector<Sink> sinks_;
};

std::vector<std::uint32_t> leaves_of(const std::vector<LeafPair>& pairs, std::size_t n_leaves) {
  std::vector<char> seen(n_leaves, false);
  std::vector<std::uint32_t> leaves;
  for (const LeafPair p : pairs)
    for (const std::uint32_t leaf : {p.first, p.second})
      if (!std::exchange(seen[leaf], true)) leaves.push_back(leaf);
  return leaves;
}

struct FoundContacts {
  std::vector<Contact> vertex_face, edge_edge;
};

FoundContacts take_found(std::vector<Worker>& workers) {
  FoundContacts found;
  for (Worker& w : workers)
    for (auto [from, to] : {std::pair(&w.vertex_face, &found.vertex_face), std::pair(&w.edge_edge, &found.edge_edge)}) {
      to->insert(to->end(), from->begin(), from->end());
      from->clear();
    }
  return found;
}

// The earliest of two looks, each once: what is listed may lie in leaves that were left open.
void join_found(FoundContacts found, double earliest, std::vector<Worker>& workers) {
  const FoundContacts others = take_found(workers);
  const auto join = [&](std::vector<Contact>& list, const std::vector<Contact>& more) {
    list.insert(list.end(), more.begin(), more.end());
    std::erase_if(list, [&](const Contact& c) { return c.toc > earliest; });
    const auto key = [](const Contact& c) { return std::pair(c.first, c.second); };
    std::ranges::sort(list, {}, key);
    const auto twice = std::ranges::unique(list, {}, key);
    list.erase(twice.begin(), twice.end());
  };
  join(found.vertex_face, others.vertex_face), join(found.edge_edge, others.edge_edge);
  workers.front().vertex_face = std::move(found.vertex_face);
  workers.front().edge_edge = std::move(found.edge_edge);
}

}  // namespace

// After the pairs of the list: what it leaves open. False where that is too much, where there is no list, or no tree to
// look with: a world takes its list along to whatever thread's tree is there.
bool CpuBackend::known_from_the_unlisted(bool time_only) {
  if (!shared_.tree.built()) return false;
  if (!near_.radius().known() || near_.snapshot().size() != shared_.tree.motion().vertices.size()) return false;
  see_drift();
  drift_.listed_within(near_.radius().listed(), shared_.separations.most());
  FoundContacts found = take_found(workers_);
  const std::optional<std::vector<LeafPair>> open = open_pairs();
  shared_.profiler.mark("near_pairs");
  if (!open) return false;
  near_.radius().helped();
  if (!open->empty()) {
    shared_.tree.fit_leaves(leaves_of(*open, shared_.tree.tree().leaves.size()));
    shared_.profiler.mark("refit");
    limit_reach();
    test_leaves_of_tree(*open);
  }
  if (!time_only) join_found(std::move(found), search_.earliest, workers_);
  mark_traversal();
  return true;
}

// The radius of a list that leaves little open of this motion.
std::optional<double> CpuBackend::wide_radius() {
  near_.begin_at(shared_.tree.motion().vertices, shared_.pool);
  see_drift();
  constexpr double longest = 0.6;  // of an edge; at 0.7 all neighbours of a regular mesh are near
  const std::size_t n_leaves = shared_.tree.tree().leaves.size();
  for (const double part : {0.25, 0.4, longest}) {
    drift_.listed_within(part * edge_, shared_.separations.most());
    const std::optional<std::vector<LeafPair>> open = open_pairs();
    if (open && open->size() <= (part < longest ? n_leaves / 2 : n_leaves)) return part * edge_ / 2;
  }
  near_.radius().gave_up_wider();
  return std::nullopt;
}

void CpuBackend::see_drift() {
  const Tree& tree = shared_.tree.tree();
  if (const std::pair now(near_.number(), shared_.tree.number()); drift_of_ != now) {
    drift_of_.reset();  // should this be cancelled
    drift_.begin(tree, near_.snapshot(), shared_.pool);
    drift_of_ = now;
  }
  drift_.fit(tree, shared_.tree.motion().vertices, near_.snapshot(), shared_.pool);
}

// Pairs of leaves that may touch and are not all listed; nothing where there are too many.
std::optional<std::vector<LeafPair>> CpuBackend::open_pairs() {
  const OpenPairs open(search_, workers_, most_open * shared_.tree.tree().leaves.size());
  search_.drift = &drift_;
  hpccd::traverse(shared_.tree.tree(), shared_.rules, search_, shared_.pool, workers_);
  search_.drift = nullptr;
  if (search_.gave_up()) return std::nullopt;
  return open.all();
}

}  // namespace hpccd
