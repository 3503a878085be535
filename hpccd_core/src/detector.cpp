// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "base/parallel.h"
#include "base/profiler.h"
#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "contacts/canonical.h"
#include "gpu/frames.h"
#include "hybrid/frames.h"
#include "paper/method.h"
#include "paper/primitive_pairs.h"
#include "scene/features.h"
#include "scene/static_meshes.h"
#include "traverse/traverse.h"

namespace hpccd {
namespace {

// The communication thread of the hybrid waits actively: on a core that the pool uses it would hold up a thread that
// all others then wait for (a quarter of a frame of 1 ms).
int pool_threads(const Options& o) {
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  if (o.backend != Backend::hybrid || cores < 2 || (o.threads > 0 && o.threads < cores)) return o.threads;
  return o.threads > cores ? o.threads : cores - 1;
}

}  // namespace

struct Detector::Impl {
  Impl(std::shared_ptr<const Scene> s, Options o)
      : scene(std::move(s)),
        options(o),
        pool(pool_threads(o)),
        features(features_of(*scene, pool)),
        rules(*scene, o.accuracy),
        workers(static_cast<std::size_t>(pool.size())) {
    options.simd = resolve(o.simd);
    options.threads = pool.size();
    for (int a = 0; a < 4; ++a) search.batch_test[a] = batch_test(options.simd, static_cast<Accuracy>(a));
    search.leaf_pairs = leaf_pairs(options.simd);
    search.report = o.report;
    search.limits = {o.minimum_separation, o.tolerance};
    search.cancellation = search.limits.cancellation = &cancellation;
    for (ThreadPool* p : {&pool, &one_thread}) p->heed(cancellation);
    if (o.minimum_separation > 0) search.batch_test[static_cast<int>(Accuracy::conservative)] = all_undecided;
    engine = paper::engine_of(options, {features, rules, pool});
    use_gpus();
  }

  // All that a call changes is one call's at a time, on whatever thread. What follows the lock is for all.
  mutable std::mutex one_call;
  Cancellation cancellation;
  std::atomic<Backend> last_backend{Backend::cpu};

  std::shared_ptr<const Scene> scene;
  Options options;
  ThreadPool pool, one_thread{1};
  Features features;
  PairRules rules;
  std::vector<Worker> workers;
  Search search;
  ContactOrder order;
  // Kept by a call that is cancelled: to give the memory of 10 million back to the system takes longer than to end it.
  Contacts contacts;
  MotionBounds motion;
  Tree tree;
  bool tree_fits_motion = false;                // its bounds are those of the last motion taken
  std::unique_ptr<paper::MethodEngine> engine;  // of a published method; none for the default traversal
  std::unique_ptr<gpu::Frames> gpu;             // where the backend is "gpu", or may become it
  std::unique_ptr<hybrid::Frames> hybrid;       // likewise
  std::uint64_t builds = 0;                     // of the tree
  // "auto": the first frames go to each in turn, the rest to the fastest. The first of each warms up.
  struct Trial {
    int frames = 0;
    double best_ms = std::numeric_limits<double>::infinity();
  } trial[4];  // by backend
  Profiler profiler;
  // Of the last call. Its other counts stay where they were made until somebody asks.
  struct Numbers {
    std::size_t vf, ee;
  };
  std::optional<Numbers> found;

  void use_gpus() {
    const std::string why[2] = {gpu::unsupported(options), hybrid::unsupported(options)};
    const bool usable = !gpu::status().devices.empty(), any = options.backend == Backend::automatic;
    if (options.backend == Backend::gpu || options.backend == Backend::hybrid) {
      const bool on_gpu = options.backend == Backend::gpu;
      if (!why[!on_gpu].empty()) throw InvalidArgument(why[!on_gpu]);
      if (!usable)
        throw InvalidArgument(std::string("backend: \"") + (on_gpu ? "gpu" : "hybrid") +
                              "\" is not usable here: " + gpu::status().reason);
    }
    if (usable && (any || options.backend == Backend::gpu) && why[0].empty())
      gpu = std::make_unique<gpu::Frames>(*scene, features, options, pool);
    if (usable && (any || options.backend == Backend::hybrid) && why[1].empty())
      hybrid = std::make_unique<hybrid::Frames>(*scene, features, rules, options, pool);
  }

  Backend next_backend(bool given_on_device) const {
    constexpr int frames_each = 3;
    if (gpu && !gpu->gave_up() && (options.backend == Backend::gpu || given_on_device)) return Backend::gpu;
    if (options.backend == Backend::hybrid && !hybrid->gave_up()) return Backend::hybrid;
    if (options.backend != Backend::automatic) return Backend::cpu;
    std::vector<Backend> usable{Backend::cpu};
    if (gpu && !gpu->gave_up()) usable.push_back(Backend::gpu);
    if (hybrid && !hybrid->gave_up()) usable.push_back(Backend::hybrid);
    const auto trial_of = [this](Backend b) -> const Trial& { return trial[static_cast<int>(b)]; };
    for (int n = 0; n < frames_each; ++n)
      for (const Backend b : usable)
        if (trial_of(b).frames <= n) return b;
    return *std::min_element(usable.begin(), usable.end(),
                             [&](Backend a, Backend b) { return trial_of(a).best_ms < trial_of(b).best_ms; });
  }

  // `meant`: where the frame should have been computed; a backend that failed has had its turn.
  void note_time(Backend meant, Backend used) {
    last_backend = used;
    Trial& t = trial[static_cast<int>(meant)];
    ++t.frames;
    if (meant == used) t.best_ms = std::min(t.best_ms, profiler.stages().at("total"));
  }

  std::optional<Contacts> frame_on_gpu(Positions t0, Positions t1) {
    const auto build_tree = [this](Positions a, Positions b) -> const Tree& {
      tree_fits_motion = false;
      motion.update(*scene, a, b, 0, pool);
      build_tree_anew();
      tree_fits_motion = true;
      return tree;
    };
    return gpu->detect(t0, t1, build_tree, profiler);
  }

  std::uint64_t fallbacks() const { return (gpu ? gpu->fallbacks() : 0) + (hybrid ? hybrid->fallbacks() : 0); }

  void collect() {
    // Handing out the work (five jobs) takes as long as the work on so many.
    constexpr std::size_t few = 1024;
    std::size_t n = 0;
    for (const Worker& w : workers) n += w.vertex_face.size() + w.edge_edge.size();
    const Outputs outputs{options.points, options.normals, options.minimum_separation == 0};
    collect_contacts(workers, search.geometry, options.report, outputs, order, n < few ? one_thread : pool, contacts);
  }

  std::map<std::string, std::uint64_t> stats() const {
    if (!found) return {};
    auto stats = last_backend == Backend::gpu ? gpu->stats() : stats_of_workers();
    stats["vf_contacts"] = found->vf;
    stats["ee_contacts"] = found->ee;
    stats["triangles"] = features.n_faces();
    stats["bytes"] += motion.bytes() + tree.bytes() + features.bytes();
    if (gpu || hybrid) stats["gpu_fallbacks"] = fallbacks();
    return stats;
  }

  void build_tree_anew() {
    ++builds;
    build(tree, *scene, features, motion.boxes, pool);
  }

  // A tree that fits the motion of this step: refitted, or built anew where refitting has lost too much.
  void update_tree(bool tree_followed) {
    if (tree.nodes.empty()) {
      build_tree_anew();
      profiler.mark("build");
      return;
    }
    refit(tree, motion.boxes, tree_followed ? motion.resting : std::vector<char>(), pool);
    profiler.mark("refit");
    if (worn_out(tree.area, tree.area_when_built)) {
      build_tree_anew();
      profiler.mark("build");
    }
  }

  // With the tests on the CPU, or on GPUs beside it. Returns where they were.
  Backend find_contacts(Positions t0, Positions t1, bool with_devices) {
    std::unique_ptr<hybrid::FrameGuard> devices;
    if (with_devices) devices = hybrid->begin(t0, t1, workers, profiler);
    const bool tree_followed = std::exchange(tree_fits_motion, false);
    motion.update(*scene, t0, t1, options.minimum_separation, pool);
    profiler.mark("bounds");
    search.geometry = {motion.vertices.data(), features.edges.data(), features.faces.data(),
                       options.minimum_separation > 0 ? nullptr : motion.kdops.data(), motion.map.scale};
    search.earliest = std::numeric_limits<double>::infinity();
    // Devices find all contacts, and test "fast" as "balanced": then so does the CPU beside them.
    search.report = devices && options.report == Report::any ? Report::all : options.report;
    search.batch_test[static_cast<int>(Accuracy::fast)] =
        batch_test(options.simd, devices ? Accuracy::balanced : Accuracy::fast);
    if (engine) {
      motion.sweep(pool);
      engine->update(motion.swept, profiler);
      if (devices) hybrid->traverse_primitives(workers);
      engine->traverse(motion.swept, search, workers);
    } else {
      update_tree(tree_followed);
      tree_fits_motion = true;
      if (devices) hybrid->traverse(tree, builds, workers);
      traverse(tree, rules, search, pool, workers);
    }
    double elementary = 0;
    for (const Worker& w : workers) elementary += 1e3 * w.elementary_seconds;
    // Tests run inside the traversal; their share of the wall-clock time is their share of the threads' time.
    profiler.mark_split("traverse", "elementary", elementary / pool.size());
    if (!devices) return Backend::cpu;
    const auto test = [this](LeafPair p, Worker& worker) {
      engine ? paper::test_primitives(features, rules, motion.swept, p, worker) : test_leaves(tree, rules, p, worker);
    };
    return hybrid->finish(*devices, workers, test, profiler) ? Backend::hybrid : Backend::cpu;
  }

  std::map<std::string, std::uint64_t> stats_of_workers() const {
    std::map<std::string, std::uint64_t> stats;
    std::uint64_t node_pairs = 0, leaf_pairs = 0, bytes = 0;
    const char* kinds[2] = {"vf", "ee"};
    for (const Worker& w : workers) {
      node_pairs += w.node_pairs;
      leaf_pairs += w.leaf_pairs;
      for (int k = 0; k < 2; ++k) {
        const std::string kind = kinds[k];
        const BatchCounts& c = w.counts[k];
        stats[kind + "_candidates"] += c.tested;
        stats[kind + "_rejected_slabs"] += c.kdop;
        stats[kind + "_rejected_coplanarity"] += c.coplanarity;
        stats[kind + "_rejected_projection"] += c.projection;
        stats[kind + "_rejected_roots"] += c.roots;
        stats[kind + "_proven_contacts"] += c.contacts;
        stats[kind + "_undecided"] += c.undecided;
        const FallbackCounts& last = w.fallbacks[k];
        stats[kind + "_by_tolerance"] += last.tolerance;
        stats[kind + "_by_integers"] += last.integers;
        stats[kind + "_by_inclusion"] += last.inclusion;
      }
      bytes += sizeof(Worker) + w.bytes();
    }
    bytes += order.bytes();
    stats["node_pairs"] = node_pairs;
    stats["leaf_pairs"] = leaf_pairs;
    stats["bytes"] = bytes + (engine ? engine->bytes() : 0);
    if (engine) engine->count(stats);
    if (hybrid) hybrid->count(stats);
    return stats;
  }
};

Detector::Detector(std::shared_ptr<const Scene> scene, Options options)
    : impl_(std::make_unique<Impl>(std::move(scene), options)) {}

Detector::~Detector() = default;

Contacts Detector::detect(Positions t0, Positions t1) {
  Impl& d = *impl_;
  if (t0.n != d.features.n_vertices || t1.n != d.features.n_vertices)
    throw InvalidArgument("vertices_t0, vertices_t1: the scene has " + std::to_string(d.features.n_vertices) +
                          " vertices, but " + std::to_string(t0.n) + " and " + std::to_string(t1.n) + " were given");
  if (t0.is_double != t1.is_double)
    throw InvalidArgument("vertices_t0, vertices_t1: must both be float32 or both be float64");
  if ((t0.on_device || t1.on_device) && !d.gpu)
    throw InvalidArgument(
        "vertices_t0, vertices_t1: are in a GPU's memory, which this detector does not use; copy them "
        "to the host, or use backend=\"gpu\"");
  const std::lock_guard lock(d.one_call);
  d.cancellation.heed();
  d.found.reset();
  std::optional<gpu::CallersDevice> callers;
  if (d.gpu || d.hybrid) callers.emplace();
  d.profiler.begin();
  const Backend backend = d.next_backend(t0.on_device || t1.on_device);
  if (backend == Backend::gpu) {
    if (!t0.on_device && !t1.on_device) require_static_meshes_rest(*d.scene, t0, t1);
    if (auto contacts = d.frame_on_gpu(t0, t1)) {
      d.cancellation.heed();
      d.found = {contacts->vf.size(), contacts->ee.size()};
      d.profiler.end();
      d.note_time(backend, Backend::gpu);
      return std::move(*contacts);
    }
    d.profiler.mark("gpu_failed");
  }
  if (d.gpu) t0 = d.gpu->on_host(t0, 0), t1 = d.gpu->on_host(t1, 1);
  const Backend used = d.find_contacts(t0, t1, backend == Backend::hybrid);
  d.contacts = {};
  d.collect();
  d.profiler.mark("contacts");
  d.cancellation.heed();  // whoever cancelled a call shall not have to look at its answer
  d.found = {d.contacts.vf.size(), d.contacts.ee.size()};
  d.profiler.end();
  d.note_time(backend, used);
  return std::move(d.contacts);
}

void Detector::cancel() { impl_->cancellation.request(); }

std::map<std::string, double> Detector::profile() const {
  const std::lock_guard lock(impl_->one_call);
  auto stages = impl_->profiler.stages();
  if (impl_->gpu && impl_->last_backend == Backend::gpu)
    for (const auto& [name, ms] : impl_->gpu->stages()) stages["gpu/" + name] = ms;
  return stages;
}
std::map<std::string, std::uint64_t> Detector::stats() const {
  const std::lock_guard lock(impl_->one_call);
  return impl_->stats();
}
const Options& Detector::options() const { return impl_->options; }
Backend Detector::last_backend() const { return impl_->last_backend; }
std::string Detector::last_gpu_error() const {
  const std::lock_guard lock(impl_->one_call);
  if (impl_->hybrid && !impl_->hybrid->last_error().empty()) return impl_->hybrid->last_error();
  return impl_->gpu ? impl_->gpu->last_error() : std::string();
}

}  // namespace hpccd
