// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <limits>
#include <utility>

#include "gpu/device_contacts.cuh"
#include "gpu/device_motion.cuh"
#include "gpu/device_near_list.cuh"
#include "gpu/device_nearest.cuh"
#include "gpu/device_places.cuh"
#include "gpu/device_points.cuh"
#include "gpu/device_positions.cuh"
#include "gpu/device_scene.cuh"
#include "gpu/device_tree.cuh"
#include "gpu/hints.cuh"
#include "gpu/leaf_kdops.cuh"
#include "gpu/pipeline.h"
#include "gpu/prepared.cuh"
#include "gpu/refit.cuh"
#include "gpu/stages.cuh"
#include "gpu/test_lists.cuh"

namespace hpccd::gpu {
namespace {

constexpr double no_time = std::numeric_limits<double>::infinity();
// As the counters have it (counters.cuh).
double as_time(u64 soonest) { return soonest ? std::bit_cast<double>(~soonest) : no_time; }

class DevicePipeline : public Pipeline {
 public:
  DevicePipeline(const Scene& scene, const Features& features, const Options& options,
                 const SeparationTable& separations, const ThicknessTable& thickness, const FeatureFilter& filter,
                 int device)
      : device_((check(cudaSetDevice(device), "cudaSetDevice"), device)),
        options_(options),
        timer_(options.gpu_stages),
        features_(features),
        scene_(scene, features, options.accuracy, options.features, separations, thickness, filter, options.worlds),
        tree_(options.worlds),
        nearest_(options.worlds),
        positions_(device),
        lists_(16 * typical_size(), 4 * typical_size(), typical_size() / 2),
        contacts_(scene_.keys().bits(), options.worlds * (std::size_t{features.n_vertices} + features.edges.size()),
                  options.worlds, options.results_on_device) {
    check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    counters_.reserve(1);
    host_counters_.reserve(1);
    *host_counters_.data() = {};
    leaf_pairs_.reserve(4 * typical_size());
    contacts_.reserve(typical_size());
    motion_.reserve(features.n_vertices, options.worlds);
    hints_.reserve(stream_);
  }

  ~DevicePipeline() override {
    const CallersDevice callers;
    cudaSetDevice(device_);
    cudaStreamSynchronize(stream_);
  }

  void set_tree(const Tree& tree) override {
    check(cudaSetDevice(device_), "cudaSetDevice");
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    tree_.set(features_, tree);
    nearest_.set(tree);
  }

  bool run(Positions t0, Positions t1, Best best, ThreadPool& pool) override {
    begin();
    best_ = best;
    scene_.update_separations();
    return run_frame(scene_.query_now(), t0, t1, 0, pool);
  }
  bool run_snapshot(Query query, Positions vertices, double distance, ThreadPool& pool) override {
    begin();
    scene_.update_separations();
    return run_frame(query, vertices, vertices, distance, pool);
  }
  std::optional<std::vector<PointOnFace>> locate_points(Positions vertices, Positions points, u32 mesh,
                                                        bool with_distances, ThreadPool& pool) override {
    begin();
    goal_ = Goal::points, query_ = Query::intersections;
    const PointsTask task = points_.bring(points, mesh, with_distances, pool, stream_);
    return vertices.is_double ? locate_points<double>(vertices, task, pool)
                              : locate_points<float>(vertices, task, pool);
  }
  NearestPairsFound find_nearest(Positions vertices, const std::vector<PairToSearch>& pairs, std::uint64_t version,
                                 ThreadPool& pool) override {
    begin();
    scene_.update_separations();
    goal_ = Goal::nearest, query_ = Query::nearest;
    return vertices.is_double ? find_nearest<double>(vertices, pairs, version, pool)
                              : find_nearest<float>(vertices, pairs, version, pool);
  }
  std::vector<std::int32_t> windings_of(const std::vector<VertexInMesh>& vertices) override {
    std::vector<std::int32_t> numbers;
    with_last_frame([&](auto params) {
      tree_.fill(params);
      const InsideTask task = nearest_.ask(vertices, stream_);
      launch_inside(params, task, on_stream());
      numbers = nearest_.numbers(task, stream_);
    });
    return numbers;
  }
  bool run_for_earliest(Positions t0, Positions t1, Pairs pairs, Best best, ThreadPool& pool) override {
    begin();
    best_ = best;
    scene_.update_separations();
    goal_ = pairs == Pairs::all ? Goal::earliest : Goal::earliest_of_near;
    return run_frame(scene_.query_now(), t0, t1, 0, pool);
  }
  EarliestTime earliest() const override;
  std::vector<double> earliest_of_worlds() override;
  bool list_near(Positions vertices, double distance, std::size_t most, ThreadPool& pool) override {
    if (for_earliest()) last_counters_ = *host_counters_.data();
    begin();
    goal_ = Goal::near_list;
    most_near_ = most, gave_up_listing_ = false;
    return run_frame(Query::proximity, vertices, vertices, distance, pool);
  }
  bool gave_up_listing() const override { return gave_up_listing_; }
  void choose_hints(double earliest) override;
  void forget_near() override;
  const std::vector<Candidate>& undecided() const override { return undecided_; }

  void add(const std::vector<Contact>& vertex_face, const std::vector<Contact>& edge_edge) override;
  FrameResult finish() override {
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    return contacts_.result(query_, *host_counters_.data());
  }
  std::optional<std::vector<OpenRow>> find_places(FrameResult& result, Outputs outputs) override;
  PreparedResults prepare(Positions t0, Positions t1, double room) override;
  void enqueue(void* stream) override;
  void put_places(const std::vector<PairPlaces>& places) override { places_.put(places_out_, places, on_stream()); }

  Wear wear() const override { return {host_counters_.data()->area, host_counters_.data()->looseness}; }
  std::map<std::string, std::uint64_t> stats() const override;
  std::map<std::string, double> stages() const override { return timer_.stages(); }

 private:
  // Initial size of lists, as a multiple of the scene's primitives: most scenes outgrow it once or never.
  std::size_t typical_size() const {
    return std::max<std::size_t>(std::size_t{features_.n_primitives()} * options_.worlds, 1024);
  }
  void begin() {
    goal_ = Goal::results, best_.reset();
    check(cudaSetDevice(device_), "cudaSetDevice");
    // Work of a failed frame may still be using these buffers.
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    host_counters_.data()->area = 0;  // not yet known for this frame, and never if it is rejected
  }
  bool run_frame(Query query, Positions t0, Positions t1, double distance, ThreadPool& pool) {
    query_ = query;
    return t0.is_double ? run_frame<double>(t0, t1, distance, pool) : run_frame<float>(t0, t1, distance, pool);
  }
  template <class T>
  bool run_frame(Positions t0, Positions t1, double distance, ThreadPool& pool);
  template <class T>
  LaunchParams<T> fit_snapshot(Positions vertices, ThreadPool& pool);
  template <class T>
  std::optional<std::vector<PointOnFace>> locate_points(Positions vertices, const PointsTask& task, ThreadPool& pool);
  template <class T>
  NearestPairsFound find_nearest(Positions vertices, const std::vector<PairToSearch>& pairs, std::uint64_t version,
                                 ThreadPool& pool);
  template <class T>
  LaunchParams<T> frame_params(double distance, const T* given_t0, const T* given_t1);
  template <class T>
  void launch(LaunchParams<T>& params);
  template <class T>
  void launch_refit(LaunchParams<T>& params);
  template <class T>
  void launch_tree(LaunchParams<T>& params);
  template <class T>
  void launch_results(const LaunchParams<T>& params);
  template <class T>
  void launch_wear(const LaunchParams<T>& params);
  template <class T>
  void enqueue_frame();
  void give_places(FrameResult& r) const;
  Stages on_stream() { return {multiprocessors_, on_, timer_}; }
  template <class Use>
  void with_last_frame(Use&& use);
  template <class T>
  LaunchParams<T> last_frame() const;
  void copy_counters();
  bool is_fast() const;
  template <class T>
  bool guessed_wrong(const LaunchParams<T>& params);
  Wanted wanted() const {
    if (goal_ != Goal::results || of_snapshot(query_) || options_.report == Report::all) return Wanted::all;
    return options_.report == Report::first ? Wanted::earliest : Wanted::first;
  }
  bool grow_overflowed();
  bool lists_too_many() const;

  int device_, multiprocessors_ = 1;
  const Options options_;
  Stream stream_;
  cudaStream_t on_ = stream_;  // where kernels are launched
  Event counted_;
  StageTimer timer_;
  const Features& features_;

  DeviceScene scene_;
  DeviceTree tree_;
  DeviceNearest nearest_;
  DevicePositions positions_;
  DeviceMotion motion_;
  DeviceBuffer<uint2> leaf_pairs_;
  TestLists lists_;
  DeviceContacts contacts_;
  DevicePlaces places_;
  PlacesOut places_out_{};
  DeviceBuffer<Counters> counters_;
  PinnedBuffer<Counters> host_counters_;
  Counters last_counters_{};  // of the last frame that was not only for near lists: reported by stats()

  // The purpose of a frame: contacts for the caller, or less.
  enum class Goal : unsigned char { results, earliest, earliest_of_near, near_list, points, nearest };
  bool for_earliest() const { return goal_ == Goal::earliest || goal_ == Goal::earliest_of_near; }

  Hints hints_;
  DeviceNearList near_;
  DevicePoints points_;
  std::size_t most_near_ = 0;
  bool gave_up_listing_ = false;
  bool given_doubles_ = true;             // in the last frame
  u64 floats_suffice_ = options_.worlds;  // number of worlds for which floats sufficed in the last fast frame
  Goal goal_ = Goal::results;
  Best best_;
  Query query_ = Query::contacts;
  u64 passes_ = 0, exact_last_time_ = 0;
  std::vector<Candidate> undecided_;
  // The caller's positions of a prepared frame.
  const void *prepared_t0_ = nullptr, *prepared_t1_ = nullptr;
  std::shared_ptr<DeviceBuffer<PreparedCounts>> prepared_counts_;
};

template <class T>
bool DevicePipeline::run_frame(Positions t0, Positions t1, double distance, ThreadPool& pool) {
  if (goal_ != Goal::near_list) undecided_.clear(), passes_ = 0;
  timer_.begin(stream_);
  if (goal_ == Goal::results) contacts_.begin();
  // The caller's stream may still read these rows. Copying positions from the device waits for it as well.
  if (goal_ == Goal::results && (tree_.empty() || (options_.results_on_device && !t0.on_device)))
    positions_.wait_for(t0.made_on, stream_);
  if (tree_.empty()) {
    *host_counters_.data() = {};
    motion_.forget(stream_);
    if (goal_ == Goal::results) contacts_.find_nothing(stream_);
    return true;
  }
  const T* given[2];
  positions_.bring(t0, t1, given, pool, stream_);
  given_doubles_ = t0.is_double;
  prepared_t0_ = given[0], prepared_t1_ = given[1];
  LaunchParams<T> params = frame_params(distance, given[0], given[1]);
  timer_.mark("upload", stream_);
  const Counters& c = *host_counters_.data();
  if (goal_ == Goal::earliest_of_near) lists_.make_room(near_.most());
  for (bool again = true; again;) {
    if (goal_ != Goal::near_list) ++passes_;
    params.in_floats = params.fast && floats_suffice_ > 0;
    params.in_doubles = !params.fast || floats_suffice_ < options_.worlds;
    launch(params);
    if (goal_ == Goal::results) launch_results(params);
    copy_counters();
    check(cudaEventRecord(counted_, stream_), "cudaEventRecord");
    // The last frame had pairs for exact arithmetic: sleeping threads take longer to wake than these take.
    if (exact_last_time_ > 1) pool.share([](int) {});
    check(cudaEventSynchronize(counted_), "cudaEventSynchronize");
    if (c.bad) return false;
    if ((gave_up_listing_ = lists_too_many())) return true;
    again = guessed_wrong(params);
    again = grow_overflowed() || again;
  }
  require_balance(c, of_snapshot(query_));
  const u64 n_to_host = exact_last_time_ = c.to_host;
  if (goal_ == Goal::results && contacts_.complete(query_, params, c, on_stream())) copy_counters();
  if (goal_ == Goal::near_list) near_.collect(params, c, stream_);
  if (goal_ == Goal::near_list) return true;
  undecided_.reserve(n_to_host);
  for (u64 i = 0; i < n_to_host; ++i) undecided_.push_back(scene_.keys().pair_of(lists_.to_host()[i]));
  return true;
}

// The tree of a snapshot, and the parameters of what searches it.
template <class T>
LaunchParams<T> DevicePipeline::fit_snapshot(Positions vertices, ThreadPool& pool) {
  timer_.begin(stream_);
  const T* given[2];
  positions_.bring(vertices, vertices, given, pool, stream_);
  given_doubles_ = vertices.is_double;
  LaunchParams<T> params = frame_params(0, given[0], given[1]);
  timer_.mark("upload", stream_);
  motion_.begin(params, multiprocessors_, stream_);
  motion_.launch(query_, params, stream_);
  timer_.mark("bounds", stream_);
  launch_refit(params);
  timer_.mark("refit", stream_);
  return params;
}

template <class T>
std::optional<std::vector<PointOnFace>> DevicePipeline::locate_points(Positions vertices, const PointsTask& task,
                                                                      ThreadPool& pool) {
  undecided_.clear(), passes_ = 1;
  const LaunchParams<T> params = fit_snapshot<T>(vertices, pool);
  launch_points(params, task, on_stream());
  launch_wear(params);
  copy_counters();
  std::vector<PointOnFace> found = points_.results(task, stream_);
  if (host_counters_.data()->bad) return std::nullopt;
  return found;
}

template <class T>
NearestPairsFound DevicePipeline::find_nearest(Positions vertices, const std::vector<PairToSearch>& pairs,
                                               std::uint64_t version, ThreadPool& pool) {
  undecided_.clear(), passes_ = 0;
  const LaunchParams<T> params = fit_snapshot<T>(vertices, pool);
  launch_wear(params);
  for (;;) {
    ++passes_;
    NearestTask task = nearest_.task(pairs, version, params);
    task.thickness = scene_.thickness();
    launch_nearest(params, task, nearest_.levels(), nearest_.within_meshes(), on_stream());
    nearest_.copy_results(task, stream_);
    copy_counters();
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    NearestPairsFound r;
    r.good = host_counters_.data()->bad == 0;
    if (!r.good) return r;
    const DeviceNearest::Room room = nearest_.grow();
    r.gave_up = room == DeviceNearest::Room::too_little;
    if (r.gave_up) return r;
    if (room == DeviceNearest::Room::enough) return nearest_.found(task, stream_);
  }
}

template <class T>
LaunchParams<T> DevicePipeline::frame_params(double distance, const T* given_t0, const T* given_t1) {
  LaunchParams<T> params{};
  scene_.fill(params);
  params.fast = is_fast();
  params.time_only = for_earliest();
  params.until_best = best_.has_value(), params.best = best_.value_or(no_time);
  if (!of_snapshot(query_)) scene_.fill_separations(params);
  if (of_snapshot(query_)) params.separation = distance;
  // A list of near pairs is by the distance of centre surfaces.
  if (query_ == Query::proximity && goal_ != Goal::near_list) scene_.fill_thickness(params);
  params.integers_on_device = true;
  params.wanted = wanted();
  params.largest = of_snapshot(query_) ? largest_in_snapshot : largest_coordinate;
  tree_.fill(params);
  motion_.fill(params);
  params.given_t0 = given_t0, params.given_t1 = given_t1;
  motion_.fill_counters(params, counters_.data());
  return params;
}

template <class T>
void DevicePipeline::launch(LaunchParams<T>& params) {
  params.leaf_pairs = {leaf_pairs_.data(), leaf_pairs_.size()};
  contacts_.fill(params, goal_ == Goal::results);
  hints_.fill(params);
  motion_.begin(params, multiprocessors_, on_);
  if (for_earliest() && options_.worlds == 1) near_.measure(params, on_);
  if (best_ && goal_ != Goal::earliest_of_near) launch_hints(query_, params, on_stream());
  motion_.launch(query_, params, on_);
  timer_.mark("bounds", on_);
  if (goal_ == Goal::earliest_of_near) {
    lists_.fill(params);
    near_.take(params, on_);
    timer_.mark("near_list", on_);
    lists_.launch(query_, TestLists::From::near_list, params, multiprocessors_, on_, timer_);
  } else {
    launch_tree(params);
  }
  if (goal_ != Goal::earliest) return;
  if (options_.worlds > 1) contacts_.launch_firsts(params, on_stream());
  launch_wear(params);
}

template <class T>
void DevicePipeline::launch_refit(LaunchParams<T>& params) {
  refit_kernel<<<blocks_for(std::size_t{params.all_leaves()} * refit_lanes, 128), 128, 0, on_>>>(params);
  check_launch("refit_kernel");
}

template <class T>
void DevicePipeline::launch_tree(LaunchParams<T>& params) {
  launch_refit(params);
  if (query_ == Query::contacts) launch_leaf_kdops(params, on_);
  timer_.mark("refit", on_);
  const auto traverse = of_snapshot(query_) ? traverse_kernel<true, T> : traverse_kernel<false, T>;
  traverse<<<blocks_for(params.all_leaves(), traverse_warps * traverse_leaves), 32 * traverse_warps, 0, on_>>>(params);
  check_launch("traverse_kernel");
  timer_.mark("traverse", on_);
  lists_.launch(query_, TestLists::From::leaves, params, multiprocessors_, on_, timer_);
}

template <class T>
void DevicePipeline::launch_results(const LaunchParams<T>& params) {
  contacts_.launch(query_, params, on_stream());
  launch_wear(params);
}

template <class T>
void DevicePipeline::launch_wear(const LaunchParams<T>& params) {
  wear_kernel<<<std::min(blocks_for(std::size_t{params.n_worlds} * params.n_nodes, 256),
                         static_cast<unsigned>(multiprocessors_)),
                256, 0, on_>>>(params);
  check_launch("wear_kernel");
  timer_.mark("wear", on_);
}

void DevicePipeline::add(const std::vector<Contact>& vertex_face, const std::vector<Contact>& edge_edge) {
  check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  std::vector<u64> keys;
  std::vector<double> tocs;
  for (const auto* list : {&vertex_face, &edge_edge})
    for (const Contact& c : *list) {
      keys.push_back(scene_.keys().key_of(list == &edge_edge ? Kind::edge_edge : Kind::vertex_face, c.first, c.second));
      tocs.push_back(c.toc);
    }
  Counters& c = *host_counters_.data();
  contacts_.append(c.found_all, keys, tocs, stream_);
  c.found[0] += vertex_face.size(), c.found[1] += edge_edge.size(), c.found_all += keys.size();
  check(cudaMemcpyAsync(counters_.data(), &c, sizeof c, cudaMemcpyHostToDevice, stream_), "cudaMemcpyAsync");
  with_last_frame([&](auto params) {
    params.wanted = wanted();
    contacts_.forget_results(params, stream_);
    contacts_.launch(query_, params, on_stream());
    copy_counters();
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    if (contacts_.complete(query_, params, c, on_stream())) copy_counters();
  });
}

PreparedResults DevicePipeline::prepare(Positions t0, Positions t1, double room) {
  if (!tree_.empty() && (prepared_t0_ != t0.data || prepared_t1_ != t1.data))
    throw InvalidArgument("vertices_t0, vertices_t1: must be on CUDA device " + std::to_string(device_) +
                          ", where this detector works, so that they can be read in place");
  const Counters& c = *host_counters_.data();
  const auto roomy = [&](u64 n) { return static_cast<std::size_t>(room * static_cast<double>(n)) + 1024; };
  TestLists::Sizes sizes = lists_.sizes();
  const auto each = [&](std::size_t (&of)[2], u64 most) {
    for (std::size_t& size : of) size = std::max(size, roomy(most));
  };
  each(sizes.survivors, c.most_survivors), each(sizes.single, c.most_single), each(sizes.many, c.most_many);
  if (query_ == Query::separations) each(sizes.separated, c.most_separated);
  sizes.undecided = std::max(sizes.undecided, roomy(c.undecided));
  sizes.open = std::max(sizes.open, roomy(c.open_in_integers[0]));
  lists_.reserve(sizes);
  leaf_pairs_.reserve(roomy(c.leaf_pairs));
  contacts_.reserve(roomy(c.found_all));
  prepared_counts_ = std::make_shared<DeviceBuffer<PreparedCounts>>();
  prepared_counts_->reserve(1);
  const ResultPlaces to = contacts_.reserve_rows(roomy(c.rows[0]), roomy(c.rows[1]));
  const Outputs outputs = Outputs::of_contacts(options_);
  places_out_ = contacts_.reserve_places(to.most_vf + to.most_ee, outputs);
  if (outputs.any()) places_.reserve(to.most_vf + to.most_ee);
  enqueue(stream_);  // lazy loading and lookups cannot be captured
  check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  const FrameResult r = contacts_.result(query_, c);
  PreparedResults p;
  using Owner = std::shared_ptr<const void>;
  p.memory = std::make_shared<std::pair<Owner, Owner>>(r.memory, prepared_counts_), p.device = device_;
  p.room_vf = to.most_vf, p.room_ee = to.most_ee;
  p.vf = r.vf, p.ee = r.ee, p.tocs = r.toc, p.counts = prepared_counts_->data();
  p.vf_offsets = r.vf_offsets, p.ee_offsets = r.ee_offsets, p.hashes = r.hashes, p.first_tocs = r.first_tocs;
  FrameResult o;
  give_places(o);
  p.points = reinterpret_cast<decltype(p.points)>(o.points);
  p.normals = reinterpret_cast<decltype(p.normals)>(o.normals);
  p.closest = reinterpret_cast<decltype(p.closest)>(o.closest);
  p.vertices = o.vertices, p.weights = reinterpret_cast<decltype(p.weights)>(o.weights), p.approach = o.approach;
  return p;
}

void DevicePipeline::enqueue(void* stream) {
  const CallersDevice callers;
  check(cudaSetDevice(device_), "cudaSetDevice");
  const auto restore = [this](cudaStream_t* on) { *on = stream_; };
  const std::unique_ptr<cudaStream_t, decltype(restore)> launched_there(&on_, restore);
  on_ = static_cast<cudaStream_t>(stream);
  positions_.require_stream(on_, stream_);
  given_doubles_ ? enqueue_frame<double>() : enqueue_frame<float>();
}

template <class T>
void DevicePipeline::enqueue_frame() {
  const ResultPlaces to = contacts_.places();
  LaunchParams<T> params{};
  if (tree_.empty()) {
    params.n_worlds = options_.worlds;
    motion_.fill_counters(params, counters_.data());
    check(cudaMemsetAsync(counters_.data(), 0, sizeof(Counters), on_), "cudaMemsetAsync");
    contacts_.find_nothing(on_);
  } else {
    params = frame_params(0, static_cast<const T*>(prepared_t0_), static_cast<const T*>(prepared_t1_));
    // Only the device will know for which worlds floats suffice.
    params.in_floats = params.fast, params.in_doubles = true;
    launch(params);
    launch_results(params);
  }
  const TestLists::Sizes s = lists_.sizes();
  tell_kernel<<<blocks_for(options_.worlds + 1, 256), 256, 0, on_>>>(
      params,
      {leaf_pairs_.size(), std::min(s.survivors[0], s.survivors[1]), std::min(s.single[0], s.single[1]),
       std::min(s.many[0], s.many[1]), std::min(s.separated[0], s.separated[1]), s.undecided, s.open,
       contacts_.capacity()},
      to, prepared_counts_->data());
  check_launch("tell_kernel");
  if (tree_.empty() || !places_out_.outputs.any()) return;
  scene_.fill_separations(params);
  const auto* n_rows = reinterpret_cast<const u64*>(&prepared_counts_->data()->vertex_face);
  const PlacesTask task = places_.launch(params, contacts_.result(query_, {}), n_rows, places_out_, on_stream());
  tell_places_kernel<<<blocks_for(options_.worlds + 1, 256), 256, 0, on_>>>(task, options_.worlds, to,
                                                                            prepared_counts_->data());
  check_launch("tell_places_kernel");
}

void DevicePipeline::give_places(FrameResult& r) const {
  const Outputs& outputs = places_out_.outputs;
  if (outputs.points) r.points = places_out_.points;
  if (outputs.normals) r.normals = places_out_.normals;
  if (outputs.closest) r.closest = places_out_.closest;
  if (!outputs.weights) return;
  r.vertices = reinterpret_cast<decltype(r.vertices)>(places_out_.vertices), r.weights = places_out_.weights;
  if (outputs.at == AtTime::contact) r.approach = places_out_.approach;
}

std::optional<std::vector<OpenRow>> DevicePipeline::find_places(FrameResult& r, Outputs outputs) {
  places_out_ = contacts_.reserve_places(r.n_vf + r.n_ee, outputs);
  give_places(r);
  std::optional<std::vector<OpenRow>> open;
  with_last_frame([&](auto params) {
    if (!of_snapshot(query_)) scene_.fill_separations(params);
    open = places_.find(params, r, counters_.data()->rows, places_out_, on_stream());
  });
  return open;
}

EarliestTime DevicePipeline::earliest() const {
  const Counters& c = *host_counters_.data();
  return {as_time(c.soonest), near_.has_snapshot() ? std::bit_cast<double>(c.away) : no_time,
          std::bit_cast<double>(c.way)};
}

std::vector<double> DevicePipeline::earliest_of_worlds() {
  std::vector<WorldCounters> worlds(options_.worlds);
  with_last_frame([&](const auto& params) {
    check(cudaMemcpyAsync(worlds.data(), params.worlds, worlds.size() * sizeof worlds[0], cudaMemcpyDeviceToHost,
                          stream_),
          "cudaMemcpyAsync");
  });
  check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  std::vector<double> times;
  for (const WorldCounters& w : worlds) times.push_back(as_time(w.first_toc));
  return times;
}

void DevicePipeline::choose_hints(double earliest) {
  const Counters& c = *host_counters_.data();
  with_last_frame([&](auto params) {
    params.until_best = true, params.best = earliest;
    hints_.choose(params, as_time(c.soonest_proven), c.found_all, stream_);
  });
}

void DevicePipeline::forget_near() {
  with_last_frame([&](const auto& params) { near_.begin_at(params, stream_); });
}

template <class Use>
void DevicePipeline::with_last_frame(Use&& use) {
  if (given_doubles_)
    use(last_frame<double>());
  else
    use(last_frame<float>());
}

template <class T>
LaunchParams<T> DevicePipeline::last_frame() const {
  LaunchParams<T> params{};
  scene_.fill(params);
  motion_.fill(params);
  contacts_.fill(params, false);
  hints_.fill(params);
  motion_.fill_counters(params, counters_.data());
  return params;
}

void DevicePipeline::copy_counters() {
  check(cudaMemcpyAsync(host_counters_.data(), counters_.data(), sizeof(Counters), cudaMemcpyDeviceToHost, stream_),
        "cudaMemcpyAsync");
}

// Checked before memory is allocated for unneeded lists. An eighth of the candidates of ordinary lists is near.
bool DevicePipeline::lists_too_many() const {
  const Counters& c = *host_counters_.data();
  return goal_ == Goal::near_list && (c.found_all + c.to_host > most_near_ || c.leaf_pairs > 8 * most_near_ ||
                                      c.all_survivors[0] + c.all_survivors[1] > 32 * most_near_);
}

// Whether all pairs of the frame may be tested in single precision first.
bool DevicePipeline::is_fast() const {
  return query_ == Query::contacts && !best_ && goal_ != Goal::earliest_of_near && scene_.all_fast();
}

// Only the device knows where floats suffice, and kernels are launched before: assumes the last frame's result. True if
// the frame must run again.
template <class T>
bool DevicePipeline::guessed_wrong(const LaunchParams<T>& params) {
  if (!params.fast) return false;
  floats_suffice_ = host_counters_.data()->floats_suffice;
  return (floats_suffice_ > 0 && !params.in_floats) || (floats_suffice_ < options_.worlds && !params.in_doubles);
}

// Enlarges lists that were too short. True if the frame must run again.
bool DevicePipeline::grow_overflowed() {
  const Counters& c = *host_counters_.data();
  bool again = lists_.grow(c, goal_ == Goal::earliest_of_near ? TestLists::From::near_list : TestLists::From::leaves);
  if (c.leaf_pairs > leaf_pairs_.size()) {
    again = true;
    leaf_pairs_.reserve(c.leaf_pairs + c.leaf_pairs / 4);
  }
  return contacts_.grow(c) || again;
}

std::map<std::string, std::uint64_t> DevicePipeline::stats() const {
  const Counters& c = goal_ == Goal::near_list ? last_counters_ : *host_counters_.data();
  std::map<std::string, std::uint64_t> s;
  const bool edges_and_faces = query_ == Query::intersections;  // in place of the first kind
  const char* kinds[2] = {edges_and_faces ? "ef" : "vf", "ee"};
  for (int k = 0; k < (edges_and_faces ? 1 : 2); ++k) {
    const std::string kind = kinds[k];
    const BatchCounts b = batch_counts(c, k);
    s[kind + "_candidates"] = b.tested;
    s[kind + "_ignored"] = c.ignored[k];
    s[kind + "_rejected_coplanarity"] = b.coplanarity;
    s[kind + "_rejected_projection"] = b.projection;
    s[kind + "_rejected_roots"] = b.roots;
    s[kind + "_rejected_separated"] = b.separated;
    s[kind + "_proven_contacts"] = b.contacts;
    s[kind + "_undecided"] = b.undecided;
    if (edges_and_faces) continue;
    s[kind + "_by_tolerance"] = c.by_tolerance[k];
    s[kind + "_by_extended"] = c.by_extended[k];
    s[kind + "_by_integers"] = c.by_integers[k];
    s[kind + "_single_root"] = c.all_single[k];
    s[kind + "_many_roots"] = c.all_many[k];
  }
  s["node_pairs"] = c.node_tests;
  s["leaf_pairs"] = c.leaf_pairs;
  s["gpu_passes"] = passes_;
  s["gpu_segments"] = lists_.n_segments();
  s["gpu_bytes"] = scene_.bytes() + tree_.bytes() + nearest_.bytes() + positions_.bytes() + motion_.bytes() +
                   leaf_pairs_.bytes() + lists_.bytes() + contacts_.bytes() + places_.bytes() + near_.bytes() +
                   hints_.bytes() + points_.bytes();
  if (for_earliest() || goal_ == Goal::near_list) s["near_pairs"] = near_.size();
  if (goal_ == Goal::nearest) s["leaf_pairs"] = nearest_.counters().leaves, s["candidates"] = nearest_.counters().tests;
  return s;
}

}  // namespace

std::unique_ptr<Pipeline> Pipeline::create(const Scene& scene, const Features& features, const Options& options,
                                           const SeparationTable& separations, const ThicknessTable& thickness,
                                           const FeatureFilter& filter, int device) {
  if (status().devices.empty()) throw Error(status().reason);
  return std::make_unique<DevicePipeline>(scene, features, options, separations, thickness, filter, device);
}

}  // namespace hpccd::gpu
