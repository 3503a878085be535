// SPDX-License-Identifier: Apache-2.0
#include "backends/changed_pairs.h"

#include <algorithm>
#include <limits>
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
  vertices_.is.resize(features.n_vertices), edges_.is.resize(features.edges.size());
  faces_.is.resize(features.faces.size());
}

std::vector<std::vector<PairGroup>>& ChangedPairs::empty_lists(std::size_t n) {
  listed_by_feature_ = false;
  candidates_.resize(n);
  for (auto& of_worker : candidates_)
    for (PairGroup& group : of_worker) group.first.clear(), group.second.clear();
  return candidates_;
}

void ChangedPairs::Marks::set(std::uint32_t i) {
  if (!std::exchange(is[i], 1)) list.push_back(i);
}

void ChangedPairs::Marks::clear() {
  for (const std::uint32_t i : list) is[i] = 0;
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

// f(group, its number, the number of its first candidate): for the groups of this kind.
template <class F>
void ChangedPairs::for_each_group(Kind kind, F&& f) const {
  std::size_t number = 0, begin = 0;
  for (const auto& of_worker : candidates_)
    for (const PairGroup& group : of_worker) {
      if (group.kind == kind) f(group, number, begin), begin += group.first.size();
      ++number;
    }
}

void ChangedPairs::list_by_feature(ThreadPool& pool) {
  const auto list = [&](Adjacency& lists, Kind kind, std::size_t n, std::vector<std::uint32_t> PairGroup::* features) {
    lists.assign(n, [&](auto&& take) {
      for_each_group(kind, [&](const PairGroup& group, std::size_t, std::size_t begin) {
        for (const std::uint32_t feature : group.*features) take(feature, static_cast<std::uint32_t>(begin++));
      });
    });
  };
  parallel_for_each(pool, 4, [&](std::size_t i) {
    const Kind kind = i < 2 ? Kind::edge_edge : Kind::vertex_face;
    OfFeatures& of = of_features_[i / 2];
    if (i % 2 == 0)
      list(of.first, kind, marks_of_first(kind).is.size(), &PairGroup::first);
    else
      list(of.second, kind, marks_of_second(kind).is.size(), &PairGroup::second);
  });
  listed_by_feature_ = true;
}

// False if there are more candidates than numbers.
bool ChangedPairs::list_changed(ThreadPool& pool) {
  std::size_t n_groups = 0, n = 0;
  for (const auto& of_worker : candidates_)
    for (const PairGroup& group : of_worker) ++n_groups, n += group.first.size();
  if (n > std::numeric_limits<std::uint32_t>::max()) return false;
  if (!listed_by_feature_) list_by_feature(pool);
  changed_.resize(n_groups);
  for (auto& of_group : changed_) of_group.clear();
  for (const Kind kind : {Kind::edge_edge, Kind::vertex_face}) {
    const Marks &of_first = marks_of_first(kind), &of_second = marks_of_second(kind);
    const OfFeatures& of = of_features_[kind == Kind::edge_edge ? 0 : 1];
    for_each_group(kind, [&](const PairGroup& group, std::size_t number, std::size_t begin) {
      const auto of_group = [&](const Adjacency& lists, std::uint32_t feature) {
        const std::span<const std::uint32_t> all = lists[feature];
        return std::span(std::ranges::lower_bound(all, begin),
                         std::ranges::lower_bound(all, begin + group.first.size()));
      };
      for (const std::uint32_t feature : of_first.list)
        for (const std::uint32_t i : of_group(of.first, feature))
          changed_[number].push_back(static_cast<std::uint32_t>(i - begin));
      for (const std::uint32_t feature : of_second.list)
        for (const std::uint32_t i : of_group(of.second, feature))
          if (!of_first.is[group.first[i - begin]]) changed_[number].push_back(static_cast<std::uint32_t>(i - begin));
    });
  }
  return true;
}

}  // namespace hpccd
