// SPDX-License-Identifier: Apache-2.0
#include "backends/near_list.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "scene/edge_sample.h"

namespace hpccd {
namespace {

constexpr std::size_t grain = 4096;

Vec3<double> at(const double x[3]) { return {x[0], x[1], x[2]}; }

// Not the length, whose square could underflow or overflow.
double largest(const Vec3<double>& x) { return std::max({std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)}); }

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

Travel Travel::along_axes(double away, double way) {
  const auto length = [](double along_axis) {
    constexpr double root_of_three = 1.7320508075688774;
    return along_axis == 0 ? 0 : root_of_three * along_axis + least;
  };
  return {length(away), length(way)};
}

std::optional<double> NearRadius::next(const Travel& travel, double time) const {
  constexpr double longest_way = 1.0 / 8;  // of an edge
  const double way = travel.way * std::min(time + same_time, 1.0);
  if (!(way <= longest_way * edge)) return std::nullopt;
  return std::max(2 * way, least_radius * edge);
}

std::optional<double> listed_distance(std::optional<double> radius, double largest_separation) {
  const double distance = radius ? (largest_separation + 2 * *radius) * (1 + 1e-9) : 0;
  return radius && std::isfinite(distance) ? std::optional(distance) : std::nullopt;
}

namespace {

std::size_t n_features(const Features& features) {
  return features.n_vertices + features.edges.size() + features.faces.size();
}

}  // namespace

std::size_t most_listed(const Features& features) {
  constexpr std::size_t of_each = 8, few = 1 << 16;
  return few + of_each * n_features(features);
}

std::size_t most_listed_wide(const Features& features) {
  constexpr std::size_t of_each = 2, few = 1 << 10;
  return few + of_each * n_features(features);
}

void NearList::keep(std::vector<Group> groups, double radius, const std::vector<VertexMotion>& starts,
                    ThreadPool& pool) {
  begin_at(starts, pool);
  groups_ = std::move(groups);
  radius_.set(radius);
}

void NearList::forget() {
  groups_.clear();
  radius_.forget();
}

void NearList::begin_at(const std::vector<VertexMotion>& starts, ThreadPool& pool) {
  forget();
  number_ = next_number();
  resize(snapshot_, starts.size(), pool.cancellation());
  parallel_for(pool, starts.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) snapshot_[i] = at(starts[i].t0);
  });
}

Travel NearList::see(const std::vector<VertexMotion>& vertices, ThreadPool& pool) {
  std::vector<Travel> most(static_cast<std::size_t>(pool.size()));
  const bool compares = snapshot_.size() == vertices.size(), begins = !radius_.known();
  if (begins) {
    number_ = next_number();
    resize(snapshot_, vertices.size(), pool.cancellation());
  }
  parallel_for(pool, vertices.size(), grain, [&](std::size_t begin, std::size_t end, int thread) {
    Travel t = most[static_cast<std::size_t>(thread)];
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3<double> start = at(vertices[i].t0);
      t.way = std::max(t.way, largest(at(vertices[i].t1) - start));
      if (compares) t.away = std::max(t.away, largest(start - snapshot_[i]));
      if (begins) snapshot_[i] = start;
    }
    most[static_cast<std::size_t>(thread)] = t;
  });
  Travel t;
  for (const Travel& s : most) t.away = std::max(t.away, s.away), t.way = std::max(t.way, s.way);
  return Travel::along_axes(compares ? t.away : std::numeric_limits<double>::infinity(), t.way);
}

std::size_t NearList::size() const {
  std::size_t n = 0;
  for (const Group& g : groups_) n += g.first.size();
  return n;
}

std::size_t NearList::bytes() const {
  std::size_t n = snapshot_.capacity() * sizeof(snapshot_[0]);
  for (const auto* groups : {&groups_, &hints})
    for (const Group& g : *groups) n += sizeof g + 4 * (g.first.capacity() + g.second.capacity());
  return n;
}

void Grouping::add(const Candidate& pair) {
  const bool edges = pair.kind == Kind::edge_edge;
  const std::uint32_t a = edges ? features_.edges[pair.first][0] : pair.first;
  const std::uint32_t b = edges ? features_.edges[pair.second][0] : features_.faces[pair.second][0];
  const Rule rule = rules_.rule(features_.mesh_of_vertex[a], features_.mesh_of_vertex[b]);
  auto group = std::find_if(groups.begin(), groups.end(), [&](const NearList::Group& g) {
    return g.kind == pair.kind && g.rule.number() == rule.number();
  });
  if (group == groups.end()) group = groups.insert(groups.end(), {pair.kind, rule, {}, {}});
  group->first.push_back(pair.first);
  group->second.push_back(pair.second);
}

double typical_length(const Features& features, const std::vector<VertexMotion>& vertices) {
  const auto [stride, count] = EdgeSample::of(features.edges.size(), 1024);
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [from, to] = features.edges[i * stride];
    sum += largest(at(vertices[from].t0) - at(vertices[to].t0));
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace hpccd
