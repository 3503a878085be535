// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"
#include "base/profiler.h"
#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "contacts/canonical.h"
#include "paper/method.h"
#include "scene/features.h"
#include "traverse/traverse.h"

namespace hpccd {

struct Detector::Impl {
  Impl(std::shared_ptr<const Scene> s, Options o)
      : scene(std::move(s)), options(o), features(features_of(*scene)), rules(*scene, o.accuracy), pool(o.threads),
        workers(static_cast<std::size_t>(pool.size())) {
    options.simd = resolve(o.simd);
    options.threads = pool.size();
    for (int a = 0; a < 4; ++a) search.batch_test[a] = batch_test(options.simd, static_cast<Accuracy>(a));
    search.leaf_pairs = leaf_pairs(options.simd);
    search.report = o.report;
    search.limits = {o.minimum_separation, o.tolerance};
    if (o.minimum_separation > 0) search.batch_test[static_cast<int>(Accuracy::conservative)] = all_undecided;
    engine = paper::engine_of(options, {features, rules, pool});
  }

  std::shared_ptr<const Scene> scene;
  Options options;
  Features features;
  PairRules rules;
  ThreadPool pool;
  std::vector<Worker> workers;
  Search search;
  MotionBounds motion;
  Tree tree;
  std::unique_ptr<paper::MethodEngine> engine;  // of a published method; none for the default traversal
  Profiler profiler;
  std::map<std::string, std::uint64_t> stats;

  // A tree that fits the motion of this step: refitted, or built anew where refitting has lost too much.
  void update_tree() {
    // Traversal visits node pairs about in proportion to the nodes' area; half as much again costs more than a build.
    constexpr double worn_out = 1.5;
    if (tree.nodes.empty()) {
      build(tree, *scene, features, motion.boxes, pool);
      profiler.mark("build");
      return;
    }
    refit(tree, motion.boxes, pool);
    profiler.mark("refit");
    if (relative_area(tree) > worn_out * tree.area_when_built) {
      build(tree, *scene, features, motion.boxes, pool);
      profiler.mark("build");
    }
  }

  void find_contacts() {
    search.geometry = {motion.rows.data(), features.edges.data(), features.faces.data(), motion.map.scale};
    search.earliest = std::numeric_limits<double>::infinity();
    if (engine) {
      engine->update(motion.boxes, profiler);
      engine->traverse(motion.boxes, search, workers);
    } else {
      update_tree();
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
        stats[kind + "_rejected_coplanarity"] += c.coplanarity;
        stats[kind + "_rejected_projection"] += c.projection;
        stats[kind + "_rejected_roots"] += c.roots;
        stats[kind + "_proven_contacts"] += c.contacts;
        stats[kind + "_undecided"] += c.undecided;
      }
      bytes += sizeof(Worker) + w.bytes();
    }
    stats["node_pairs"] = node_pairs;
    stats["leaf_pairs"] = leaf_pairs;
    stats["vf_contacts"] = contacts.vf.size();
    stats["ee_contacts"] = contacts.ee.size();
    stats["triangles"] = features.n_faces();
    stats["bytes"] = bytes + motion.rows.capacity() * sizeof(VertexRow) + motion.boxes.capacity() * sizeof(Box) +
                     tree.bytes() + features.bytes() + (engine ? engine->bytes() : 0);
    if (engine) engine->count(stats);
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
  d.profiler.begin();
  d.motion.take(t0, t1, d.options.minimum_separation, d.pool);
  d.profiler.mark("bounds");
  d.find_contacts();
  Contacts contacts =
      collect_contacts(d.workers, d.search.geometry, d.options.report, {d.options.points, d.options.normals}, d.pool);
  d.profiler.mark("contacts");
  d.count(contacts);
  d.profiler.end();
  return contacts;
}

std::map<std::string, double> Detector::profile() const { return impl_->profiler.stages(); }
std::map<std::string, std::uint64_t> Detector::stats() const { return impl_->stats; }
const Options& Detector::options() const { return impl_->options; }

}  // namespace hpccd
