// SPDX-License-Identifier: Apache-2.0
// Checks the inputs, selects the backend, and falls back to the CPU if that backend fails.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "backends/available.h"
#include "backends/tuner.h"
#include "backends/world_positions.h"
#include "base/coordinate_limits.h"
#include "base/length.h"
#include "base/one_call.h"
#include "base/standard_arithmetic.h"
#include "bvh/bad_coordinate.h"
#include "checked.h"
#include "contacts/intersections.h"
#include "contacts/outputs.h"
#include "contacts/points.h"
#include "gpu/results_to_device.h"
#include "prepared_impl.h"
#include "scene/mesh_poses.h"
#include "solid/closed.h"

namespace hpccd {
namespace {

// The communication thread of the hybrid spins: on a core that the pool uses it would delay one thread, for which all
// others then wait (a quarter of a frame of 1 ms).
int pool_threads(const Options& o) {
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  if (o.backend != Backend::hybrid || cores < 2 || (o.threads > 0 && o.threads < cores)) return o.threads;
  return o.threads > cores ? o.threads : cores - 1;
}

using Counts = std::map<std::string, std::uint64_t>;

}  // namespace

struct Detector::Impl {
  Impl(std::shared_ptr<const Scene> scene, const Options& options)
      : common(checked(std::move(scene), options), options, pool_threads(options)),
        engine(std::make_unique<Engine>(common)),
        takes_device_arrays(engine->backends.take_device_arrays()) {}

  std::shared_ptr<Impl> left_alone;  // itself, if no thread may touch it any more

  // All state that is kept from call to call.
  struct Engine {
    explicit Engine(Common& common) : shared(common, common.pool), backends(shared) {}
    Resources shared;
    AvailableBackends backends;
  };

  // State that a call changes is protected by its turn, except these two:
  std::atomic<Backend> last_backend{Backend::cpu};
  Cancellation& cancellation() { return common.cancellation; }

  mutable OneCall one_call;
  Common common;
  std::unique_ptr<Engine> engine;  // empty after a call that ended unexpectedly, for example without memory
  const bool takes_device_arrays;
  Tuner tuner;
  std::optional<FaceAdjacency> adjacency;  // made when directions are first computed
  // Results of the last call. Its other counts are collected when they are requested.
  std::optional<Counts> found;
  Backend asked = Backend::cpu;  // which may have left the rest to the CPU

  const Options& options() const { return common.options; }
  AvailableBackends& backends() { return engine->backends; }
  Profiler& profiler() { return engine->shared.profiler; }

  // One call, from its turn to its end. An unexpected exception may leave the kept state incomplete: then the next call
  // starts from scratch.
  template <class Answer>
  auto call(Answer&& answer) {
    common.pool.require_threads();
    const std::lock_guard turn(one_call);
    cancellation().heed();
    found.reset();
    try {
      common.settle();
      if (!engine) engine = std::make_unique<Engine>(common);
      std::optional<gpu::CallersDevice> callers;
      if (backends().use_devices()) callers.emplace();
      profiler().begin();
      return answer();
    } catch (const InvalidArgument&) {
      throw;
    } catch (const Cancelled&) {
      throw;
    } catch (const gpu::Error&) {
      throw;
    } catch (...) {
      engine.reset();
      throw;
    }
  }

  void check(const char* name, Positions vertices) const {
    const std::size_t n = common.features.n_vertices, worlds = options().worlds;
    if (vertices.n != n * worlds)
      throw InvalidArgument(std::string(name) + ": the scene has " + std::to_string(n) + " vertices" +
                            (worlds > 1 ? " in each of " + std::to_string(worlds) + " worlds" : "") + ", but " +
                            std::to_string(vertices.n) + " were given; give those of all meshes, in the order added");
    check_memory(name, vertices);
    if (vertices.on_device && !takes_device_arrays)
      throw InvalidArgument(std::string(name) +
                            ": is in a GPU's memory, which this detector does not use; copy it to the host, or choose "
                            "the GPU as backend");
  }

  void check(Positions t0, Positions t1) const {
    check("vertices_t0", t0), check("vertices_t1", t1);
    if (t0.is_double != t1.is_double)
      throw InvalidArgument("vertices_t0, vertices_t1: must both be float32 or both be float64; convert one of them");
  }

  // Two meshes with faces, in one world.
  void check_solids(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    const auto& meshes = common.scene->meshes();
    if (options().worlds > 1)
      throw InvalidArgument("worlds: this query takes one world; ask a detector without worlds for each of them");
    if (mesh_a >= meshes.size() || mesh_b >= meshes.size())
      throw InvalidArgument("mesh_a, mesh_b: the scene has " + std::to_string(meshes.size()) +
                            " meshes; give the numbers that Scene::add_mesh() returned");
    if (mesh_a == mesh_b) throw InvalidArgument("mesh_a, mesh_b: are the same mesh; give two");
    for (const std::uint32_t mesh : {mesh_a, mesh_b})
      if (meshes[mesh].n_faces == 0)
        throw InvalidArgument(std::string(mesh == mesh_a ? "mesh_a" : "mesh_b") + ": '" + meshes[mesh].name +
                              "' has no faces; give a mesh with faces");
  }

  // Throws if results are on the device, where the host cannot read them.
  void require_results_on_host(const char* remedy) const {
    if (options().results_on_device)
      throw InvalidArgument("results_on_device: this detector leaves its results on the device; call " +
                            std::string(remedy) + "(), or make a detector without results_on_device");
  }

  // Throws unless the points can be located with respect to the mesh.
  void check_points(Positions points, std::uint32_t mesh) {
    check_memory("points", points);
    if (points.on_device && !takes_device_arrays)
      throw InvalidArgument(
          "points: are in a GPU's memory, which this detector does not use; copy them to the host, or choose the GPU "
          "as backend");
    if (points.n % options().worlds != 0)
      throw InvalidArgument("points: each of the " + std::to_string(options().worlds) +
                            " worlds must have the same number, but " + std::to_string(points.n) + " were given");
    require_closed("mesh", mesh);
  }

  void require_closed(const char* name, std::uint32_t mesh) {
    const std::vector<Scene::Mesh>& meshes = common.scene->meshes();
    if (mesh >= meshes.size())
      throw InvalidArgument(std::string(name) + ": the scene has no mesh " + std::to_string(mesh) + "; it has " +
                            std::to_string(meshes.size()) + ", counted from 0");
    const Scene::Mesh& m = meshes[mesh];
    const std::string subject = std::string(name) + ": '" + m.name + "' ";
    const auto faces = std::span(common.scene->faces()).subspan(m.first_face, m.n_faces);
    const auto has_three = [](const auto& f) { return f[0] != f[1] && f[1] != f[2] && f[2] != f[0]; };
    const auto& open = open_edge_of(mesh);
    if (!open && std::ranges::any_of(faces, has_three)) return;
    if (!open)
      throw InvalidArgument(subject + "has no faces with three vertices, and so no inside; give a closed mesh");
    const auto [u, v] = *open;
    std::vector<std::string> around;  // faces at the edge
    for (std::uint32_t i = 0; i < m.n_faces; ++i)
      if (has_three(faces[i]) && std::ranges::count(faces[i], u) && std::ranges::count(faces[i], v))
        around.push_back(std::to_string(i));
    const std::string at = "is not closed: the edge between its vertices " + std::to_string(u - m.first_vertex) +
                           " and " + std::to_string(v - m.first_vertex) + " is ";
    if (around.size() == 1)
      throw InvalidArgument(subject + at + "in one face; fill the hole, or merge vertices at the same position");
    if (around.size() == 2)
      throw InvalidArgument(subject + at + "in the faces " + around[0] + " and " + around[1] +
                            ", which are oriented differently; reverse one of them");
    throw InvalidArgument(subject + at + "in " + std::to_string(around.size()) + " faces; leave two of them");
  }

  // Found once for each mesh.
  const std::optional<std::array<std::uint32_t, 2>>& open_edge_of(std::uint32_t mesh) {
    const std::lock_guard lock(open_edges_lock);
    if (const auto known = open_edges.find(mesh); known != open_edges.end()) return known->second;
    const Scene::Mesh& m = common.scene->meshes()[mesh];
    return open_edges[mesh] =
               open_edge(std::span(common.scene->faces()).subspan(m.first_face, m.n_faces), cancellation());
  }
  std::mutex open_edges_lock;
  std::map<std::uint32_t, std::optional<std::array<std::uint32_t, 2>>> open_edges;

  Backend pick(bool given_on_device) {
    const Backend wanted = options().backend;
    if (backends().works(Backend::gpu) && given_on_device) return Backend::gpu;
    if (wanted != Backend::automatic) return backends().works(wanted) ? wanted : Backend::cpu;
    std::vector<Backend> usable;
    for (const Backend b : {Backend::cpu, Backend::gpu, Backend::hybrid})
      if (backends().works(b) && !(b == Backend::hybrid && common.rules.any_fast())) usable.push_back(b);
    return tuner.next(usable);
  }

  // Whether results may be returned in the memory that a GPU has written.
  bool gives_in_place(Backend picked) const {
    const Options& o = options();
    return picked == Backend::gpu && o.worlds == 1 && !Outputs::of_contacts(o).any() && !common.planes.any() &&
           !with_points();
  }

  Detection compute(Backend picked, Positions t0, Positions t1) {
    for (const Backend b : {picked, Backend::cpu}) {
      if (b != Backend::gpu) t0 = backends().on_host(t0, 0), t1 = backends().on_host(t1, 1);
      asked = b;
      if (auto detection = backends().at(b).detect(t0, t1)) return std::move(*detection);
    }
    throw std::logic_error("the CPU has left a step to others");
  }

  template <bool may_be_in_place>
  Detected detect(Positions t0, Positions t1) {
    require_results_on_host("detect_on_device");
    check(t0, t1);
    return call([&]() -> Detected {
      const Backend picked = pick(t0.on_device || t1.on_device);
      const bool in_place = may_be_in_place && gives_in_place(picked);
      if (in_place) {
        asked = picked;
        if (auto d = backends().gpu().detect_in_place(t0, t1)) {
          note(picked, picked, d->in_place ? d->in_place->n_vf : d->contacts.vf.size(),
               d->in_place ? d->in_place->n_ee : d->contacts.ee.size());
          return std::move(*d);
        }
      }
      Detection d = compute(in_place ? Backend::cpu : picked, t0, t1);
      Counts of_planes = with_planes([&](const Planes& planes) {
        const Options& o = options();
        return Counts{
            {"vp_contacts", planes.add_contacts(d.contacts, backends().on_host(t0, 0), backends().on_host(t1, 1),
                                                o.report, Outputs::of_contacts(o), common.pool)}};
      });
      if (with_points()) {
        split_points(d.contacts);
        of_planes["vv_contacts"] = d.contacts.vv.size(), of_planes["ve_contacts"] = d.contacts.ve.size();
      }
      note(picked, d.computed_by, d.contacts.vf.size(), d.contacts.ee.size());
      found->merge(of_planes);
      return {std::nullopt, std::move(d.contacts)};
    });
  }

  bool with_points() const { return !common.features.edge_kinds.empty(); }

  // After a query without them: the planes of the scene, if there are any.
  template <class Query>
  Counts with_planes(Query&& query) {
    if (!common.planes.any()) return {};
    Counts counts = query(std::as_const(common.planes));
    profiler().mark("planes");
    return counts;
  }

  // A query of a motion, or of a snapshot given twice: on the selected backend if it supports the query and works,
  // otherwise on the CPU.
  template <class Query>
  auto ask(Positions t0, Positions t1, Query&& query) {
    return call([&] {
      Counts counts;
      for (const Backend b : {backends().works(Backend::gpu) ? Backend::gpu : Backend::cpu, Backend::cpu}) {
        if (b != Backend::gpu) t0 = backends().on_host(t0, 0), t1 = backends().on_host(t1, 1);
        if (auto answer = query(backends().at(b), t0, t1, counts)) {
          profiler().end();
          last_backend = asked = b;
          found = counts;
          return std::move(*answer);
        }
      }
      throw std::logic_error("the CPU has left a query to others");
    });
  }

  // For results on the device. at_once(backend) computes them there and returns nothing if it failed; then the CPU
  // computes them and they are copied.
  template <class AtOnce, class OnHost, class Count>
  DeviceResults on_device(Positions t0, Positions t1, AtOnce&& at_once, OnHost&& on_host, Count&& count) {
    if (!options().results_on_device)
      throw InvalidArgument(
          "results_on_device: this detector brings its results to the host; set the option, or call the query without "
          "_on_device");
    return call([&] {
      std::optional<DeviceResults> results;
      if (backends().works(Backend::gpu)) results = at_once(backends().gpu());
      last_backend = asked = results ? Backend::gpu : Backend::cpu;
      if (!results) {
        t0 = backends().on_host(t0, 0), t1 = backends().on_host(t1, 1);
        results = gpu::to_device(on_host(backends().at(Backend::cpu), t0, t1), gpu::status().devices.at(0).number);
      }
      profiler().end();
      found = count(*results);
      return *results;
    });
  }

  template <class Query>
  auto snapshot(Positions vertices, Query&& query) {
    check("vertices", vertices);
    return ask(vertices, vertices, [&](DetectionBackend& backend, Positions v, Positions, Counts& counts) {
      return query(backend, v, counts);
    });
  }

  // vertices: Positions on the host, or a PositionOf.
  void add_places(Intersections& hits, const auto& vertices) {
    const Options& o = options();
    if (!o.points && !o.directions) return;
    const Features& features = common.features;
    if (o.directions && !adjacency) adjacency.emplace(features.faces, features.n_vertices);
    hpccd::add_places(hits, features, vertices, adjacency ? &*adjacency : nullptr, common.pool);
  }

  // Points are edges in a search.
  void split_points_of(Contacts& near, Counts& counts) {
    if (with_points()) {
      split_points(near);
      counts["vv_near"] = near.vv.size(), counts["ve_near"] = near.ve.size();
    }
    counts["vf_near"] = near.vf.size(), counts["ee_near"] = near.ee.size();
  }

  // Meshes at poses.

  std::vector<rigid::Pose> checked_poses(std::span<const Pose> poses, Positions others) const {
    std::size_t n = 0;
    for (const Scene::Mesh& mesh : common.scene->meshes())
      if (!mesh.shape) n += mesh.n_vertices;
    if (others.n != n * options().worlds)
      throw InvalidArgument(
          "vertices: the meshes without a shape have " + std::to_string(n) + " vertices" +
          (options().worlds > 1 ? " in each of " + std::to_string(options().worlds) + " worlds" : "") + ", but " +
          std::to_string(others.n) +
          " were given; with poses, give those of the meshes without a shape only, in the order "
          "added");
    check_memory("vertices", others);
    if (others.on_device)
      throw InvalidArgument(
          "vertices: are in a GPU's memory; copy them to the host, or give the positions of all "
          "meshes without poses");
    return poses_of_meshes(*common.scene, poses, options().worlds);
  }

  std::vector<double> positions_at(std::span<const rigid::Pose> poses, Positions others) {
    return call([&] {
      std::vector<double> all = place_meshes(*common.scene, poses, others, options().worlds, common.pool);
      profiler().end();
      return all;
    });
  }

  bool all_have_shapes() const {
    return std::ranges::all_of(common.scene->meshes(),
                               [](const Scene::Mesh& mesh) { return mesh.shape || mesh.n_vertices == 0; });
  }

  // placed(cpu, counts): the query of meshes that are placed, by the CPU unless it changes last_backend.
  // given(positions): that of their positions.
  template <class Placed, class Given>
  auto at_poses(std::span<const Pose> poses, Positions others, Placed&& placed, Given&& given) {
    const std::vector<rigid::Pose> of_meshes = checked_poses(poses, others);
    using Answer = decltype(given(others));
    if (options().worlds == 1 && !common.planes.any() && all_have_shapes()) {
      std::optional<Answer> answer = call([&]() -> std::optional<Answer> {
        CpuBackend& cpu = backends().cpu();
        if (!cpu.place(of_meshes)) return std::nullopt;
        Counts counts;
        last_backend = Backend::cpu;
        std::optional<Answer> a = placed(cpu, counts);
        profiler().end();
        asked = last_backend;
        found = counts;
        return a;
      });
      if (answer) return std::move(*answer);
    }
    const std::vector<double> positions = positions_at(of_meshes, others);
    return given(Positions::of(positions));
  }

  void note(Backend picked, Backend computed_by, std::uint64_t n_vf, std::uint64_t n_ee) {
    found = {{"vf_contacts", n_vf}, {"ee_contacts", n_ee}};
    profiler().end();
    last_backend = computed_by;
    if (picked == computed_by)
      tuner.took(picked, profiler().stages().at("total"));
    else
      tuner.failed(picked);
  }
};

Detector::Detector(std::shared_ptr<const Scene> scene, Options options)
    : impl_([&] {
        const StandardArithmetic arithmetic;
        return std::make_shared<Impl>(std::move(scene), options);
      }()) {}

// In a child made by fork(), the memory of a call that was running is inconsistent: it is not freed.
Detector::~Detector() {
  if (impl_->one_call.abandoned()) impl_->left_alone = impl_;
}

Contacts Detector::detect(Positions t0, Positions t1) {
  const StandardArithmetic arithmetic;
  return impl_->detect<false>(t0, t1).contacts;
}

Detected Detector::detect_in_place(Positions t0, Positions t1) {
  const StandardArithmetic arithmetic;
  return impl_->detect<true>(t0, t1);
}

DeviceResults Detector::detect_on_device(Positions t0, Positions t1) {
  const StandardArithmetic arithmetic;
  impl_->check(t0, t1);
  return impl_->on_device(
      t0, t1, [&](GpuBackend& gpu) { return gpu.detect_on_device(t0, t1); },
      [](DetectionBackend& cpu, Positions a, Positions b) { return cpu.detect(a, b).value().contacts; },
      [](const DeviceResults& r) { return Counts{{"vf_contacts", r.n_vf}, {"ee_contacts", r.n_ee}}; });
}

double Detector::collision_free_step(Positions t0, Positions t1) {
  const StandardArithmetic arithmetic;
  return std::ranges::min(collision_free_steps(t0, t1));
}

std::vector<double> Detector::collision_free_steps(Positions t0, Positions t1) {
  const StandardArithmetic arithmetic;
  impl_->check(t0, t1);
  std::vector<double> first = impl_->ask(t0, t1, [&](DetectionBackend& backend, Positions a, Positions b, Counts&) {
    auto times = backend.earliest(a, b);
    if (times)
      impl_->with_planes([&](const Planes& planes) {
        AvailableBackends& all = impl_->backends();
        planes.limit_steps(*times, all.on_host(a, 0), all.on_host(b, 1), impl_->common.pool);
        return Counts{};
      });
    return times;
  });
  // A whole step would end in contact if one comes at its end.
  constexpr double just_before_the_end = 1 - 0x1p-53;
  for (double& time : first) time = time > 1 ? 1 : std::min(time, just_before_the_end);
  return first;
}

CollisionFreeMotion Detector::collision_free_motion(Positions t0, Positions t1, std::span<const std::int64_t> groups) {
  const StandardArithmetic arithmetic;
  impl_->check(t0, t1);
  const std::size_t n = impl_->common.features.n_vertices;
  if (!groups.empty() && groups.size() != n)
    throw InvalidArgument("groups: expected a number for each of the " + std::to_string(n) + " vertices, got " +
                          std::to_string(groups.size()));
  if (std::ranges::any_of(groups, [](std::int64_t group) { return group < -1; }))
    throw InvalidArgument("groups: must be -1, for a vertex on its own, or a number from 0");
  return impl_->ask(t0, t1, [&](DetectionBackend& backend, Positions a, Positions b, Counts&) {
    return backend.free_motion(a, b, groups);
  });
}

namespace {

Proximity as_proximity(Contacts&& c) {
  return {std::move(c.vf),      std::move(c.vf_toc),  std::move(c.ee),       std::move(c.ee_toc),  std::move(c.vp),
          std::move(c.vp_toc),  std::move(c.vv),      std::move(c.vv_toc),   std::move(c.ve),      std::move(c.ve_toc),
          std::move(c.closest), std::move(c.normals), std::move(c.vertices), std::move(c.weights), c.hash,
          std::move(c.slices)};
}

}  // namespace

Proximity Detector::proximity(Positions vertices, double distance) {
  const StandardArithmetic arithmetic;
  impl_->require_results_on_host("proximity_on_device");
  check_length("distance", distance);
  return as_proximity(impl_->snapshot(vertices, [&](DetectionBackend& backend, Positions v, Counts& found) {
    auto near = backend.proximity(v, distance);
    if (!near) return near;
    found = impl_->with_planes([&](const Planes& planes) {
      const Positions on_host = impl_->backends().on_host(v, 0);
      return Counts{{"vp_near", planes.add_near(*near, on_host, distance, Outputs::of_proximity(impl_->options()),
                                                impl_->common.pool)}};
    });
    impl_->split_points_of(*near, found);
    return near;
  }));
}

Intersections Detector::intersections(Positions vertices) {
  const StandardArithmetic arithmetic;
  impl_->require_results_on_host("intersections_on_device");
  return impl_->snapshot(vertices, [&](DetectionBackend& backend, Positions v, Counts& found) {
    auto hits = backend.intersections(v);
    if (!hits) return hits;
    found = {{"ef_intersections", hits->ef.size()}};
    impl_->add_places(*hits, impl_->backends().on_host(v, 0));
    return hits;
  });
}

WindingNumbers Detector::winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) {
  const StandardArithmetic arithmetic;
  impl_->check("vertices", vertices);
  impl_->check_points(points, mesh);
  return impl_->ask(vertices, points, [&](DetectionBackend& backend, Positions v, Positions p, Counts&) {
    return backend.winding_numbers(v, p, mesh);
  });
}

SignedDistances Detector::signed_distances(Positions vertices, Positions points, std::uint32_t mesh) {
  const StandardArithmetic arithmetic;
  impl_->check("vertices", vertices);
  impl_->check_points(points, mesh);
  return impl_->ask(vertices, points, [&](DetectionBackend& backend, Positions v, Positions p, Counts&) {
    return backend.signed_distances(v, p, mesh);
  });
}

DeviceResults Detector::proximity_on_device(Positions vertices, double distance) {
  const StandardArithmetic arithmetic;
  check_length("distance", distance);
  impl_->check("vertices", vertices);
  return impl_->on_device(
      vertices, vertices, [&](GpuBackend& gpu) { return gpu.proximity_on_device(vertices, distance); },
      [&](DetectionBackend& cpu, Positions v, Positions) { return as_proximity(cpu.proximity(v, distance).value()); },
      [](const DeviceResults& r) { return Counts{{"vf_near", r.n_vf}, {"ee_near", r.n_ee}}; });
}

std::unique_ptr<PreparedDetection> Detector::prepare(Positions t0, Positions t1, double room) {
  const StandardArithmetic arithmetic;
  if (!options().results_on_device)
    throw InvalidArgument("results_on_device: this detector brings its results to the host; set the option");
  if (!(room >= 1 && room <= 1000))
    throw InvalidArgument("room: how many times what this motion takes, 1 to 1000, got " + std::to_string(room));
  if (!t0.on_device || !t1.on_device)
    throw InvalidArgument("vertices_t0, vertices_t1: must be in the memory of the GPU, where they are read each time");
  impl_->check(t0, t1);
  auto prepared = std::make_unique<PreparedDetection::Impl>();
  impl_->call([&] {
    AvailableBackends& backends = impl_->backends();
    if (!backends.works(Backend::gpu))
      throw gpu::Error("the GPU was given up after failures: " + backends.last_error());
    GpuBackend::Prepared p = backends.gpu().prepare(t0, t1, room);
    impl_->profiler().end();
    prepared->detector = impl_, prepared->pipeline = std::move(p.pipeline), prepared->results = std::move(p.results);
  });
  return std::unique_ptr<PreparedDetection>(new PreparedDetection(std::move(prepared)));
}

DeviceResults Detector::intersections_on_device(Positions vertices) {
  const StandardArithmetic arithmetic;
  impl_->check("vertices", vertices);
  return impl_->on_device(
      vertices, vertices, [&](GpuBackend& gpu) { return gpu.intersections_on_device(vertices); },
      [](DetectionBackend& cpu, Positions v, Positions) { return cpu.intersections(v).value(); },
      [](const DeviceResults& r) { return Counts{{"ef_intersections", r.n_ef}}; });
}

std::vector<Gap> Detector::distances(Positions vertices) {
  const StandardArithmetic arithmetic;
  return impl_->snapshot(vertices, [&](DetectionBackend& backend, Positions v, Counts& found) {
    auto gaps = backend.distances(v);
    if (!gaps) return gaps;
    impl_->with_planes([&](const Planes& planes) {
      planes.add_gaps(*gaps, impl_->backends().on_host(v, 0), impl_->options().worlds, impl_->common.pool);
      return Counts{};
    });
    found = {{"gaps", gaps->size()}};
    return gaps;
  });
}

Proximity Detector::proximity_at(std::span<const Pose> poses, double distance, Positions others) {
  const StandardArithmetic arithmetic;
  impl_->require_results_on_host("proximity_on_device");
  check_length("distance", distance);
  return impl_->at_poses(
      poses, others,
      [&](CpuBackend& cpu, Counts& counts) {
        Contacts near = cpu.proximity_at_poses(distance);
        impl_->split_points_of(near, counts);
        return as_proximity(std::move(near));
      },
      [&](Positions vertices) { return proximity(vertices, distance); });
}

Intersections Detector::intersections_at(std::span<const Pose> poses, Positions others) {
  const StandardArithmetic arithmetic;
  impl_->require_results_on_host("intersections_on_device");
  return impl_->at_poses(
      poses, others,
      [&](CpuBackend& cpu, Counts& counts) {
        Intersections hits = cpu.intersections_at_poses();
        counts = {{"ef_intersections", hits.ef.size()}};
        impl_->add_places(hits, PositionOf([&](std::uint32_t vertex) { return cpu.position_at_poses(vertex); }));
        return hits;
      },
      [&](Positions vertices) { return intersections(vertices); });
}

std::vector<Gap> Detector::distances_at(std::span<const Pose> poses, Positions others) {
  const StandardArithmetic arithmetic;
  return impl_->at_poses(
      poses, others,
      [&](CpuBackend& cpu, Counts& counts) {
        std::optional<std::vector<Gap>> gaps;
        // Not with `auto`: a CPU searches small meshes in less time than a device takes to start.
        if (impl_->options().backend == Backend::gpu && impl_->backends().works(Backend::gpu))
          gaps = impl_->backends().gpu().distances_at_poses(cpu.placed_meshes());
        if (gaps)
          impl_->last_backend = Backend::gpu;
        else
          gaps = cpu.distances_at_poses();
        counts = {{"gaps", gaps->size()}};
        return std::move(*gaps);
      },
      [&](Positions vertices) { return distances(vertices); });
}

std::vector<double> Detector::positions_at(std::span<const Pose> poses, Positions others) {
  const StandardArithmetic arithmetic;
  std::vector<double> all = impl_->positions_at(impl_->checked_poses(poses, others), others);
  const auto bad = std::ranges::find_if(all, [](double x) { return !acceptable(x, largest_in_snapshot); });
  if (bad == all.end()) return all;
  // The same error as that of a query of these positions.
  const std::size_t rows = all.size() / 3 / impl_->options().worlds;
  const std::size_t world = static_cast<std::size_t>(bad - all.begin()) / (3 * rows);
  try {
    report_bad("vertices", all.data() + 3 * rows * world, rows, largest_in_snapshot);
  } catch (const InvalidArgument& error) {
    if (impl_->options().worlds == 1) throw;
    throw InvalidArgument(with_world(error.what(), world));
  }
}

double Detector::separating_translation(Positions vertices, std::uint32_t mesh_a, std::uint32_t mesh_b,
                                        const std::array<double, 3>& direction) {
  const StandardArithmetic arithmetic;
  impl_->check_solids(mesh_a, mesh_b);
  const Vec3<double> d{direction[0], direction[1], direction[2]};
  if (!std::ranges::all_of(direction, [](double x) { return std::isfinite(x); }) || max_norm(d) == 0)
    throw InvalidArgument("direction: must be finite and not zero");
  return impl_->snapshot(vertices, [&](DetectionBackend& backend, Positions v, Counts&) {
    return backend.separating_translation(v, {mesh_a, mesh_b}, d);
  });
}

Penetration Detector::penetration(Positions vertices, std::uint32_t mesh_a, std::uint32_t mesh_b,
                                  const std::optional<std::array<double, 3>>& start) {
  const StandardArithmetic arithmetic;
  impl_->check_solids(mesh_a, mesh_b);
  if (start && !std::ranges::all_of(*start, [](double x) { return std::isfinite(x); }))
    throw InvalidArgument("start: must be finite; give the translation of the previous result");
  std::optional<Vec3<double>> from;
  if (start) from = {(*start)[0], (*start)[1], (*start)[2]};
  return impl_->snapshot(vertices, [&](DetectionBackend& backend, Positions v, Counts&) {
    return backend.penetration(v, {mesh_a, mesh_b}, from);
  });
}

void Detector::set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation) {
  const StandardArithmetic arithmetic;
  const std::size_t n = impl_->common.scene->meshes().size();
  if (mesh_a >= n || mesh_b >= n)
    throw InvalidArgument("mesh_a, mesh_b: the scene has " + std::to_string(n) +
                          " meshes; give the numbers that Scene::add_mesh() returned");
  check_length("separation", separation);
  const std::lock_guard lock(impl_->one_call);
  if (separation != impl_->common.separations.of(mesh_a, mesh_b))
    impl_->common.separations.set(mesh_a, mesh_b, separation);
}

void Detector::set_separations(std::span<const double> of_pairs) {
  const StandardArithmetic arithmetic;
  const std::size_t n = impl_->common.scene->meshes().size();
  if (of_pairs.size() != n * n)
    throw InvalidArgument("of_pairs: expected " + std::to_string(n) + " x " + std::to_string(n) + " numbers, got " +
                          std::to_string(of_pairs.size()));
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      check_length("of_pairs", of_pairs[a * n + b]);
      if (of_pairs[a * n + b] != of_pairs[b * n + a])
        throw InvalidArgument("of_pairs: meshes " + std::to_string(b) + " and " + std::to_string(a) +
                              " have two separations; give the same in both places");
    }
  const std::lock_guard lock(impl_->one_call);
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = 0; b <= a; ++b)
      if (const double d = of_pairs[a * n + b]; d != impl_->common.separations.of(a, b))
        impl_->common.separations.set(a, b, d);
}

void Detector::set_thickness(std::uint32_t mesh, std::span<const double> thickness) {
  const StandardArithmetic arithmetic;
  const auto& meshes = impl_->common.scene->meshes();
  if (mesh >= meshes.size())
    throw InvalidArgument("mesh: the scene has " + std::to_string(meshes.size()) +
                          " meshes; give a number that Scene::add_mesh() returned");
  check_thickness(meshes[mesh], thickness);
  const std::lock_guard lock(impl_->one_call);
  impl_->common.thickness.set(mesh, thickness);
}

void Detector::set_plane(std::uint32_t plane, const Plane& value) {
  const StandardArithmetic arithmetic;
  const std::lock_guard lock(impl_->one_call);
  impl_->common.planes.set(plane, value);
}

void Detector::cancel() { impl_->cancellation().request(); }

std::map<std::string, double> Detector::profile() const {
  const std::lock_guard lock(impl_->one_call);
  if (!impl_->engine) return {};
  auto stages = impl_->profiler().stages();
  impl_->backends().at(impl_->last_backend).add_stages(stages);
  return stages;
}

std::map<std::string, std::uint64_t> Detector::stats() const {
  const std::lock_guard lock(impl_->one_call);
  Impl& d = *impl_;
  if (!d.found || !d.engine) return {};
  std::map<std::string, std::uint64_t> stats;
  d.backends().count(d.asked, stats);
  stats.insert(d.found->begin(), d.found->end());
  stats["triangles"] = d.common.features.n_faces();
  stats["bytes"] += d.engine->shared.tree.bytes() + d.common.features.bytes() + d.common.separations.bytes() +
                    d.common.filter.bytes() + d.common.thickness.bytes() + d.common.rules.bytes() +
                    d.common.planes.bytes();
  if (d.options().worlds > 1) stats["worlds"] = d.options().worlds;
  return stats;
}

bool Detector::busy() const { return impl_->one_call.held(); }
const Scene& Detector::scene() const { return *impl_->common.scene; }
const Options& Detector::options() const { return impl_->options(); }
Backend Detector::last_backend() const { return impl_->last_backend; }

std::string Detector::last_gpu_error() const {
  const std::lock_guard lock(impl_->one_call);
  return impl_->engine ? impl_->backends().last_error() : std::string();
}

}  // namespace hpccd
