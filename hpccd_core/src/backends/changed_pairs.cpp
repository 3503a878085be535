// SPDX-License-Identifier: Apache-2.0
#include "backends/changed_pairs.h"

#include <algorithm>
#include <utility>

namespace hpccd {
namespace {

template <class Feature>
void list_by_vertex(Adjacency& lists, std::size_t n_vertices, const std::vector<Feature>& features) {
  lists.assign(n_vertices, [&](auto&& take) {
    for (std::uint32_t i = 0; i < features.size(); ++i)
      for (const std::uint32_t v : features[i]) take(v, i);
  });
}

}  // namespace

ChangedPairs::ChangedPairs(const Features& features) : features_(features) {
  list_by_vertex(edges_of_, features.n_vertices, features.edges);
  list_by_vertex(faces_of_, features.n_vertices, features.faces);
  vertices_.resize(features.n_vertices), edges_.resize(features.edges.size()), faces_.resize(features.faces.size());
}

std::vector<std::vector<PairGroup>>& ChangedPairs::empty_lists(std::size_t n) {
  listed_by_feature_ = false;
  of_workers_.resize(n);
  for (auto& groups : of_workers_)
    for (PairGroup& group : groups) group.first.clear(), group.second.clear();
  return of_workers_;
}

void ChangedPairs::join(ThreadPool& pool) {
  struct Part {
    PairGroup* from;
    std::size_t to, at;
  };
  std::vector<Part> parts;
  std::vector<std::size_t> sizes(candidates_.size());
  for (auto& groups : of_workers_)
    for (PairGroup& group : groups) {
      if (group.first.empty()) continue;  // of an earlier search; two threads would swap it with one empty target
      std::size_t to = 0;
      while (to < candidates_.size() && !candidates_[to].pairs.tested_like(group)) ++to;
      if (to == candidates_.size())
        candidates_.push_back({{group.kind, group.rule, {}, {}}, {}, {}, {}}), sizes.push_back(0);
      parts.push_back({&group, to, sizes[to]});
      sizes[to] += group.first.size();
    }
  for (std::size_t i = 0; i < sizes.size(); ++i)
    for (const auto features : {&PairGroup::first, &PairGroup::second})
      resize(candidates_[i].pairs.*features, sizes[i], pool.cancellation());
  parallel_for_each(pool, parts.size(), [&](std::size_t i) {
    const auto& [from, to, at] = parts[i];
    for (const auto features : {&PairGroup::first, &PairGroup::second}) {
      std::vector<std::uint32_t>&source = from->*features, &target = candidates_[to].pairs.*features;
      if (source.size() == target.size())
        source.swap(target);  // the only one
      else
        in_pieces(pool.cancellation(), source.size(), 1 << 18, [&](std::size_t begin, std::size_t end) {
          std::copy(source.data() + begin, source.data() + end, target.data() + at + begin);
        });
    }
  });
}

void ChangedPairs::Marks::set(std::uint32_t i) {
  if (!is(i)) list.push_back(i);
  bits[i / 64] |= std::uint64_t{1} << i % 64;
}

void ChangedPairs::Marks::clear() {
  for (const std::uint32_t i : list) bits[i / 64] = 0;
  list.clear();
}

void ChangedPairs::mark(std::span<const std::uint32_t> vertices) {
  vertices_.clear(), edges_.clear(), faces_.clear();
  for (const std::uint32_t v : vertices) {
    vertices_.set(v);
    for (const std::uint32_t e : edges_of_[v]) edges_.set(e);
    for (const std::uint32_t f : faces_of_[v]) faces_.set(f);
  }
}

void ChangedPairs::list_by_feature(ThreadPool& pool) {
  const auto list = [&](Adjacency& lists, std::size_t n, const std::vector<std::uint32_t>& features) {
    lists.assign(n, [&](auto&& take) {
      in_pieces(pool.cancellation(), features.size(), 1 << 18, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) take(features[i], static_cast<std::uint32_t>(i));
      });
    });
  };
  parallel_for_each(pool, 2 * candidates_.size(), [&](std::size_t i) {
    Candidates& c = candidates_[i / 2];
    if (!c.numbered()) return;
    if (i % 2 == 0)
      list(c.of_first, marks_of_first(c.pairs.kind).size, c.pairs.first);
    else
      list(c.of_second, marks_of_second(c.pairs.kind).size, c.pairs.second);
  });
  listed_by_feature_ = true;
}

void ChangedPairs::list_changed(Candidates& c) const {
  c.changed.clear();
  if (!c.numbered()) return;
  const Marks& of_first = marks_of_first(c.pairs.kind);
  for (const std::uint32_t feature : of_first.list) {
    const std::span<const std::uint32_t> all = c.of_first[feature];
    c.changed.insert(c.changed.end(), all.begin(), all.end());
  }
  for (const std::uint32_t feature : marks_of_second(c.pairs.kind).list)
    for (const std::uint32_t pair : c.of_second[feature])
      if (!of_first.is(c.pairs.first[pair])) c.changed.push_back(pair);
}

}  // namespace hpccd
