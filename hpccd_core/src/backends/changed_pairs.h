// SPDX-License-Identifier: Apache-2.0
// Candidates of a search, of which those are tested again whose vertices have changed.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "scene/features.h"
#include "traverse/worker.h"

namespace hpccd {

// Lists of numbers, one list for each number of another kind.
class Adjacency {
 public:
  // for_each(take): calls take(list, number) for all of them, in the same order each time.
  template <class ForEach>
  void assign(std::size_t n_lists, ForEach&& for_each) {
    // During the second pass first_[i + 1] is the end of list i so far.
    first_.assign(n_lists + 2, 0);
    for_each([&](std::uint32_t list, std::uint32_t) { ++first_[list + 2]; });
    for (std::size_t i = 2; i < first_.size(); ++i) first_[i] += first_[i - 1];
    numbers_.resize(first_.back());
    for_each([&](std::uint32_t list, std::uint32_t number) { numbers_[first_[list + 1]++] = number; });
  }
  std::span<const std::uint32_t> operator[](std::uint32_t list) const {
    return {numbers_.data() + first_[list], numbers_.data() + first_[list + 1]};
  }

 private:
  std::vector<std::uint32_t> first_, numbers_;
};

class ChangedPairs {
 public:
  explicit ChangedPairs(const Features& features);

  // For the candidates of a new search: one empty list for each of n workers. Then call join().
  std::vector<std::vector<PairGroup>>& empty_lists(std::size_t n);
  void join(ThreadPool& pool);

  // Calls test(group, first, second, thread) for batches of the candidates that have one of these vertices.
  template <class Test>
  void for_each(std::span<const std::uint32_t> vertices, ThreadPool& pool, Test&& test) {
    mark(vertices);
    const bool few = vertices.size() < features_.n_vertices / scan_above;
    if (few && !listed_by_feature_) list_by_feature(pool);
    for (Candidates& c : candidates_) {
      if (few) list_changed(c);
      const bool listed = few && c.numbered();
      parallel_for(pool, listed ? c.changed.size() : c.pairs.first.size(), 4 * batch_capacity,
                   [&](std::size_t begin, std::size_t end, int thread) {
                     for_range(c, listed, begin, end,
                               [&](auto first, auto second) { test(c.pairs, first, second, thread); });
                   });
    }
  }

 private:
  // Up to this part of the vertices, 1/64, lists by feature save more time than they cost.
  static constexpr std::size_t scan_above = 64;
  // As bits, those of a scene of 100,000 triangles fit into a core's cache.
  struct Marks {
    std::size_t size = 0;
    std::vector<std::uint64_t> bits;
    std::vector<std::uint32_t> list;
    void resize(std::size_t n) { size = n, bits.resize(n / 64 + 1); }
    bool is(std::uint32_t i) const { return bits[i / 64] >> i % 64 & 1; }
    void set(std::uint32_t i);
    void clear();
  };
  struct Candidates {
    PairGroup pairs;
    Adjacency of_first, of_second;  // numbers of the candidates with each first and each second feature
    std::vector<std::uint32_t> changed;
    bool numbered() const { return pairs.first.size() <= std::numeric_limits<std::uint32_t>::max(); }
  };
  const Marks& marks_of_first(Kind kind) const { return kind == Kind::vertex_face ? vertices_ : edges_; }
  const Marks& marks_of_second(Kind kind) const { return kind == Kind::vertex_face ? faces_ : edges_; }
  template <class Test>
  void for_range(const Candidates& c, bool listed, std::size_t begin, std::size_t end, Test&& test) const {
    const Marks &of_first = marks_of_first(c.pairs.kind), &of_second = marks_of_second(c.pairs.kind);
    std::uint32_t first[batch_capacity], second[batch_capacity], count = 0;
    const auto flush = [&] {
      if (count > 0) test(std::span(first, count), std::span(second, count));
      count = 0;
    };
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t pair = listed ? c.changed[i] : i;
      first[count] = c.pairs.first[pair], second[count] = c.pairs.second[pair];
      count += listed ? 1 : static_cast<std::uint32_t>(of_first.is(first[count]) | of_second.is(second[count]));
      if (count == batch_capacity) flush();
    }
    flush();
  }
  void mark(std::span<const std::uint32_t> vertices);
  void list_by_feature(ThreadPool& pool);
  void list_changed(Candidates& candidates) const;

  const Features& features_;
  Adjacency edges_of_, faces_of_;  // of each vertex
  std::vector<std::vector<PairGroup>> of_workers_;
  std::vector<Candidates> candidates_;
  bool listed_by_feature_ = false;
  Marks vertices_, edges_, faces_;
};

}  // namespace hpccd
