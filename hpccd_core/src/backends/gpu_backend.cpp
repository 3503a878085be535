// SPDX-License-Identifier: Apache-2.0
#include "backends/gpu_backend.h"

#include <algorithm>

#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "scene/static_meshes.h"

namespace hpccd {
namespace {

Vec3<double> position(Positions p, std::uint32_t v) {
  const std::size_t i = 3 * std::size_t{v};
  if (p.is_double) {
    const auto* x = static_cast<const double*>(p.data) + i;
    return {x[0], x[1], x[2]};
  }
  const auto* x = static_cast<const float*>(p.data) + i;
  return {x[0], x[1], x[2]};
}

}  // namespace

std::string GpuBackend::unsupported(const Options& options) {
  if (options.minimum_separation > 0) return no_separation_on_gpus;
  if (options.method != Method::standard)
    return "method: the published methods run on CPUs; use backend=\"cpu\", or method=\"default\"";
  return "";
}

std::optional<Detection> GpuBackend::detect(Positions t0, Positions t1) {
  if (!t0.on_device && !t1.on_device) require_static_meshes_rest(*shared_.scene, t0, t1);
  try {
    Detection found{compute(t0, t1), Backend::gpu};
    failures_.succeeded();
    shared_.cancellation.heed();
    return found;
  } catch (const gpu::Error& e) {
    failures_.failed(e.what());
    has_tree_ = false;  // nothing on the device is relied on after a failure
    shared_.profiler.mark("gpu_failed");
    return std::nullopt;
  }
}

Contacts GpuBackend::compute(Positions t0, Positions t1) {
  const Options& o = shared_.options;
  Profiler& profiler = shared_.profiler;
  if (!pipeline_) {
    pipeline_ = gpu::Pipeline::create(*shared_.scene, shared_.features, o.accuracy, gpu::status().devices.at(0).number,
                                      o.gpu_stages);
    profiler.mark("gpu_start");
  }
  update_tree(t0, t1);
  if (!pipeline_->run(t0, t1, shared_.pool)) {
    MotionBounds().update(on_host(t0, 0), on_host(t1, 1), shared_.pool);  // throws, and names the coordinate
    throw gpu::Error("the device found bad coordinates where the host finds none");
  }
  profiler.mark("gpu");
  const bool outputs = o.points || o.normals || o.closest;
  const std::vector<Candidate>& undecided = pipeline_->undecided();
  if (!undecided.empty() || outputs) t0 = on_host(t0, 0), t1 = on_host(t1, 1);
  decide(undecided, t0, t1);
  profiler.mark("exact");
  const gpu::FrameResult device = pipeline_->finish();
  profiler.mark("gpu_sort");
  Contacts contacts = join(device, decided_, shared_.features, shared_.pool);
  reduce(contacts, o.report);
  if (outputs) {
    motion_.update(t0, t1, shared_.pool);
    add_points_and_normals(contacts, o, motion_, shared_.features, shared_.pool);
  }
  profiler.mark("contacts");
  return contacts;
}

// A new tree for the first step, and where refitting on the device has lost too much.
void GpuBackend::update_tree(Positions t0, Positions t1) {
  if (area_when_built_ == 0) area_when_built_ = pipeline_->relative_area();
  if (has_tree_ && !worn_out(pipeline_->relative_area(), area_when_built_)) return;
  shared_.tree.bound(on_host(t0, 0), on_host(t1, 1), {});
  shared_.tree.build_anew();
  pipeline_->set_tree(shared_.tree.tree());
  area_when_built_ = 0;  // known when the device has refitted it
  has_tree_ = true;
  shared_.profiler.mark("build");
}

// What neither the device nor its error bounds could decide.
void GpuBackend::decide(const std::vector<Candidate>& undecided, Positions t0, Positions t1) {
  const Features& features = shared_.features;
  std::vector<std::optional<double>> toc(undecided.size());
  constexpr std::size_t pairs_a_piece = 8;  // about 10 us, as long as it takes to wake a thread
  parallel_for(shared_.pool, undecided.size(), pairs_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const Candidate& u = undecided[i];
      std::uint32_t v[4];
      pair_vertices({nullptr, features.edges.data(), features.faces.data()}, u.kind, u.first, u.second, v);
      UndecidedPair pair{u.kind, {}, {}, 0};
      for (int k = 0; k < 4; ++k) pair.t0[k] = position(t0, v[k]), pair.t1[k] = position(t1, v[k]);
      FallbackCounts counts;
      toc[i] = decide_contact(Accuracy::exact, pair, counts);
    }
  });
  decided_.vertex_face.clear(), decided_.edge_edge.clear();
  for (std::size_t i = 0; i < undecided.size(); ++i) {
    if (!toc[i]) continue;
    auto& list = undecided[i].kind == Kind::vertex_face ? decided_.vertex_face : decided_.edge_edge;
    list.push_back({undecided[i].first, undecided[i].second, *toc[i]});
  }
  for (auto* list : {&decided_.vertex_face, &decided_.edge_edge}) std::sort(list->begin(), list->end(), before);
}

Positions GpuBackend::on_host(Positions p, int which) {
  if (!p.on_device) return p;
  if (!pipeline_) throw gpu::Error("positions on the device, but no device is in use");
  return pipeline_->download(p, which);
}

void GpuBackend::count(std::map<std::string, std::uint64_t>& stats) const {
  if (!pipeline_) return;
  stats.merge(pipeline_->stats());
  stats["gpu_exact_on_cpu"] = pipeline_->undecided().size();
}

void GpuBackend::add_stages(std::map<std::string, double>& stages) const {
  if (!pipeline_) return;
  for (const auto& [name, ms] : pipeline_->stages()) stages["gpu/" + name] = ms;
}

}  // namespace hpccd
