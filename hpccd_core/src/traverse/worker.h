// SPDX-License-Identifier: Apache-2.0
// What one thread carries through the traversal: candidates wait in small buffers until a batch is full, are tested,
// and only contacts stay. Candidates are never all kept.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "base/cancellation.h"
#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "elementary/inclusion.h"
#include "elementary/pair.h"
#include "traverse/leaf_pairs.h"

namespace hpccd {

// What all threads share during one call.
struct Search {
  Geometry geometry;
  BatchTest batch_test[4];  // by accuracy
  LeafPairs leaf_pairs;
  Report report;
  inclusion::Limits limits;
  std::atomic<double> earliest;  // best time so far, where report is first
  const Cancellation* cancellation = &never_cancelled;
};

// Two leaves whose boxes overlap, by number. For the published methods a leaf is one triangle: the paper's triangle
// indices.
struct LeafPair {
  std::uint32_t first, second;
};

// Takes pairs of leaves that somebody else shall test.
class PairSink {
 public:
  virtual ~PairSink() = default;
  // Returns the pairs, of all that it was given, that the caller shall test itself; they stay until the next call.
  virtual std::span<const LeafPair> push(LeafPair pair) = 0;
  virtual void flush() = 0;  // no more for now
};

// Contacts within this of the earliest count as simultaneous: the accuracy promised for times of contact.
inline constexpr double simultaneous = 1e-12;

// Aligned: counters of two threads on one cache line cost a fifth of a small scene's traversal.
class alignas(128) Worker {
 public:
  void begin(Search& search);
  // Tests candidates at `accuracy`, sooner or later: add(edge_edge, vertex_face) appends at most
  // CandidateBuffer::most_per_call pairs to each.
  template <class Add>
  void test_candidates(Accuracy accuracy, Add&& add) {
    Waiting& waiting = waiting_at(accuracy);
    add(waiting.edge_edge, waiting.vertex_face);
    if (waiting.edge_edge.n >= batch_capacity) drain(waiting.edge_edge, Kind::edge_edge, accuracy, batch_capacity);
    if (waiting.vertex_face.n >= batch_capacity)
      drain(waiting.vertex_face, Kind::vertex_face, accuracy, batch_capacity);
  }
  const Search& search() const { return *search_; }
  void flush();  // tests what waits
  // The tier's fallback on a pair that nothing else decides, and a contact found elsewhere.
  void resolve(const Candidate& candidate, Accuracy accuracy);
  void report(Kind kind, const Contact& contact);
  // Ends the work where that is requested: between any two pairs of nodes, batches and fallbacks.
  void heed_cancellation() const { search_->cancellation->heed(); }
  std::size_t bytes() const;

  std::vector<Contact> vertex_face, edge_edge;
  BatchCounts counts[2];  // vertex-face, edge-edge
  FallbackCounts fallbacks[2];
  std::uint64_t node_pairs = 0, leaf_pairs = 0;
  double elementary_seconds = 0;
  PairSink* sink = nullptr;   // where pairs of leaves are left to somebody else
  std::size_t best_task = 0;  // where report is any: the task these contacts come from

 private:
  struct Waiting {
    CandidateBuffer edge_edge, vertex_face;
  };
  Waiting& waiting_at(Accuracy accuracy) {
    auto& waiting = waiting_[static_cast<int>(accuracy)];
    if (!waiting) waiting = std::make_unique<Waiting>();
    return *waiting;
  }
  void drain(CandidateBuffer& buffer, Kind kind, Accuracy accuracy, std::uint32_t keep_below);
  void test(const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n, Kind kind, Accuracy accuracy);

  Search* search_ = nullptr;
  std::unique_ptr<Waiting> waiting_[4];  // by accuracy
  std::unique_ptr<BatchResult> result_;
};

}  // namespace hpccd
