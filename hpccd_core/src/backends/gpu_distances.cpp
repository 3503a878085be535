// SPDX-License-Identifier: Apache-2.0
// Distances by the device: it finds the nearest features of all pairs of meshes in one search. The CPU decides the
// pairs that only integers can decide, and which meshes lie inside others.
#include <algorithm>

#include "backends/gpu_backend.h"
#include "backends/world_positions.h"
#include "contacts/gaps.h"
#include "elementary/exact/intersection.h"

namespace hpccd {
namespace {

constexpr std::size_t most_searched_pairs = std::size_t{1} << 22;  // a result on the device takes 170 bytes
// A vertex takes a warp; more of them are those of soups, of which CPUs remember what is outside.
constexpr std::size_t most_asked_vertices = std::size_t{1} << 16;

}  // namespace

void GpuBackend::prepare_distances() {
  const ThicknessTable& thickness = shared_.common.thickness;
  if (mesh_pairs_ && version_of_pairs_ == thickness.version()) return;
  if (!mesh_pairs_) {
    mesh_pairs_.emplace(shared_.rules, shared_.scene->meshes().size());
    containment_.emplace(*shared_.scene, shared_.features, shared_.rules, *mesh_pairs_, shared_.cancellation);
    contained_.resize(n_worlds());
  }
  version_of_pairs_ = thickness.version();
  const std::vector<double>& largest = thickness.largest_of_meshes();
  pairs_to_search_.clear();
  for (std::size_t i = 0; i < mesh_pairs_->size(); ++i) {
    const auto [a, b] = (*mesh_pairs_)[i];
    const double thickest = largest.empty() ? 0 : largest[a] + largest[b];
    const bool even = thickness.even(a) && thickness.even(b);
    pairs_to_search_.push_back({a, b, shared_.rules.rule(a, b).filtered, thickest, even ? 0 : thickest});
  }
}

bool GpuBackend::can_search() const {
  const std::size_t n_all = pairs_to_search_.size() * n_worlds();
  return shared_.features.n_primitives() > 0 && n_all > 0 && n_all <= most_searched_pairs;
}

bool GpuBackend::find_gaps(Positions vertices, std::vector<Gap>& gaps) {
  prepare_distances();
  if (!can_search()) return false;
  prepare_snapshot(gpu::Query::nearest, vertices, 0);
  const gpu::NearestPairsFound found =
      pipeline_->find_nearest(vertices, pairs_to_search_, version_of_pairs_, shared_.pool);
  if (!found.good) throw_bad_snapshot(vertices);
  shared_.profiler.mark("gpu");
  if (found.gave_up) return false;
  const std::vector<NearestPair> nearest = collect_gaps(found, gaps);
  decide_containment(gaps, found.of_meshes, vertices);
  subtract_thickness(gaps, nearest);
  return true;
}

// The CPU decides containment, as the device's boxes at poses are not the least ones: it computes one vertex of each
// component, and boxes only where a ray passes.
bool GpuBackend::find_gaps(const PlacedMeshes& placed, std::vector<Gap>& gaps) {
  prepare_distances();
  if (!can_search()) return false;
  if (!placed_search_) {
    placed_search_ = gpu::PlacedSearch::create(*shared_.scene, shared_.features, shared_.options, shared_.separations,
                                               shared_.common.thickness, shared_.common.filter, placed,
                                               gpu::status().devices.at(0).number);
    shared_.profiler.mark("gpu_start");
  }
  at_poses_ = true;
  const gpu::NearestPairsFound found = placed_search_->find_nearest(pairs_to_search_, version_of_pairs_);
  shared_.profiler.mark("gpu");
  if (found.gave_up) return false;
  const std::vector<NearestPair> nearest = collect_gaps(found, gaps);
  containment_->decide(gaps, placed.tree(), placed.snapshot(), &placed, contained_[0], shared_.pool);
  subtract_thickness(gaps, nearest);
  return true;
}

// Decides what only integers can decide. Returns the nearest pairs.
std::vector<NearestPair> GpuBackend::collect_gaps(const gpu::NearestPairsFound& found, std::vector<Gap>& gaps) {
  const std::size_t n_pairs = mesh_pairs_->size();
  std::vector<NearestPair> nearest(found.of_meshes.size());
  std::vector<const gpu::PairOfFeatures*> features(nearest.size());
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const gpu::NearestOfMeshes& n = found.of_meshes[i];
    features[i] = &n.pair;
    if (n.found) nearest[i] = {n.distance, n.pair.kind, n.pair.first, n.pair.second, n.without_thickness};
  }
  std::vector<NearestPair> decided(found.undecided.size());
  constexpr std::size_t pairs_a_piece = 8;  // about 10 us, the time to wake a thread
  parallel_for(shared_.pool, decided.size(), pairs_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i)
      decided[i] = decide_nearest(found.undecided[i], found.of_meshes[found.undecided[i].of].limit);
  });
  for (std::size_t i = 0; i < decided.size(); ++i)
    if (const std::size_t of = found.undecided[i].of; decided[i].before(nearest[of]))
      nearest[of] = decided[i], features[of] = &found.undecided[i].pair;
  nearest_decided_ = decided.size();
  shared_.profiler.mark("exact");

  Geometry geometry{};
  geometry.edges = shared_.features.edges.data(), geometry.faces = shared_.features.faces.data();
  geometry.separations.thickness = shared_.common.thickness.view();
  gaps.resize(nearest.size());
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    shared_.cancellation.heed();
    gaps[i] = gap_of((*mesh_pairs_)[i % n_pairs], nearest[i], features[i]->at, geometry);
  }
  shared_.profiler.mark("contacts");
  return nearest;
}

void GpuBackend::subtract_thickness(std::vector<Gap>& gaps, const std::vector<NearestPair>& nearest) const {
  Separations separations;
  separations.thickness = shared_.common.thickness.view();
  for (std::size_t i = 0; i < gaps.size(); ++i)
    if (const NearestPair& pair = nearest[i]; gaps[i].kind != GapKind::none)
      gaps[i].distance -= separations.thickness_of(pair.kind, pair.first, pair.second);
  shared_.profiler.mark("containment");
}

// As Worker::resolve and DistanceSearch::take.
NearestPair GpuBackend::decide_nearest(const gpu::UndecidedNearest& u, double limit) const {
  const auto& [first, second, kind, at] = u.pair;
  if (kind == Kind::edge_face) return exact::intersect(at) ? NearestPair{0, kind, first, second, 0} : NearestPair{};
  Separations separations;
  separations.thickness = shared_.common.thickness.view();
  const double thickness = separations.thickness_of(kind, first, second);
  const double lack = pairs_to_search_[u.of % pairs_to_search_.size()].thickest - thickness;
  UndecidedPair pair{kind, {}, {}, limit - lack};
  if (pair.separation < 0) return {};
  std::copy_n(at, 4, pair.t0), std::copy_n(at, 4, pair.t1);
  FallbackCounts counts;
  const std::optional<double> distance = decide_proximity(Accuracy::exact, pair, counts);
  return distance ? NearestPair{*distance + lack, kind, first, second, *distance} : NearestPair{};
}

// Where boxes of meshes allow it, the device computes winding numbers. The CPU decides the worlds in which these need
// integers or are very many, and those in which surfaces may intersect unnoticed, as their exact boxes then decide.
void GpuBackend::decide_containment(std::vector<Gap>& gaps, const std::vector<gpu::NearestOfMeshes>& nearest,
                                    Positions vertices) {
  struct Question {
    Gap* gap;
    Inside answer;
    std::uint32_t world;
    std::size_t begin, end;  // of its vertices
  };
  std::vector<Question> questions;
  std::vector<gpu::VertexInMesh> asked;
  std::vector<char> left_open(n_worlds(), false);
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    Gap& gap = gaps[i];
    const gpu::NearestOfMeshes& n = nearest[i];
    if (gap.mesh_a == gap.mesh_b || !(gap.distance > 0)) continue;
    const auto ask = [&](Inside answer, std::uint32_t inner, std::uint32_t outer, bool within_box) {
      if (!containment_->possible(inner, outer, n.boxes_meet, within_box)) return;
      const auto world = static_cast<std::uint32_t>(i / mesh_pairs_->size());
      const std::size_t begin = asked.size();
      for (const std::uint32_t v : containment_->components(inner)) asked.push_back({world, v, outer});
      questions.push_back({&gap, answer, world, begin, asked.size()});
      if (shared_.rules.rule(inner, outer).filtered) left_open[world] = true;
    };
    ask(Inside::a, gap.mesh_a, gap.mesh_b, n.a_within_b), ask(Inside::b, gap.mesh_b, gap.mesh_a, n.b_within_a);
  }
  if (questions.empty()) return;
  std::vector<std::int32_t> numbers(asked.size(), gpu::undecided_winding);
  if (asked.size() <= most_asked_vertices) numbers = pipeline_->windings_of(asked);
  for (const Question& q : questions)
    for (std::size_t i = q.begin; i < q.end; ++i)
      if (numbers[i] == gpu::undecided_winding) left_open[q.world] = true;
  for (const Question& q : questions) {
    const std::span of_question = std::span(numbers).subspan(q.begin, q.end - q.begin);
    if (left_open[q.world] || !std::ranges::any_of(of_question, [](std::int32_t number) { return number != 0; }))
      continue;
    q.gap->inside = q.gap->inside == Inside::none ? q.answer : Inside::both;
  }
  for (std::size_t k = 0; k < n_worlds(); ++k) {
    if (!left_open[k]) continue;
    shared_.tree.bound(on_host(of_world(vertices, k), 0));
    shared_.tree.fit(shared_.profiler);
    containment_->decide(std::span(gaps).subspan(k * mesh_pairs_->size(), mesh_pairs_->size()), shared_.tree.tree(),
                         shared_.tree.motion(), nullptr, contained_[k], shared_.pool);
  }
}

}  // namespace hpccd
