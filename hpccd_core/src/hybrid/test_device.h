// SPDX-License-Identifier: Apache-2.0
// The interface of a device that runs elementary tests, as used by the communication thread (Kim et al. 2009, section
// 5). All calls come from one thread and return at once. Each may throw, which leaves the frame to the CPU.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bvh/tree.h"
#include "elementary/batch.h"
#include "elementary/pair.h"
#include "hpccd/hpccd.h"
#include "traverse/worker.h"

namespace hpccd::hybrid {

// The features in each leaf. `version` changes with the leaves.
struct LeafTable {
  const std::vector<LeafRange>* leaves = nullptr;
  const std::vector<std::uint32_t>*face_of_slot = nullptr, *edge_of_slot = nullptr, *vertex_of_slot = nullptr;
  std::uint64_t version = 0;
};

// The results of elements of the GPU task queue.
struct Output {
  std::vector<Contact> vertex_face, edge_edge;
  std::vector<Candidate> undecided;  // pairs that only exact arithmetic on the CPU decides
  BatchCounts counts[2];             // vertex-face, edge-edge
  std::uint64_t ignored[2] = {};     // candidates dropped by filters
};

// Index pairs that are contiguous in memory.
struct Piece {
  const LeafPair* pairs;
  std::size_t n;
};

using Ticket = std::size_t;

class TestDevice {
 public:
  virtual ~TestDevice() = default;
  // Memory from which the device reads index pairs while other threads write elsewhere in it.
  virtual std::shared_ptr<LeafPair[]> pair_memory(std::size_t n) {
    return std::shared_ptr<LeafPair[]>(new LeafPair[n]);
  }

  // Begins a frame and the transfer of its positions. The arrays must not change until the frame has ended.
  virtual void begin_frame(Positions t0, Positions t1) = 0;
  // The leaves to which index pairs refer, before the first pair is sent.
  virtual void begin_traversal(const LeafTable& leaves) = 0;
  // The maximum number of concurrent submissions.
  virtual std::size_t slots() const = 0;
  // Its cores, each of which can process one segment.
  virtual std::size_t cores() const = 0;
  // Only while fewer than slots() submissions are running. The pairs must not change until they are collected.
  virtual Ticket submit(const std::vector<Piece>& pieces) = 0;
  // Whether the state variable is "data ready".
  virtual bool ready(Ticket ticket) = 0;
  // Appends to the output; the ticket becomes invalid.
  virtual void collect(Ticket ticket, Output& output) = 0;
  // Drops all running work, also after a failure. Does not throw.
  virtual void cancel() = 0;

  virtual void count(std::map<std::string, std::uint64_t>& stats) const = 0;
};

}  // namespace hpccd::hybrid
