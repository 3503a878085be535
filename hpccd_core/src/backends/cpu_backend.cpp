// SPDX-License-Identifier: Apache-2.0
#include "backends/cpu_backend.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contacts/gaps.h"
#include "contacts/intersections.h"
#include "paper/primitive_pairs.h"
#include "scene/edge_sample.h"
#include "solid/penetration.h"
#include "solid/points.h"
#include "solid/translation.h"
#include "traverse/leaf_hulls.h"

namespace hpccd {
namespace {

// Per leaf. A search of the whole tree has about eight; more than two, with their boxes and the list, cost as much.
constexpr std::size_t most_open = 2;

// During its lifetime a search stores the pairs of leaves that it finds, up to a maximum, instead of testing them.
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

// Joins the earliest contacts of two searches without duplicates: listed pairs may be in leaves that were left open.
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

CpuBackend::CpuBackend(Resources& shared)
    : shared_(shared),
      method_(paper::engine_of(shared.options, {shared.features, shared.rules, shared.pool})),
      workers_(static_cast<std::size_t>(shared.pool.size())) {
  one_thread_.heed(shared.cancellation);
}

std::optional<Detection> CpuBackend::detect(Positions t0, Positions t1) {
  if (shared_.options.report == Report::first && !method_) {
    find_earliest(t0, t1, false);
    return Detection{collect(), Backend::cpu};
  }
  update(t0, t1, Tests::all_here);
  traverse();
  return Detection{collect(), Backend::cpu};
}

void CpuBackend::update(Positions t0, Positions t1, Tests tests) {
  Profiler& profiler = shared_.profiler;
  begin_motion(t0, t1, tests);
  if (method_) {
    swept_ = &shared_.tree.swept();
    method_->update(*swept_, profiler);
  } else {
    shared_.tree.fit(profiler);
  }
}

void CpuBackend::begin_motion(Positions t0, Positions t1, Tests tests) { begin_motion(t0, t1, tests, shared_.tree); }

void CpuBackend::begin_motion(Positions t0, Positions t1, Tests tests, MovingTree& tree) {
  const Options& o = shared_.options;
  tree.bound(t0, t1, shared_.common.growth());
  shared_.profiler.mark("bounds");
  const MotionBounds& motion = tree.motion();
  const bool rounds = floats_suffice(motion.short_edge, motion.map.scale), here = tests == Tests::all_here;
  search_.emplace(tree.tree(), shared_.rules, o.simd, here && rounds);
  begin(*search_, motion);
  search_->geometry.separations = shared_.separations_now();
  search_->geometry.margin = {shared_.most_separation() + motion.rounding, motion.map.scale};
  if (shared_.common.thickness.uneven()) {
    search_->geometry.margin_of_none = {motion.rounding, motion.map.scale};
    search_->geometry.margin_of_one = {1, 1};
    search_->geometry.kdop_scale = motion.map.scale;
  }
  search_->geometry.rounded = rounds ? motion.rounded.data() : nullptr;
  search_->excess = Excess(motion, shared_.separations);
  search_->report = !here && o.report == Report::any ? Report::all : o.report;
  counts_ = {};
  counts_.asked[0] = counts_.asked[1] = true;
  counts_.earliest = search_->report == Report::first, counts_.timed = walks_tree();
}

void CpuBackend::begin(Search& search) const { begin(search, shared_.tree.motion()); }

void CpuBackend::begin(SnapshotSearch& search, const Snapshot& snapshot) const {
  begin(search, snapshot.motion);
  search.placed = snapshot.placed;
}

void CpuBackend::begin(Search& search, const MotionBounds& motion) const {
  search.geometry = {motion.vertices.data(), shared_.features.edges.data(), shared_.features.faces.data(),
                     motion.kdops.data()};
  search.cancellation = &shared_.cancellation;
  search.filter = &shared_.common.filter.view();
  if (const Features& f = shared_.features; !f.edge_kinds.empty())
    search.edge_kinds = f.edge_kinds.data(), search.edge_kinds_of_mesh = f.edge_kinds_of_mesh.data();
}

void CpuBackend::traverse() {
  if (!method_) return walk_tree(*search_);
  method_->traverse(*swept_, *search_, workers_);
  mark_traversal();
}

void CpuBackend::walk_tree(Search& search) {
  search.traverse(shared_.pool, workers_);
  mark_traversal();
}

void CpuBackend::mark_traversal() {
  double elementary = 0;
  for (const Worker& w : workers_) elementary += 1e3 * w.elementary_seconds;
  // Tests run inside the traversal; their share of the wall-clock time is their share of the threads' time.
  shared_.profiler.mark_split("traverse", "elementary", elementary / shared_.pool.size());
}

void CpuBackend::test(const std::vector<LeafPair>& pairs) {
  if (!method_) return test_leaves_of_tree(pairs);
  test_each(pairs, [&](LeafPair pair, Worker& worker) {
    paper::test_primitives(shared_.features, shared_.rules, *swept_, pair, worker);
  });
}

void CpuBackend::test_leaves_of_tree(const std::vector<LeafPair>& pairs) {
  test_each(pairs, [&](LeafPair pair, Worker& worker) { search_->test_leaves(pair, worker); });
}

template <class Test>
void CpuBackend::test_each(const std::vector<LeafPair>& pairs, Test&& test) {
  constexpr std::size_t grain = 64;  // small compared with a segment: all threads share the remainder of one
  parallel_for(shared_.pool, pairs.size(), grain, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i) test(pairs[i], workers_[static_cast<std::size_t>(thread)]);
  });
  for (Worker& w : workers_) w.flush();
}

Contacts CpuBackend::collect() { return collect(*search_, Outputs::of_contacts(shared_.options)); }

Contacts CpuBackend::collect(const Search& search, Outputs outputs) {
  // Distributing the work (five jobs) takes as long as this amount of work.
  constexpr std::size_t few = 1024;
  std::size_t n = 0;
  for (const Worker& w : workers_) n += w.vertex_face.size() + w.edge_edge.size();
  contacts_ = {};
  collect_contacts(workers_, search.geometry, search.report, outputs, order_, n < few ? one_thread_ : shared_.pool,
                   contacts_);
  shared_.profiler.mark("contacts");
  shared_.cancellation.heed();  // the caller of a cancelled call must not receive its result
  return std::move(contacts_);
}

WorkCounts CpuBackend::last_counts() const {
  WorkCounts counts = counts_;
  counts.add(workers_);
  counts.near_pairs = near_.size();
  return counts;
}

void CpuBackend::count(std::map<std::string, std::uint64_t>& stats) const {
  std::uint64_t bytes = order_.bytes() + near_.bytes() + drift_.bytes();
  if (method_) bytes += method_->bytes();
  if (mesh_pairs_) bytes += mesh_pairs_->bytes();
  if (containment_) bytes += containment_->bytes() + contained_.bytes();
  if (placed_) bytes += placed_->bytes() + last_nearest_.capacity() * sizeof(NearestPair);
  for (const Worker& w : workers_) bytes += sizeof(Worker) + w.bytes();
  stats["bytes"] += bytes;
  if (counts_of_worlds_) return counts_of_worlds_->write(stats);
  last_counts().write(stats);
  if (method_) method_->count(stats);
}

void CpuBackend::begin_worlds() { counts_of_worlds_.emplace(); }

void CpuBackend::begin_world(WorldMemory& memory, TreeBudget& trees) {
  // Any of several contacts may be returned, but it must be the one that a detector of this world alone returns.
  shared_.tree.begin_world(memory.tree, trees, shared_.options.report == Report::any);
  std::swap(near_, memory.near);
  std::swap(contained_, memory.containment);
}

void CpuBackend::end_world(WorldMemory& memory) {
  *counts_of_worlds_ += last_counts();
  std::swap(near_, memory.near);
  std::swap(contained_, memory.containment);
  shared_.tree.end_world();
}

// Queries of one snapshot.

std::optional<Contacts> CpuBackend::proximity(Positions vertices, double distance) {
  fit_snapshot(vertices, distance + shared_.common.thickness.most_of_two() * (1 + 1e-15));
  return proximity(fitted(), distance);
}

std::optional<Intersections> CpuBackend::intersections(Positions vertices) {
  fit_snapshot(vertices);
  return intersections(fitted());
}

std::optional<std::vector<Gap>> CpuBackend::distances(Positions vertices) {
  fit_snapshot(vertices);
  shared_.tree.find_least_edges();
  return distances(fitted());
}

bool CpuBackend::place(std::span<const rigid::Pose> poses) {
  if (!placed_) placed_ = std::make_unique<PlacedMeshes>(*shared_.scene, shared_.features, shared_.pool);
  const bool placed = placed_->place(poses);
  shared_.profiler.mark("bounds");
  counts_ = {};
  return placed;
}

Contacts CpuBackend::proximity_at_poses(double distance) { return proximity(at_poses(), distance); }
Intersections CpuBackend::intersections_at_poses() { return intersections(at_poses()); }
std::vector<Gap> CpuBackend::distances_at_poses() { return distances(at_poses()); }

Contacts CpuBackend::proximity(const Snapshot& snapshot, double distance) {
  ProximitySearch search(snapshot.tree, shared_.rules, shared_.options.simd);
  begin(search, snapshot);
  const double with_thickness = distance + shared_.common.thickness.most_of_two() * (1 + 1e-15);
  search.reach = reach_of(with_thickness, snapshot.motion.box_rounding, snapshot.motion.box_scale);
  search.geometry.separations.uniform = distance;
  search.geometry.separations.thickness = shared_.common.thickness.view();
  counts_.asked[0] = counts_.asked[1] = true;
  walk_tree(search);
  return collect(search, Outputs::of_proximity(shared_.options));
}

Intersections CpuBackend::intersections(const Snapshot& snapshot) {
  IntersectionSearch search(snapshot.tree, shared_.rules, shared_.options.simd);
  begin(search, snapshot);
  counts_.asked[2] = true;
  walk_tree(search);
  Intersections found = collect_intersections(workers_, search.geometry, order_, shared_.pool);
  shared_.profiler.mark("contacts");
  shared_.cancellation.heed();
  return found;
}

std::vector<Gap> CpuBackend::distances(const Snapshot& snapshot) {
  if (!mesh_pairs_) mesh_pairs_.emplace(shared_.rules, shared_.scene->meshes().size());
  if (!containment_)
    containment_.emplace(*shared_.scene, shared_.features, shared_.rules, *mesh_pairs_, shared_.cancellation);
  NearestPairs nearest(*mesh_pairs_, shared_.rules, &shared_.common.filter.view(), shared_.features, snapshot.motion,
                       snapshot.tree, shared_.common.thickness, snapshot.placed);
  DistanceSearch search(snapshot.tree, shared_.rules, shared_.options.simd, nearest);
  begin(search, snapshot);
  search.geometry.separations.thickness = shared_.common.thickness.view();
  counts_.asked[0] = counts_.asked[1] = counts_.asked[2] = true;
  if (snapshot.placed) test_last_nearest(search, *snapshot.placed);
  walk_tree(search);
  std::vector<Gap> gaps = collect_gaps(nearest, search.geometry, shared_.cancellation);
  shared_.profiler.mark("contacts");
  containment_->decide(gaps, snapshot.tree, snapshot.motion, snapshot.placed, contained_, shared_.pool);
  last_nearest_.resize(snapshot.placed ? gaps.size() : 0);
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const NearestPair& pair = nearest.found(i);
    if (snapshot.placed) last_nearest_[i] = pair;
    if (gaps[i].kind != GapKind::none)
      gaps[i].distance -= search.geometry.separations.thickness_of(pair.kind, pair.first, pair.second);
  }
  shared_.profiler.mark("containment");
  shared_.cancellation.heed();
  return gaps;
}

// The nearest pairs of the last poses give the first limits. The result is the same: they are pairs as any others.
void CpuBackend::test_last_nearest(DistanceSearch& search, PlacedMeshes& placed) {
  Worker& worker = workers_.front();
  worker.begin(search);
  for (std::size_t i = 0; i < last_nearest_.size(); ++i) {
    const NearestPair& pair = last_nearest_[i];
    if (!(pair.distance < std::numeric_limits<double>::infinity())) continue;
    std::array<std::uint32_t, 5> v{};
    if (pair.kind == Kind::edge_face) {
      const auto& edge = shared_.features.edges[pair.first];
      const auto& face = shared_.features.faces[pair.second];
      v = {edge[0], edge[1], face[0], face[1], face[2]};
    } else {
      pair_vertices(search.geometry, pair.kind, pair.first, pair.second, v.data());
    }
    placed.fit_vertices(std::span(v).first(pair.kind == Kind::edge_face ? 5 : 4));
    const auto [mesh_a, mesh_b] = (*mesh_pairs_)[i];
    const Rule rule = pair.kind == Kind::edge_face ? Rule{} : shared_.rules.rule(mesh_a, mesh_b);
    worker.test_pairs({&pair.first, 1}, {&pair.second, 1}, pair.kind, rule);
  }
}

std::optional<WindingNumbers> CpuBackend::winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) {
  fit_snapshot(vertices);
  WindingNumbers found = hpccd::winding_numbers({shared_.tree.tree(), shared_.tree.motion(), shared_.features, mesh},
                                                points, shared_.pool);
  shared_.profiler.mark("traverse");
  shared_.cancellation.heed();
  return found;
}

std::optional<SignedDistances> CpuBackend::signed_distances(Positions vertices, Positions points, std::uint32_t mesh) {
  fit_snapshot(vertices);
  SignedDistances found = hpccd::signed_distances({shared_.tree.tree(), shared_.tree.motion(), shared_.features, mesh},
                                                  points, shared_.pool);
  shared_.profiler.mark("traverse");
  shared_.cancellation.heed();
  return found;
}

MovedPair CpuBackend::moved_pair(Positions vertices, std::array<std::uint32_t, 2> meshes) {
  shared_.tree.bound(vertices);
  shared_.profiler.mark("bounds");
  counts_ = {};
  topologies_.resize(shared_.scene->meshes().size());
  for (const std::uint32_t mesh : meshes)
    if (!topologies_[mesh]) topologies_[mesh] = topology_of(*shared_.scene, mesh, shared_.cancellation);
  return {shared_.tree.motion(),   shared_.features,        meshes,
          *topologies_[meshes[0]], *topologies_[meshes[1]], shared_.pool};
}

std::optional<double> CpuBackend::separating_translation(Positions vertices, std::array<std::uint32_t, 2> meshes,
                                                         const Vec3<double>& direction) {
  const double s = hpccd::separating_translation(moved_pair(vertices, meshes), direction);
  shared_.profiler.mark("translation");
  return s;
}

std::optional<Penetration> CpuBackend::penetration(Positions vertices, std::array<std::uint32_t, 2> meshes,
                                                   const std::optional<Vec3<double>>& start) {
  Penetration found = hpccd::penetration(moved_pair(vertices, meshes), start, shared_.pool);
  shared_.profiler.mark("translation");
  return found;
}

// Pairs of features within a distance.
void CpuBackend::begin_proximity(Positions vertices, double distance, ProximitySearch& search) {
  fit_snapshot(vertices, distance);
  begin(search);
  search.geometry.separations.uniform = distance;
  search.reach = reach_of(distance, shared_.tree.motion().box_rounding, shared_.tree.motion().box_scale);
}

void CpuBackend::fit_snapshot(Positions vertices, double distance) {
  shared_.tree.bound(vertices, distance);
  shared_.profiler.mark("bounds");
  shared_.tree.fit(shared_.profiler);
  counts_ = {};
}

// The earliest contacts. Near pairs give a best time immediately, and often the result; otherwise the tree is searched
// for pairs that may touch before.

std::optional<std::vector<double>> CpuBackend::earliest(Positions t0, Positions t1) {
  find_earliest(t0, t1, true);
  shared_.cancellation.heed();
  return std::vector<double>{search_->earliest};
}

// The features of a motion that is shortened stay within bounds of their whole way. So one search by such bounds has
// all candidates of each shorter motion, and a round only tests those again whose vertices have changed. A search of
// the rounded numbers from the start is the proof.

std::optional<CollisionFreeMotion> CpuBackend::free_motion(Positions t0, Positions t1,
                                                           std::span<const std::int64_t> groups) {
  Shortening motion(t0, t1, groups, shared_.cancellation);
  while (shorten_to_rest(t0, motion)) {
    begin_motion(t0, motion.end(), Tests::all_here);
    search_->report = Report::all, counts_.earliest = false;
    shared_.tree.fit(shared_.profiler);
    walk_tree(*search_);
    if (motion.shorten(touching(t0, motion.end())).empty()) break;
  }
  shared_.cancellation.heed();
  return std::move(motion).result();
}

// Until no candidate touches. False if none did.
bool CpuBackend::shorten_to_rest(Positions t0, Shortening& motion) {
  search_whole_ways(t0, motion.end());
  std::span<const std::uint32_t> vertices = motion.shorten(touching(t0, motion.end()));
  const bool shortened = !vertices.empty();
  if (shortened) whole_->pairs.join(shared_.pool);
  for (; !vertices.empty(); vertices = motion.shorten(touching(t0, motion.end()))) {
    whole_->tree.shorten(t0, motion.end(), vertices);
    shared_.profiler.mark("bounds");
    for (Worker& w : workers_) w.begin(*search_);
    whole_->pairs.for_each(vertices, shared_.pool, [&](const PairGroup& group, auto first, auto second, int thread) {
      workers_[static_cast<std::size_t>(thread)].test_pairs(first, second, group.kind, group.rule);
    });
    mark_traversal();
  }
  return shortened;
}

// Leaves all contacts in the workers, and keeps the candidates.
void CpuBackend::search_whole_ways(Positions t0, Positions t1) {
  if (!whole_) whole_ = std::make_unique<WholeWays>(*shared_.scene, shared_.features, shared_.pool);
  begin_motion(t0, t1, Tests::all_here, whole_->tree);
  search_->report = Report::all, counts_.earliest = false;
  whole_->tree.fit(shared_.profiler);
  struct Release {
    std::vector<Worker>& workers;
    ~Release() {
      for (Worker& w : workers) w.kept = nullptr;
    }
  } release{workers_};
  std::vector<std::vector<PairGroup>>& lists = whole_->pairs.empty_lists(workers_.size());
  for (std::size_t i = 0; i < workers_.size(); ++i) workers_[i].kept = &lists[i];
  walk_tree(*search_);
}

std::span<const Shortening::Touching> CpuBackend::touching(Positions t0, Positions t1) {
  std::size_t n = 0;
  for (const Worker& w : workers_) n += w.vertex_face.size() + w.edge_edge.size();
  resize(touching_, n, shared_.cancellation);
  auto pair = touching_.begin();
  for (const Worker& w : workers_)
    for (const auto& [list, kind] :
         {std::pair(&w.vertex_face, Kind::vertex_face), std::pair(&w.edge_edge, Kind::edge_edge)})
      in_pieces(shared_.cancellation, list->size(), 1 << 14,
                [&, list = list, kind = kind](std::size_t begin, std::size_t end) {
                  for (std::size_t i = begin; i < end; ++i, ++pair) {
                    const Contact& c = (*list)[i];
                    pair_vertices(search_->geometry, kind, c.first, c.second, pair->vertices);
                    pair->toc = c.toc;
                  }
                });
  if (shared_.common.planes.any()) {
    shared_.common.planes.add_touching(touching_, t0, t1, shared_.pool);
    shared_.profiler.mark("planes");
  }
  return touching_;
}

// Leaves the contacts in the workers.
void CpuBackend::find_earliest(Positions t0, Positions t1, bool time_only) {
  begin_earliest(t0, t1, time_only);
  if (search_->prunes) {
    if (answer_from_near_pairs() || answer_from_unlisted_pairs(time_only)) return;
    if (near_.radius().known() && near_.radius().failed(travel_))
      near_.begin_at(shared_.tree.motion().vertices, shared_.pool);
    if (!near_.radius().known() && list_near_pairs(t0)) {
      begin_earliest(t0, t1, time_only);
      if (answer_from_near_pairs() || answer_from_unlisted_pairs(time_only)) return;
    }
    limit_boxes();
  }
  shared_.tree.fit(shared_.profiler);
  walk_tree(*search_);
  if (search_->prunes) remember_earliest();
}

void CpuBackend::limit_boxes() {
  const double scale = shared_.tree.motion().box_scale;
  search_->two_ways = static_cast<float>(2 * travel_.way * scale);
  search_->most_reach = static_cast<float>(near_.radius().edge / 4 * scale);
}

void CpuBackend::begin_earliest(Positions t0, Positions t1, bool time_only) {
  begin_motion(t0, t1, Tests::all_here);
  search_->report = Report::first, counts_.earliest = true;
  search_->time_only = time_only;
  search_->prunes = shared_.rules.promise_times();
}

// Tests the near pairs; returns whether they were sufficient. The best time so far is known in any case.
bool CpuBackend::answer_from_near_pairs() {
  if (const std::uint64_t now = shared_.common.version_of_separations(); near_.radius().separations != now)
    near_ = {}, near_.radius().separations = now, drift_of_.reset();
  test_groups(near_.hints);
  if (!search_->over()) test_groups(near_.groups());
  mark_traversal();
  if (search_->over()) return true;
  travel_ = near_.see(shared_.tree.motion().vertices, shared_.pool);
  return near_.radius().answers(search_->earliest, travel_);
}

// Leaves the contacts in the workers, and changes nothing else.
void CpuBackend::test_groups(const std::vector<NearList::Group>& groups) {
  for (Worker& w : workers_) w.begin(*search_);
  for (const NearList::Group& group : groups) {
    constexpr std::size_t grain = 256;  // 10 us, the time to wake a thread
    parallel_for(shared_.pool, group.first.size(), grain, [&](std::size_t begin, std::size_t end, int thread) {
      const std::span first(group.first), second(group.second);
      workers_[static_cast<std::size_t>(thread)].test_pairs(first.subspan(begin, end - begin),
                                                            second.subspan(begin, end - begin), group.kind, group.rule);
    });
  }
}

// Lists all pairs that the motion can bring together up to the best time so far, if they are few and needed again.
// True: it has searched, successfully or not, and the motion must be bounded again.
bool CpuBackend::list_near_pairs(Positions t0) {
  NearRadius& list = near_.radius();
  list.edge = typical_length(shared_.features, shared_.tree.motion().vertices);
  if (!list.next_would_pay(travel_)) return false;
  std::optional<double> radius = list.next(travel_, search_->earliest);
  const bool wide = !radius && list.edge > 0 && list.wider_would_pay();
  if (wide) radius = wide_radius();
  const std::optional<double> distance = listed_distance(radius, shared_.most_separation());
  if (!distance) return false;
  ProximitySearch search(shared_.tree.tree(), shared_.rules, shared_.options.simd);
  begin_proximity(t0, *distance, search);
  search.most_found = wide ? most_listed_wide(shared_.features) : most_listed(shared_.features);
  walk_tree(search);
  if (search.gave_up()) {
    wide ? list.gave_up_wider() : list.gave_up();
    return true;
  }
  Grouping near(shared_.features, shared_.rules);
  for (const Worker& w : workers_) {
    for (const Contact& c : w.vertex_face) near.add({c.first, c.second, Kind::vertex_face});
    for (const Contact& c : w.edge_edge) near.add({c.first, c.second, Kind::edge_edge});
  }
  near_.keep(std::move(near.groups), *radius, shared_.tree.motion().vertices, shared_.pool);
  shared_.profiler.mark("near_pairs");
  return true;
}

// Keeps some of the earliest contacts as hints: they give the next motion its first bound.
void CpuBackend::remember_earliest() {
  constexpr std::size_t enough = 64;
  Grouping near(shared_.features, shared_.rules);
  std::size_t n = 0;
  for (const Worker& w : workers_)
    for (const auto& [list, kind] :
         {std::pair(&w.vertex_face, Kind::vertex_face), std::pair(&w.edge_edge, Kind::edge_edge)})
      for (const Contact& c : *list)
        if (c.toc <= search_->earliest && n++ < enough) near.add({c.first, c.second, kind});
  near_.hints = std::move(near.groups);
}

// Pairs that a list of near pairs leaves open if the motion goes farther than its radius: pairs of leaves that move
// apart by more. On connected meshes these are few, and only their boxes are compared.

// After the pairs of the list: the open ones. False if they are too many, if there is no list, or no tree to search: a
// world keeps its list when it moves to another thread's tree.
bool CpuBackend::answer_from_unlisted_pairs(bool time_only) {
  if (!shared_.tree.built()) return false;
  if (!near_.radius().known() || near_.snapshot().size() != shared_.tree.motion().vertices.size()) return false;
  update_drift();
  drift_.listed_within(near_.radius().listed(), shared_.most_separation());
  FoundContacts found = take_found(workers_);
  const std::optional<std::vector<LeafPair>> open = open_pairs();
  shared_.profiler.mark("near_pairs");
  if (!open) return false;
  near_.radius().helped();
  if (!open->empty()) {
    shared_.tree.fit_leaves(leaves_of(*open, shared_.tree.tree().leaves.size()));
    shared_.profiler.mark("refit");
    limit_boxes();
    test_leaves_of_tree(*open);
  }
  if (!time_only) join_found(std::move(found), search_->earliest, workers_);
  mark_traversal();
  return true;
}

// The radius of a list that leaves few pairs of this motion open.
std::optional<double> CpuBackend::wide_radius() {
  near_.begin_at(shared_.tree.motion().vertices, shared_.pool);
  update_drift();
  constexpr double longest = 0.6;  // of an edge; with 0.7 all neighbours of a regular mesh are near
  const std::size_t n_leaves = shared_.tree.tree().leaves.size();
  for (const double part : {0.25, 0.4, longest}) {
    drift_.listed_within(part * near_.radius().edge, shared_.most_separation());
    const std::optional<std::vector<LeafPair>> open = open_pairs();
    if (open && open->size() <= (part < longest ? n_leaves / 2 : n_leaves)) return part * near_.radius().edge / 2;
  }
  near_.radius().gave_up_wider();
  return std::nullopt;
}

void CpuBackend::update_drift() {
  const Tree& tree = shared_.tree.tree();
  if (const std::pair now(near_.number(), shared_.tree.number()); drift_of_ != now) {
    drift_of_.reset();  // in case this is cancelled
    drift_.begin(tree, near_.snapshot(), shared_.pool);
    drift_of_ = now;
  }
  drift_.fit(tree, shared_.tree.motion().vertices, near_.snapshot(), shared_.pool);
}

// Pairs of leaves that may touch and are not all listed; nothing if there are too many.
std::optional<std::vector<LeafPair>> CpuBackend::open_pairs() {
  const OpenPairs open(*search_, workers_, most_open * shared_.tree.tree().leaves.size());
  search_->traverse_unlisted(drift_, shared_.pool, workers_);
  if (search_->gave_up()) return std::nullopt;
  return open.all();
}

}  // namespace hpccd
