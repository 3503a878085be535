// SPDX-License-Identifier: Apache-2.0
// The state of one thread during the traversal. Candidates wait in small buffers until a batch is full, are tested,
// and only contacts remain. Candidates are never all stored.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "elementary/pair.h"
#include "traverse/sampled_time.h"
#include "traverse/search.h"

namespace hpccd {

// Takes pairs of leaves that are tested elsewhere.
class PairSink {
 public:
  virtual ~PairSink() = default;
  // Returns the pairs, among all pushed ones, that the caller must test itself. They are valid until the next call.
  virtual std::span<const LeafPair> push(LeafPair pair) = 0;
  virtual void flush() = 0;  // no more pairs for now
};

// Pairs of one kind that are tested by one rule.
struct PairGroup {
  Kind kind;
  Rule rule;
  std::vector<std::uint32_t> first, second;
  bool tested_like(const PairGroup& o) const { return kind == o.kind && rule.number() == o.rule.number(); }
};

// If contacts bound the search, early ones matter most: the first batches are small.
inline constexpr std::uint32_t first_batch = 64, first_batches = 32;

// Aligned: counters of two threads on one cache line cost a fifth of a small scene's traversal.
class alignas(128) Worker {
 public:
  void begin(Search& search);
  // Begins one of several tasks whose results do not depend on earlier ones: batches start empty, and are small at
  // first.
  void begin_task();
  // Tests candidates by the rule, now or later: add(edge_edge, vertex_face) appends at most
  // CandidateBuffer::most_per_call pairs to each.
  template <class Add>
  void test_candidates(Rule rule, Add&& add) {
    Waiting& waiting = waiting_by(rule);
    const std::uint32_t n_edge_edge = waiting.edge_edge.n, n_vertex_face = waiting.vertex_face.n;
    add(waiting.edge_edge, waiting.vertex_face);
    if (rule.filtered) {
      drop_ignored(waiting.edge_edge, n_edge_edge, Kind::edge_edge);
      drop_ignored(waiting.vertex_face, n_vertex_face, Kind::vertex_face);
    }
    if (search_->edge_kinds) drop_points_at_faces(waiting.edge_edge, n_edge_edge);
    const std::uint32_t full = full_batch();
    if (waiting.edge_edge.n >= full) drain(waiting.edge_edge, Kind::edge_edge, rule, full);
    if (waiting.vertex_face.n >= full) drain(waiting.vertex_face, Kind::vertex_face, rule, full);
  }
  // The same for edge-face pairs: add(edge_face).
  template <class Add>
  void test_edge_faces(Rule rule, Add&& add) {
    if (!edge_faces_) edge_faces_ = std::make_unique<CandidateBuffer>();
    const std::uint32_t n = edge_faces_->n;
    add(*edge_faces_);
    if (rule.filtered) drop_ignored(*edge_faces_, n, Kind::edge_face);
    if (search_->edge_kinds) drop_points(*edge_faces_, n);
    if (edge_faces_->n >= batch_capacity) drain(*edge_faces_, Kind::edge_face, {}, batch_capacity);
  }
  // Tests pairs of one kind immediately.
  void test_pairs(std::span<const std::uint32_t> first, std::span<const std::uint32_t> second, Kind kind, Rule rule);
  const Search& search() const { return *search_; }
  // Whether boxes leave far more pairs of features than are near, because long features are slanted to all directions
  // of the boxes. Then hulls of leaves are worth their cost.
  bool boxes_leave_much() const { return boxes_leave_much_; }
  bool has_found() const { return !vertex_face.empty() || !edge_edge.empty(); }
  void flush();  // tests incomplete batches
  // Runs the tier's fallback on an undecided pair, and takes a contact found elsewhere. apart_until: see UndecidedPair.
  void resolve(const Candidate& candidate, Rule rule, double apart_until = 0);
  void report(Kind kind, const Contact& contact);
  // Throws if cancelled; called between any two pairs of nodes, batches and fallbacks.
  void heed_cancellation() const { search_->cancellation->heed(); }
  std::size_t bytes() const;

  std::vector<Contact> vertex_face, edge_edge, edge_face;
  BatchCounts counts[3];  // by kind
  FallbackCounts fallbacks[3];
  std::uint64_t ignored[3] = {};  // candidates dropped by filters, by kind
  std::uint64_t node_pairs = 0, leaf_pairs = 0;
  double elementary_seconds = 0;
  std::uint64_t elementary_ticks = 0;      // the same time, for the share of the k-DOP filter in it
  SampledTime leaf_pairs_time;             // without the tests of the candidates
  PairSink* sink = nullptr;                // for pairs of leaves that are tested elsewhere
  std::vector<PairGroup>* kept = nullptr;  // candidates that will be tested again
  std::size_t best_task = 0;               // for report "any": the task of these contacts

 private:
  struct Waiting {
    CandidateBuffer edge_edge, vertex_face;
  };
  Waiting& waiting_by(Rule rule) {
    auto& waiting = waiting_[rule.number()];
    if (!waiting) waiting = std::make_unique<Waiting>();
    return *waiting;
  }
  std::uint32_t full_batch() const {
    return grows_batches_ ? growing_batch_ : first_batches_ > 0 ? first_batch : batch_capacity;
  }
  void drop_ignored(CandidateBuffer& buffer, std::uint32_t begin, Kind kind);
  // Of the pairs from `begin` on.
  void drop_points_at_faces(CandidateBuffer& edge_edge, std::uint32_t begin) const;
  void drop_points(CandidateBuffer& edge_face, std::uint32_t begin) const;
  void drain(CandidateBuffer& buffer, Kind kind, Rule rule, std::uint32_t keep_below);
  void keep(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind, Rule rule);
  void test(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind, Rule rule);
  void test_thick(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind, Rule rule);
  void test_batch(const Geometry& geometry, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                  Kind kind, Rule rule);
  const Geometry& geometry_of(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind);
  std::vector<Contact>& found(Kind kind);
  Geometry limited_;

  Search* search_ = nullptr;
  std::unique_ptr<Waiting> waiting_[n_rules];
  std::unique_ptr<CandidateBuffer> edge_faces_;
  std::unique_ptr<BatchResult> result_;
  std::uint32_t first_batches_ = 0;
  // For the search for any contact, which ends with the first batch that has one, and for nearest pairs: small if the
  // last batch had a nearer pair, after which fewer tests remain.
  bool grows_batches_ = false;
  std::uint32_t growing_batch_ = first_batch;
  bool nearer_ = false, boxes_leave_much_ = false;
  std::vector<double> limits_;                 // of the candidates of a batch, unless they are in a table
  std::vector<std::uint32_t> first_, second_;  // the pairs of a batch, those with a separation first
};

}  // namespace hpccd
