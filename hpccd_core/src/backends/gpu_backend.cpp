// SPDX-License-Identifier: Apache-2.0
#include "backends/gpu_backend.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "backends/world_positions.h"
#include "contacts/places.h"
#include "elementary/apart_until.h"
#include "elementary/exact/intersection.h"
#include "gpu/download.h"
#include "gpu/results_to_device.h"
#include "scene/static_meshes.h"
#include "solid/points.h"

namespace hpccd {
namespace {

// The same number for boxes grown by nearly the same distance, for which trees degrade alike: within an eighth of a
// factor of two, areas differ by at most a fifth. With a new distance in each frame, degraded trees are detected too.
int growth_of(double distance) {
  return distance > 0 ? static_cast<int>(std::floor(8 * std::log2(distance))) : std::numeric_limits<int>::min();
}

bool stays_apart(const UndecidedPair& pair, double until) {
  return pair.kind == Kind::edge_edge ? apart_until<Kind::edge_edge>(pair.t0, pair.t1, until, pair.separation)
                                      : apart_until<Kind::vertex_face>(pair.t0, pair.t1, until, pair.separation);
}

}  // namespace

std::string GpuBackend::unsupported(const Options& options) {
  if (options.method != Method::standard)
    return "method: the published methods run on CPUs; use backend=\"cpu\", or method=\"default\"";
  return "";
}

// Runs a computation of the device, or returns nothing after a failure.
template <class Compute>
auto GpuBackend::attempt(Compute&& compute) -> std::optional<decltype(compute())> {
  places_on_cpu_ = 0;
  try {
    std::optional found(compute());
    failures_.succeeded();
    shared_.cancellation.heed();
    return found;
  } catch (const gpu::Error& e) {
    failures_.failed(e.what());
    has_tree_ = false;  // nothing on the device is valid after a failure
    near_.forget();
    placed_search_.reset();
    shared_.profiler.mark("gpu_failed");
    return std::nullopt;
  }
}

std::optional<Detection> GpuBackend::detect(Positions t0, Positions t1) {
  require_rest(t0, t1);
  return attempt([&] { return Detection{contacts(t0, t1), Backend::gpu}; });
}

std::optional<std::vector<double>> GpuBackend::earliest(Positions t0, Positions t1) {
  require_rest(t0, t1);
  if (n_worlds() > 1) return attempt([&] { return earliest_times(t0, t1); });
  return attempt([&] { return std::vector{earliest_time(t0, t1)}; });
}

std::optional<Contacts> GpuBackend::proximity(Positions vertices, double distance) {
  return attempt([&] { return near_pairs(vertices, distance); });
}

std::optional<Intersections> GpuBackend::intersections(Positions vertices) {
  return attempt([&] { return pierced_faces(vertices); });
}

std::optional<std::vector<Gap>> GpuBackend::distances(Positions vertices) {
  std::vector<Gap> gaps;
  const std::optional<bool> complete = attempt([&] { return find_gaps(vertices, gaps); });
  if (!complete.value_or(false)) return std::nullopt;
  return gaps;
}

std::optional<std::vector<Gap>> GpuBackend::distances_at_poses(const PlacedMeshes& placed) {
  std::vector<Gap> gaps;
  const std::optional<bool> complete = attempt([&] { return find_gaps(placed, gaps); });
  if (!complete.value_or(false)) return std::nullopt;
  return gaps;
}

std::optional<Detected> GpuBackend::detect_in_place(Positions t0, Positions t1) {
  require_rest(t0, t1);
  return attempt([&] {
    run_contacts(t0, t1);
    const gpu::FrameResult found = finish_on_device();
    Detected d{on_device(found), {}};
    d.in_place->device = -1;
    if (found.memory) return d;
    return Detected{std::nullopt, join(found, {}, shared_.features, shared_.pool)};
  });
}

std::optional<DeviceResults> GpuBackend::detect_on_device(Positions t0, Positions t1) {
  require_rest(t0, t1);
  return attempt([&] {
    run_contacts(t0, t1);
    return with_places(finish_on_device(), Outputs::of_contacts(shared_.options), shared_.separations_now(), t0, t1);
  });
}

std::optional<DeviceResults> GpuBackend::proximity_on_device(Positions vertices, double distance) {
  return attempt([&] {
    run_near_pairs(vertices, distance);
    return with_places(finish_on_device(), Outputs::of_proximity(shared_.options), within(distance), vertices,
                       vertices);
  });
}

std::optional<DeviceResults> GpuBackend::intersections_on_device(Positions vertices) {
  return attempt([&] {
    run_pierced_faces(vertices);
    return on_device(finish_on_device());
  });
}

// Positions on a device are not checked.
void GpuBackend::require_rest(Positions t0, Positions t1) const {
  if (t0.on_device || t1.on_device) return;
  each_world([&](std::size_t k) { require_static_meshes_rest(*shared_.scene, of_world(t0, k), of_world(t1, k)); });
}

// Calls f(), whose errors name the world if there are several.
template <class Function>
void GpuBackend::in_world(std::size_t world, Function&& f) const {
  try {
    f();
  } catch (const InvalidArgument& error) {
    if (n_worlds() == 1) throw;
    throw InvalidArgument(with_world(error.what(), world));
  }
}

// The same for f(world).
template <class Function>
void GpuBackend::each_world(Function&& f) const {
  for (std::size_t k = 0; k < n_worlds(); ++k) in_world(k, [&] { f(k); });
}

void GpuBackend::prepare_motion(Positions t0, Positions t1, bool until_best) {
  const gpu::Query query = shared_.common.any_separation() ? gpu::Query::separations : gpu::Query::contacts;
  prepare({query, growth_of(shared_.most_separation()), until_best},
          [&] { shared_.tree.bound(on_host(of_world(t0, 0), 0), on_host(of_world(t1, 0), 1), {}); });
}

// Throws if the device has found invalid coordinates, and names them.
void GpuBackend::require_good(bool good, Positions t0, Positions t1) {
  if (!good) {
    t0 = on_host(t0, 0), t1 = on_host(t1, 1);
    each_world([&](std::size_t k) { MotionBounds().update(of_world(t0, k), of_world(t1, k), shared_.pool); });
    throw gpu::Error("the device found bad coordinates where the host finds none");
  }
  shared_.profiler.mark("gpu");
}

// If contacts after a time do not matter, decides up to that time, and up to the first contact at the start.
void GpuBackend::decide_motion(Positions t0, Positions t1, std::optional<double> until) {
  if (!pipeline_->undecided().empty()) t0 = on_host(t0, 0), t1 = on_host(t1, 1);
  const Separations separations = shared_.separations_now();
  std::atomic<bool> over{false};
  decide([&](const Candidate& u) -> std::optional<double> {
    if (over.load(std::memory_order_relaxed)) return std::nullopt;
    const UndecidedPair pair = undecided(separations, u, t0, t1);
    if (until && stays_apart(pair, *until)) return std::nullopt;
    FallbackCounts counts;
    const auto time = pair.separation > 0 ? decide_separation(Accuracy::exact, pair, counts)
                                          : decide_contact(Accuracy::exact, pair, counts);
    if (until && time && *time <= 0) over = true;
    return time;
  });
}

// All contacts are on the device, or decided by the CPU.
void GpuBackend::run_contacts(Positions t0, Positions t1) {
  const bool prunes = shared_.options.report == Report::first && shared_.rules.promise_times() && n_worlds() == 1;
  prepare_motion(t0, t1, prunes);
  const gpu::Pipeline::Best best = prunes ? gpu::Pipeline::Best(std::numeric_limits<double>::infinity()) : std::nullopt;
  require_good(pipeline_->run(t0, t1, best, shared_.pool), t0, t1);
  decide_motion(t0, t1, std::nullopt);
}

Contacts GpuBackend::contacts(Positions t0, Positions t1) {
  run_contacts(t0, t1);
  Contacts found = finish_on_host(shared_.options.report);
  if (last_boxes_.until_best) pipeline_->choose_hints(found.first_toc);
  add_places(found, Outputs::of_contacts(shared_.options), shared_.separations_now(), t0, t1);
  shared_.profiler.mark("contacts");
  return found;
}

// Limits of a proximity query.
Separations GpuBackend::within(double distance) const {
  Separations separations{distance};
  separations.thickness = shared_.common.thickness.view();
  return separations;
}

void GpuBackend::run_near_pairs(Positions vertices, double distance) {
  run_snapshot(gpu::Query::proximity, vertices, distance);
  if (!pipeline_->undecided().empty()) vertices = on_host(vertices, 0);
  const Separations separations = within(distance);
  decide([&](const Candidate& u) {
    const UndecidedPair pair = undecided(separations, u, vertices, vertices);
    FallbackCounts counts;
    std::optional<double> found = decide_proximity(accuracy_of(u), pair, counts);
    const Candidate own = in_its_world(u);
    if (found && separations.thick())
      found = std::min(*found - separations.thickness_of(own.kind, own.first, own.second), distance);
    return found;
  });
}

Contacts GpuBackend::near_pairs(Positions vertices, double distance) {
  run_near_pairs(vertices, distance);
  Contacts found = finish_on_host(Report::all);
  add_places(found, Outputs::of_proximity(shared_.options), within(distance), vertices, vertices);
  shared_.profiler.mark("contacts");
  return found;
}

void GpuBackend::run_pierced_faces(Positions vertices) {
  run_snapshot(gpu::Query::intersections, vertices, 0);
  if (!pipeline_->undecided().empty()) vertices = on_host(vertices, 0);
  decide([&](const Candidate& u) {
    Vec3<double> q[5];
    edge_face_positions(shared_.features, in_its_world(u), of_world(vertices, world_of(u)), q);
    return exact::intersect(q) ? std::optional(0.0) : std::nullopt;
  });
}

Intersections GpuBackend::pierced_faces(Positions vertices) {
  run_pierced_faces(vertices);
  Intersections found = n_worlds() > 1 ? intersections_of(finish_on_device(), n_worlds())
                                       : join_intersections(finish(), decided_, shared_.features);
  shared_.profiler.mark("contacts");
  return found;
}

// For many worlds, the device merges the CPU's decisions.
Contacts GpuBackend::finish_on_host(Report report) {
  if (n_worlds() > 1) return contacts_of(finish_on_device(), n_worlds(), shared_.pool);
  Contacts found = join(finish(), decided_, shared_.features, shared_.pool);
  reduce(found, report);
  return found;
}

gpu::FrameResult GpuBackend::finish_on_device() {
  if (!decided_.vertex_face.empty() || !decided_.edge_edge.empty())
    pipeline_->add(decided_.vertex_face, decided_.edge_edge);
  return finish();
}

DeviceResults GpuBackend::on_device(const gpu::FrameResult& f) {
  DeviceResults r;
  r.memory = f.memory, r.device = gpu::status().devices.at(0).number;
  r.n_vf = f.n_vf, r.n_ee = f.n_ee, r.n_ef = f.n_ef;
  r.vf = f.vf, r.ee = f.ee, r.ef = f.ef, r.values = f.toc;
  r.vf_offsets = f.vf_offsets, r.ee_offsets = f.ee_offsets, r.ef_offsets = f.ef_offsets;
  r.hashes = f.hashes, r.first_tocs = f.first_tocs;
  r.hash = f.hash, r.first_toc = f.first_toc;
  r.points = reinterpret_cast<decltype(r.points)>(f.points),
  r.normals = reinterpret_cast<decltype(r.normals)>(f.normals);
  r.closest = reinterpret_cast<decltype(r.closest)>(f.closest);
  r.vertices = f.vertices, r.weights = reinterpret_cast<decltype(r.weights)>(f.weights), r.approach = f.approach;
  if (last_boxes_.until_best) pipeline_->choose_hints(r.first_toc);
  shared_.profiler.mark("contacts");
  return r;
}

std::size_t GpuBackend::world_of(const Candidate& pair) const {
  const Features& f = shared_.features;
  return pair.first / (pair.kind == Kind::edge_edge || last_boxes_.query == gpu::Query::intersections
                           ? f.edges.size()
                           : std::size_t{f.n_vertices});
}

Candidate GpuBackend::in_its_world(Candidate pair) const {
  const Features& f = shared_.features;
  const bool edge = pair.kind == Kind::edge_edge || last_boxes_.query == gpu::Query::intersections;
  pair.first %= edge ? static_cast<std::uint32_t>(f.edges.size()) : f.n_vertices;
  return pair;
}

UndecidedPair GpuBackend::undecided(const Separations& separations, const Candidate& pair, Positions t0,
                                    Positions t1) const {
  const std::size_t world = world_of(pair);
  return undecided_pair(shared_.features, separations, in_its_world(pair), of_world(t0, world), of_world(t1, world));
}

void GpuBackend::prepare_snapshot(gpu::Query query, Positions vertices, double distance) {
  prepare({query, growth_of(distance), false}, [&] { shared_.tree.bound(on_host(of_world(vertices, 0), 0)); });
}

void GpuBackend::run_snapshot(gpu::Query query, Positions vertices, double distance) {
  prepare_snapshot(query, vertices, distance);
  if (!pipeline_->run_snapshot(query, vertices, distance, shared_.pool)) throw_bad_snapshot(vertices);
  shared_.profiler.mark("gpu");
}

void GpuBackend::throw_bad_snapshot(Positions vertices) {
  vertices = on_host(vertices, 0);
  each_world([&](std::size_t k) { MotionBounds().update(*shared_.scene, of_world(vertices, k), shared_.pool); });
  throw gpu::Error("the device found bad coordinates where the host finds none");
}

// Provides a pipeline and a tree: a new one for the first call, and when refitting on the device has degraded it too
// much.
template <class Bound>
void GpuBackend::prepare(Boxes boxes, Bound&& bound) {
  if (!pipeline_) {
    pipeline_ =
        gpu::Pipeline::create(*shared_.scene, shared_.features, shared_.options, shared_.separations,
                              shared_.common.thickness, shared_.common.filter, gpu::status().devices.at(0).number);
    shared_.profiler.mark("gpu_start");
  }
  at_poses_ = false;
  const bool worn = has_tree_ && worn_out_on_device();
  last_boxes_ = boxes;
  if (has_tree_ && !worn) return;
  has_tree_ = false;  // in case this fails
  in_world(0, bound);
  shared_.tree.build_anew();
  near_.edge = typical_length(shared_.features, shared_.tree.motion().vertices);
  pipeline_->set_tree(shared_.tree.tree());
  area_when_built_.clear();  // known once the device has refitted the tree
  looseness_when_built_ = shared_.tree.tree().wear_when_built.looseness;
  has_tree_ = true;
  shared_.profiler.mark("build");
}

// Compares the area with that of the first frame whose boxes were of the same kind, and the looseness, for which their
// kind matters little, with that of the build.
bool GpuBackend::worn_out_on_device() {
  const Wear wear = pipeline_->wear();
  if (!(wear.area > 0)) return false;
  const double area_when_built = area_when_built_.try_emplace(last_boxes_, wear.area).first->second;
  return worn_out(wear, {area_when_built, looseness_when_built_});
}

// Pairs that neither the device nor its error bounds could decide: decide(pair) returns its time or distance, or
// nothing.
template <class Decide>
void GpuBackend::decide(Decide&& decide) {
  const std::vector<Candidate>& undecided = pipeline_->undecided();
  std::vector<std::optional<double>> values(undecided.size());
  constexpr std::size_t pairs_a_piece = 8;  // about 10 us, the time to wake a thread
  parallel_for(shared_.pool, undecided.size(), pairs_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) values[i] = decide(undecided[i]);
  });
  decided_ = decided_contacts(undecided, values);
  shared_.profiler.mark("exact");
}

gpu::FrameResult GpuBackend::finish() {
  const gpu::FrameResult found = pipeline_->finish();
  shared_.profiler.mark("gpu_sort");
  return found;
}

Accuracy GpuBackend::accuracy_of(const Candidate& of) const {
  const Features& f = shared_.features;
  const Candidate pair = in_its_world(of);
  const bool edges = pair.kind == Kind::edge_edge;
  const std::uint32_t first = edges ? f.edges[pair.first][0] : pair.first;
  const std::uint32_t second = edges ? f.edges[pair.second][0] : f.faces[pair.second][0];
  return shared_.rules.rule(f.mesh_of_vertex[first], f.mesh_of_vertex[second]).accuracy;
}

Positions GpuBackend::on_host(Positions p, int which) {
  if (!p.on_device) return p;
  std::vector<unsigned char>& to = downloaded_[which];
  to.resize(3 * p.n * (p.is_double ? sizeof(double) : sizeof(float)));
  gpu::download(p.data, to.data(), to.size());
  return {to.data(), p.n, p.is_double};
}

void GpuBackend::count(std::map<std::string, std::uint64_t>& stats) const {
  if (at_poses_ && placed_search_) {
    stats.merge(placed_search_->stats());
    stats["gpu_exact_on_cpu"] = nearest_decided_;
    return;
  }
  if (!pipeline_) return;
  stats.merge(pipeline_->stats());
  stats["gpu_exact_on_cpu"] =
      last_boxes_.query == gpu::Query::nearest ? nearest_decided_ : pipeline_->undecided().size();
  stats["gpu_places_on_cpu"] = places_on_cpu_;
  if (last_boxes_.query == gpu::Query::intersections) stats["ef_by_integers"] = pipeline_->undecided().size();
}

void GpuBackend::add_stages(std::map<std::string, double>& stages) const {
  const bool by_poses = at_poses_ && placed_search_;
  if (!by_poses && !pipeline_) return;
  for (const auto& [name, ms] : by_poses ? placed_search_->stages() : pipeline_->stages()) stages["gpu/" + name] = ms;
}

// The earliest contact, as in CpuBackend: from near pairs, which stay on the device. If these do not suffice, from all
// pairs, in a frame without results, whose boxes reach up to the best time so far.

using Pairs = gpu::Pipeline::Pairs;

double GpuBackend::earliest_time(Positions t0, Positions t1) {
  const bool prunes = shared_.rules.promise_times();
  prepare_motion(t0, t1, prunes);
  if (!prunes) return run_for_earliest(t0, t1, Pairs::all, std::nullopt);
  if (const std::uint64_t now = shared_.common.version_of_separations(); near_.separations != now)
    near_.forget(), near_.separations = now;
  constexpr double none = std::numeric_limits<double>::infinity();
  double time = none;
  if (near_.known()) {
    time = run_for_earliest(t0, t1, Pairs::near_list, none);
    if (time <= 0 || near_.answers(time, travel_of_frame())) return time;
    near_.forget();
  }
  time = std::min(time, run_for_earliest(t0, t1, Pairs::all, time));
  pipeline_->choose_hints(time);
  const Travel travel = travel_of_frame();
  if (time <= 0 || !list_near_pairs(t0, time, travel)) pipeline_->forget_near();
  return time;
}

// The search of a single world is pruned; the times are the same.
std::vector<double> GpuBackend::earliest_times(Positions t0, Positions t1) {
  prepare_motion(t0, t1, false);
  require_good(pipeline_->run_for_earliest(t0, t1, Pairs::all, std::nullopt, shared_.pool), t0, t1);
  std::vector<double> times = pipeline_->earliest_of_worlds();
  decide_motion(t0, t1, std::nullopt);
  for (const auto* list : {&decided_.vertex_face, &decided_.edge_edge})
    for (const Contact& c : *list) {
      const Kind kind = list == &decided_.edge_edge ? Kind::edge_edge : Kind::vertex_face;
      double& time = times[world_of({c.first, c.second, kind})];
      time = std::min(time, c.toc);
    }
  return times;
}

double GpuBackend::run_for_earliest(Positions t0, Positions t1, Pairs pairs, gpu::Pipeline::Best best) {
  require_good(pipeline_->run_for_earliest(t0, t1, pairs, best, shared_.pool), t0, t1);
  double time = pipeline_->earliest().time;
  if (time <= 0) return time;
  decide_motion(t0, t1, best ? std::min({time + same_time, *best + same_time, 1.0}) : 1.0);
  for (const auto* list : {&decided_.vertex_face, &decided_.edge_edge})
    for (const Contact& c : *list) time = std::min(time, c.toc);
  return time;
}

// Lists near pairs for later motions, if these may begin like this one.
bool GpuBackend::list_near_pairs(Positions t0, double time, const Travel& travel) {
  if (!near_.next_would_pay(travel)) return false;
  const std::optional<double> radius = near_.next(travel, time);
  const std::optional<double> distance = listed_distance(radius, shared_.most_separation());
  if (!distance) return false;
  prepare_snapshot(gpu::Query::proximity, t0, *distance);
  require_good(pipeline_->list_near(t0, *distance, most_listed(shared_.features), shared_.pool), t0, t0);
  if (pipeline_->gave_up_listing())
    near_.gave_up();
  else
    near_.set(*radius, true);
  return !pipeline_->gave_up_listing();
}

Travel GpuBackend::travel_of_frame() const {
  const gpu::EarliestTime frame = pipeline_->earliest();
  return Travel::along_axes(frame.away, frame.way);
}

// Points and a closed mesh: the CPU decides those that the device leaves undecided, as it does for all of its own.

std::optional<WindingNumbers> GpuBackend::winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) {
  if (n_worlds() > 1) return std::nullopt;
  return attempt([&] {
    points = on_host(points, 1);
    const std::vector<gpu::PointOnFace> located = locate(vertices, points, mesh, false);
    WindingNumbers found{std::vector<std::int32_t>(located.size()), std::vector<std::uint8_t>(located.size())};
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < located.size(); ++i) {
      found.numbers[i] = located[i].winding;
      if (located[i].winding == gpu::undecided_winding) open.push_back(i);
    }
    on_cpu(vertices, points, mesh, open, [&](const MeshInTree& in_tree, Positions rest) {
      const WindingNumbers decided = hpccd::winding_numbers(in_tree, rest, shared_.pool);
      for (std::size_t i = 0; i < open.size(); ++i)
        found.numbers[open[i]] = decided.numbers[i], found.on_surface[open[i]] = decided.on_surface[i];
    });
    return found;
  });
}

std::optional<SignedDistances> GpuBackend::signed_distances(Positions vertices, Positions points, std::uint32_t mesh) {
  if (n_worlds() > 1) return std::nullopt;
  return attempt([&] {
    points = on_host(points, 1);
    const std::vector<gpu::PointOnFace> located = locate(vertices, points, mesh, true);
    SignedDistances found;
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < located.size(); ++i) {
      const gpu::PointOnFace& p = located[i];
      if (p.winding == gpu::undecided_winding || p.distance == gpu::undecided_distance) open.push_back(i);
      found.distance.push_back(p.winding != 0 ? -p.distance : p.distance);
      found.faces.push_back(p.face);
      found.closest.push_back({p.closest.x, p.closest.y, p.closest.z});
    }
    on_cpu(vertices, points, mesh, open, [&](const MeshInTree& in_tree, Positions rest) {
      const SignedDistances decided = hpccd::signed_distances(in_tree, rest, shared_.pool);
      for (std::size_t i = 0; i < open.size(); ++i) {
        found.distance[open[i]] = decided.distance[i], found.faces[open[i]] = decided.faces[i];
        found.closest[open[i]] = decided.closest[i];
      }
    });
    return found;
  });
}

std::vector<gpu::PointOnFace> GpuBackend::locate(Positions vertices, Positions points, std::uint32_t mesh,
                                                 bool with_distances) {
  checked_points(points, shared_.pool);
  prepare_snapshot(gpu::Query::intersections, vertices, 0);
  auto located = pipeline_->locate_points(vertices, points, mesh, with_distances, shared_.pool);
  if (!located) throw_bad_snapshot(vertices);
  shared_.profiler.mark("gpu");
  return std::move(*located);
}

// Calls decide(mesh, points) for the open ones.
template <class Decide>
void GpuBackend::on_cpu(Positions vertices, Positions points, std::uint32_t mesh, const std::vector<std::size_t>& open,
                        Decide&& decide) {
  if (open.empty()) return;
  const std::vector<Vec3<double>> all = checked_points(points, shared_.pool);
  std::vector<double> rest;
  rest.reserve(3 * open.size());
  for (const std::size_t i : open) rest.insert(rest.end(), {all[i].x, all[i].y, all[i].z});
  shared_.tree.bound(on_host(vertices, 0));
  shared_.tree.fit(shared_.profiler);
  decide(MeshInTree{shared_.tree.tree(), shared_.tree.motion(), shared_.features, mesh},
         Positions{rest.data(), open.size(), true});
  shared_.profiler.mark("exact");
}

// Points, normals and nearest points of the results.

// Computed on the device, except for rows that only integers can decide, which the CPU computes.
DeviceResults GpuBackend::with_places(gpu::FrameResult found, Outputs outputs, const Separations& separations,
                                      Positions t0, Positions t1) {
  if (!outputs.any() || found.n_vf + found.n_ee == 0) return on_device(found);
  const auto open = pipeline_->find_places(found, outputs);
  if (!open) {
    DeviceResults all = on_device(found);
    add_places(all, outputs, separations, t0, t1);
    return all;
  }
  std::vector<PairPlaces> places(open->size());
  constexpr std::size_t rows_a_piece = 8;  // as for pairs that are left to the CPU
  parallel_for(shared_.pool, places.size(), rows_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const gpu::OpenRow& row = (*open)[i];
      UndecidedPair pair{row.row < found.n_vf ? Kind::vertex_face : Kind::edge_edge, {}, {}, row.separation};
      std::ranges::copy(row.t0, pair.t0);
      std::ranges::copy(row.t1, pair.t1);
      places[i] = pair_places(pair, row.toc, outputs);
    }
  });
  pipeline_->put_places(places);
  places_on_cpu_ = places.size();
  shared_.profiler.mark("places");
  return on_device(found);
}

void GpuBackend::add_places(Contacts& found, Outputs outputs, const Separations& separations, Positions t0,
                            Positions t1) {
  if (!outputs.any()) return;
  const bool snapshot = t0.data == t1.data;
  t0 = on_host(t0, 0), t1 = snapshot ? t0 : on_host(t1, 1);
  if (n_worlds() == 1)
    hpccd::add_places(found, outputs, shared_.features, separations, t0, t1, shared_.pool);
  else
    add_places_of_worlds(found, outputs, shared_.features, separations, t0, t1, shared_.pool);
}

// All computed by the CPU.
void GpuBackend::add_places(DeviceResults& found, Outputs outputs, const Separations& separations, Positions t0,
                            Positions t1) {
  places_on_cpu_ = found.n_vf + found.n_ee;
  const auto fetch = [](auto& to, const auto* from, std::size_t n) {
    to.resize(n);
    gpu::download(from, to.data(), n * sizeof to[0]);
  };
  Contacts c;
  fetch(c.vf, found.vf, found.n_vf), fetch(c.vf_toc, found.values, found.n_vf);
  fetch(c.ee, found.ee, found.n_ee), fetch(c.ee_toc, found.values + found.n_vf, found.n_ee);
  if (n_worlds() > 1) {
    fetch(c.slices.vf, found.vf_offsets, n_worlds() + 1);
    fetch(c.slices.ee, found.ee_offsets, n_worlds() + 1);
  }
  add_places(c, outputs, separations, t0, t1);
  gpu::add_places(found, c);
  shared_.profiler.mark("places");
}

// Prepared frames (hpccd/prepared.h).

GpuBackend::Prepared GpuBackend::prepare(Positions t0, Positions t1, double room) {
  Options options = shared_.options;
  options.gpu_stages = false;  // unused, and events would accumulate
  Prepared p;
  p.pipeline =
      gpu::Pipeline::create(*shared_.scene, shared_.features, options, shared_.separations, shared_.common.thickness,
                            shared_.common.filter, gpu::status().devices.at(0).number);
  shared_.tree.bound(on_host(of_world(t0, 0), 0), on_host(of_world(t1, 0), 1), {});
  shared_.tree.build_anew();
  p.pipeline->set_tree(shared_.tree.tree());
  require_good(p.pipeline->run(t0, t1, std::nullopt, shared_.pool), t0, t1);
  p.pipeline->finish();
  p.results = p.pipeline->prepare(t0, t1, room);
  return p;
}

}  // namespace hpccd
