// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "base/profiler.h"
#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "contacts/canonical.h"
#include "gpu/frames.h"
#include "paper/method.h"
#include "scene/features.h"
#include "scene/static_meshes.h"
#include "traverse/traverse.h"

namespace hpccd {

struct Detector::Impl {
  Impl(std::shared_ptr<const Scene> s, Options o)
      : scene(std::move(s)),
        options(o),
        features(features_of(*scene)),
        rules(*scene, o.accuracy),
        pool(o.threads),
        workers(static_cast<std::size_t>(pool.size())) {
    options.simd = resolve(o.simd);
    options.threads = pool.size();
    for (int a = 0; a < 4; ++a) search.batch_test[a] = batch_test(options.simd, static_cast<Accuracy>(a));
    search.leaf_pairs = leaf_pairs(options.simd);
    search.report = o.report;
    search.limits = {o.minimum_separation, o.tolerance};
    if (o.minimum_separation > 0) search.batch_test[static_cast<int>(Accuracy::conservative)] = all_undecided;
    engine = paper::engine_of(options, {features, rules, pool});
    const bool wanted = o.backend == Backend::gpu || o.backend == Backend::automatic;
    if (const std::string why = gpu::unsupported(o); o.backend == Backend::gpu && !why.empty())
      throw InvalidArgument(why);
    if (wanted && gpu::unsupported(o).empty() && !gpu::status().devices.empty())
      gpu = std::make_unique<gpu::Frames>(*scene, features, options, pool);
    else if (o.backend == Backend::gpu)
      throw InvalidArgument("backend: \"gpu\" is not usable here: " + gpu::status().reason);
  }

  std::shared_ptr<const Scene> scene;
  Options options;
  Features features;
  PairRules rules;
  ThreadPool pool;
  std::vector<Worker> workers;
  Search search;
  ContactOrder order;
  MotionBounds motion;
  Tree tree;
  bool tree_fits_motion = false;                // its bounds are those of the last motion taken
  std::unique_ptr<paper::MethodEngine> engine;  // of a published method; none for the default traversal
  std::unique_ptr<gpu::Frames> gpu;             // where the backend is "gpu", or may become it
  // "auto": the first frames go to both in turn, the rest to the faster. The first of each warms up.
  struct Trial {
    int frames = 0;
    double best_ms = std::numeric_limits<double>::infinity();
  } trial[2];  // CPU, GPU
  bool last_on_gpu = false;
  Profiler profiler;
  std::map<std::string, std::uint64_t> stats;

  bool next_on_gpu(bool given_on_device) const {
    constexpr int frames_each = 3;
    if (!gpu || gpu->gave_up()) return false;
    if (options.backend == Backend::gpu || given_on_device) return true;
    if (trial[1].frames < frames_each) return trial[1].frames < trial[0].frames;
    return trial[1].best_ms < trial[0].best_ms;
  }

  void note_time(bool on_gpu) {
    last_on_gpu = on_gpu;
    ++trial[on_gpu].frames;
    trial[on_gpu].best_ms = std::min(trial[on_gpu].best_ms, profiler.stages().at("total"));
  }

  std::optional<Contacts> frame_on_gpu(Positions t0, Positions t1) {
    const auto build_tree = [this](Positions a, Positions b) -> const Tree& {
      tree_fits_motion = false;
      motion.take(*scene, a, b, 0, pool);
      build(tree, *scene, features, motion.boxes, pool);
      tree_fits_motion = true;
      return tree;
    };
    return gpu->detect(t0, t1, build_tree, profiler);
  }

  void count_gpu(const Contacts& contacts) {
    stats = gpu->stats();
    stats["vf_contacts"] = contacts.vf.size();
    stats["ee_contacts"] = contacts.ee.size();
    stats["triangles"] = features.n_faces();
    stats["bytes"] = motion.bytes() + tree.bytes() + features.bytes();
  }

  // A tree that fits the motion of this step: refitted, or built anew where refitting has lost too much.
  void update_tree(bool tree_followed) {
    // Traversal visits node pairs about in proportion to the nodes' area; half as much again costs more than a build.
    constexpr double worn_out = 1.5;
    if (tree.nodes.empty()) {
      build(tree, *scene, features, motion.boxes, pool);
      profiler.mark("build");
      return;
    }
    refit(tree, motion.boxes, tree_followed ? motion.resting : std::vector<char>(), pool);
    profiler.mark("refit");
    if (relative_area(tree, pool) > worn_out * tree.area_when_built) {
      build(tree, *scene, features, motion.boxes, pool);
      profiler.mark("build");
    }
  }

  void find_contacts(Positions t0, Positions t1) {
    const bool tree_followed = std::exchange(tree_fits_motion, false);
    motion.take(*scene, t0, t1, options.minimum_separation, pool);
    profiler.mark("bounds");
    search.geometry = {motion.rows.data(), features.edges.data(), features.faces.data(),
                       options.minimum_separation > 0 ? nullptr : motion.slabs.data(), motion.map.scale};
    search.earliest = std::numeric_limits<double>::infinity();
    if (engine) {
      engine->update(motion.boxes, profiler);
      engine->traverse(motion.boxes, search, workers);
    } else {
      update_tree(tree_followed);
      tree_fits_motion = true;
      traverse(tree, rules, search, pool, workers);
    }
    double elementary = 0;
    for (const Worker& w : workers) elementary += 1e3 * w.elementary_seconds;
    // Tests run inside the traversal; their share of the wall-clock time is their share of the threads' time.
    profiler.mark_split("traverse", "elementary", elementary / pool.size());
  }

  void count(const Contacts& contacts) {
    stats.clear();
    std::uint64_t node_pairs = 0, leaf_pairs = 0, bytes = 0;
    const char* kinds[2] = {"vf", "ee"};
    for (const Worker& w : workers) {
      node_pairs += w.node_pairs;
      leaf_pairs += w.leaf_pairs;
      for (int k = 0; k < 2; ++k) {
        const std::string kind = kinds[k];
        const BatchCounts& c = w.counts[k];
        stats[kind + "_candidates"] += c.tested;
        stats[kind + "_rejected_slabs"] += c.slabs;
        stats[kind + "_rejected_coplanarity"] += c.coplanarity;
        stats[kind + "_rejected_projection"] += c.projection;
        stats[kind + "_rejected_roots"] += c.roots;
        stats[kind + "_proven_contacts"] += c.contacts;
        stats[kind + "_undecided"] += c.undecided;
      }
      bytes += sizeof(Worker) + w.bytes();
    }
    bytes += order.bytes();
    stats["node_pairs"] = node_pairs;
    stats["leaf_pairs"] = leaf_pairs;
    stats["vf_contacts"] = contacts.vf.size();
    stats["ee_contacts"] = contacts.ee.size();
    stats["triangles"] = features.n_faces();
    stats["bytes"] = bytes + motion.bytes() + tree.bytes() + features.bytes() + (engine ? engine->bytes() : 0);
    if (engine) engine->count(stats);
    if (gpu) stats["gpu_fallbacks"] = gpu->fallbacks();
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
  d.profiler.begin();
  if (d.next_on_gpu(t0.on_device || t1.on_device)) {
    if (!t0.on_device && !t1.on_device) require_static_meshes_rest(*d.scene, t0, t1);
    if (auto contacts = d.frame_on_gpu(t0, t1)) {
      d.count_gpu(*contacts);
      d.profiler.end();
      d.note_time(true);
      return std::move(*contacts);
    }
    d.profiler.mark("gpu_failed");
  }
  if (d.gpu) t0 = d.gpu->on_host(t0, 0), t1 = d.gpu->on_host(t1, 1);
  d.find_contacts(t0, t1);
  Contacts contacts = collect_contacts(d.workers, d.search.geometry, d.options.report,
                                       {d.options.points, d.options.normals}, d.order, d.pool);
  d.profiler.mark("contacts");
  d.count(contacts);
  d.profiler.end();
  d.note_time(false);
  return contacts;
}

std::map<std::string, double> Detector::profile() const {
  auto stages = impl_->profiler.stages();
  if (impl_->gpu && impl_->last_on_gpu)
    for (const auto& [name, ms] : impl_->gpu->stages()) stages["gpu/" + name] = ms;
  return stages;
}
std::map<std::string, std::uint64_t> Detector::stats() const { return impl_->stats; }
const Options& Detector::options() const { return impl_->options; }
Backend Detector::last_backend() const { return impl_->last_on_gpu ? Backend::gpu : Backend::cpu; }
std::string Detector::last_gpu_error() const { return impl_->gpu ? impl_->gpu->last_error() : std::string(); }

}  // namespace hpccd
