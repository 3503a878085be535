// SPDX-License-Identifier: Apache-2.0
// Candidates of a search, of which those are tested again whose vertices have changed.
#pragma once

#include <cstdint>
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

  // For the candidates of a new search: one empty list for each of n workers.
  std::vector<std::vector<PairGroup>>& empty_lists(std::size_t n);

  // Calls test(group, first, second, thread) for batches of the candidates that have one of these vertices.
  template <class Test>
  void for_each(std::span<const std::uint32_t> vertices, ThreadPool& pool, Test&& test) {
    mark(vertices);
    const bool few = vertices.size() < features_.n_vertices / scan_above && list_changed(pool);
    std::size_t g = 0;
    for (const std::vector<PairGroup>& of_worker : candidates_)
      for (const PairGroup& group : of_worker) {
        const Marks &of_first = marks_of_first(group.kind), &of_second = marks_of_second(group.kind);
        const std::uint32_t* listed = few ? changed_[g].data() : nullptr;
        const std::size_t n = few ? changed_[g].size() : group.first.size();
        ++g;
        parallel_for(pool, n, 4 * batch_capacity, [&](std::size_t begin, std::size_t end, int thread) {
          std::uint32_t first[batch_capacity], second[batch_capacity], count = 0;
          const auto flush = [&] {
            test(group, std::span(first, count), std::span(second, count), thread);
            count = 0;
          };
          for (std::size_t i = begin; i < end; ++i) {
            const std::size_t pair = listed ? listed[i] : i;
            first[count] = group.first[pair], second[count] = group.second[pair];
            count += listed || of_first.is[first[count]] || of_second.is[second[count]];
            if (count == batch_capacity) flush();
          }
          flush();
        });
      }
  }

 private:
  // With fewer changed vertices than one in so many, lists by feature save more time than they take.
  static constexpr std::size_t scan_above = 64;
  struct Marks {
    std::vector<char> is;
    std::vector<std::uint32_t> list;
    void set(std::uint32_t i);
    void clear();
  };
  // Of the candidates of one kind, numbered through all groups.
  struct OfFeatures {
    Adjacency first, second;
  };
  const Marks& marks_of_first(Kind kind) const { return kind == Kind::vertex_face ? vertices_ : edges_; }
  const Marks& marks_of_second(Kind kind) const { return kind == Kind::vertex_face ? faces_ : edges_; }
  void mark(std::span<const std::uint32_t> vertices);
  void list_by_feature(ThreadPool& pool);
  bool list_changed(ThreadPool& pool);
  template <class F>
  void for_each_group(Kind kind, F&& f) const;

  const Features& features_;
  Adjacency edges_of_, faces_of_;  // of each vertex
  std::vector<std::vector<PairGroup>> candidates_;
  bool listed_by_feature_ = false;
  OfFeatures of_features_[2];  // by kind
  Marks vertices_, edges_, faces_;
  std::vector<std::vector<std::uint32_t>> changed_;  // by group
};

}  // namespace hpccd
