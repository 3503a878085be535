// SPDX-License-Identifier: Apache-2.0
// pybind11 code without logic: Python has checked the arguments. The interpreter lock is released during work.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "base/simd.h"
#include "base/standard_arithmetic.h"
#include "bindings_detail.h"
#include "bindings_device.h"
#include "bindings_rigid.h"
#include "contacts/contours.h"
#include "contacts/parts.h"
#include "gpu/device.h"
#include "gpu/memory_on_device.h"
#include "hpccd/hpccd.h"
#include "solid/closed.h"

namespace py = pybind11;
using namespace hpccd;
using namespace py::literals;

namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style>;

// A numpy array that owns the moved vector: no copy.
template <class T, class Row, class... Columns>
py::array hand_over(std::vector<Row>&& rows, Columns... columns) {
  auto* owner = new std::vector<Row>(std::move(rows));
  py::capsule free(owner, [](void* p) { delete static_cast<std::vector<Row>*>(p); });
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(owner->size()), py::ssize_t{columns}...};
  return py::array_t<T>(shape, reinterpret_cast<const T*>(owner->data()), free);
}

// Positions in a numpy array, or in an array on a device, which the caller keeps alive.
struct GivenPositions {
  Positions positions;

  using Stream = std::optional<std::uintptr_t>;
  explicit GivenPositions(const py::array& a, Stream made_on = std::nullopt)
      : positions{in_order(a).data(), static_cast<std::size_t>(a.size()) / 3, py::isinstance<py::array_t<double>>(a)} {
    if (made_on) positions.made_on = reinterpret_cast<void*>(*made_on);
  }
  GivenPositions(std::uintptr_t pointer, std::size_t n, bool is_double, Stream made_on)
      : positions{reinterpret_cast<const void*>(pointer), n, is_double, true} {
    if (made_on) positions.made_on = reinterpret_cast<void*>(*made_on);
  }

 private:
  static const py::array& in_order(const py::array& a) {
    if ((a.flags() & py::array::c_style) == 0) throw py::value_error("positions: must be C-contiguous");
    return a;
  }
};

void add_slices(py::dict& answer, WorldSlices&& s, std::vector<double>&& first_tocs = {}) {
  if (s.hashes.empty()) return;
  py::dict d;
  d["vf"] = hand_over<std::int64_t>(std::move(s.vf));
  d["ee"] = hand_over<std::int64_t>(std::move(s.ee));
  d["ef"] = hand_over<std::int64_t>(std::move(s.ef));
  if (!s.vp.empty()) d["vp"] = hand_over<std::int64_t>(std::move(s.vp));
  if (!s.vv.empty()) d["vv"] = hand_over<std::int64_t>(std::move(s.vv));
  if (!s.ve.empty()) d["ve"] = hand_over<std::int64_t>(std::move(s.ve));
  d["hashes"] = hand_over<std::uint64_t>(std::move(s.hashes));
  d["first_tocs"] = hand_over<double>(std::move(first_tocs));
  answer["slices"] = std::move(d);
}

// Kinds without rows are left out: each array costs as much as the rest of a small call.
template <class Result>
void add_other_kinds(py::dict& d, Result& r, std::vector<double> Result::* vp, std::vector<double> Result::* vv,
                     std::vector<double> Result::* ve, const std::string& value) {
  const auto add = [&](const char* kind, auto& rows, std::vector<double>& values, py::ssize_t columns) {
    if (rows.empty()) return;
    d[kind] = hand_over<std::uint32_t>(std::move(rows), columns);
    d[(kind + value).c_str()] = hand_over<double>(std::move(values));
  };
  add("vp", r.vp, r.*vp, 2), add("vv", r.vv, r.*vv, 2), add("ve", r.ve, r.*ve, 3);
}

py::dict to_dict(Contacts&& c) {
  py::dict d;
  d["vf"] = hand_over<std::uint32_t>(std::move(c.vf), 2);
  d["vf_toc"] = hand_over<double>(std::move(c.vf_toc));
  d["ee"] = hand_over<std::uint32_t>(std::move(c.ee), 4);
  d["ee_toc"] = hand_over<double>(std::move(c.ee_toc));
  add_other_kinds(d, c, &Contacts::vp_toc, &Contacts::vv_toc, &Contacts::ve_toc, "_toc");
  d["points"] = hand_over<double>(std::move(c.points), 3);
  d["normals"] = hand_over<double>(std::move(c.normals), 3);
  d["closest"] = hand_over<double>(std::move(c.closest), 2, 3);
  d["vertices"] = hand_over<std::uint32_t>(std::move(c.vertices), 4);
  d["weights"] = hand_over<double>(std::move(c.weights), 4);
  d["approach"] = hand_over<double>(std::move(c.approach));
  d["first_toc"] = c.first_toc;
  d["hash"] = c.hash;
  add_slices(d, std::move(c.slices), std::move(c.first_tocs));
  return d;
}

py::dict to_dict(Proximity&& c) {
  py::dict d;
  d["vf"] = hand_over<std::uint32_t>(std::move(c.vf), 2);
  d["vf_distance"] = hand_over<double>(std::move(c.vf_distance));
  d["ee"] = hand_over<std::uint32_t>(std::move(c.ee), 4);
  d["ee_distance"] = hand_over<double>(std::move(c.ee_distance));
  add_other_kinds(d, c, &Proximity::vp_distance, &Proximity::vv_distance, &Proximity::ve_distance, "_distance");
  d["closest"] = hand_over<double>(std::move(c.closest), 2, 3);
  d["normals"] = hand_over<double>(std::move(c.normals), 3);
  d["vertices"] = hand_over<std::uint32_t>(std::move(c.vertices), 4);
  d["weights"] = hand_over<double>(std::move(c.weights), 4);
  d["hash"] = c.hash;
  add_slices(d, std::move(c.slices));
  return d;
}

py::dict to_dict(Intersections&& c) {
  py::dict d;
  d["ef"] = hand_over<std::uint32_t>(std::move(c.ef), 3);
  d["hash"] = c.hash;
  d["points"] = hand_over<double>(std::move(c.points), 3);
  d["edge_parameters"] = hand_over<double>(std::move(c.edge_parameters));
  d["weights"] = hand_over<double>(std::move(c.weights), 3);
  d["incidences"] = hand_over<std::uint8_t>(std::move(c.incidences));
  d["directions"] = hand_over<double>(std::move(c.directions), 3);
  add_slices(d, std::move(c.slices));
  return d;
}

// Rows of one world, from numpy arrays that the caller keeps alive.
IntersectionRows rows_of(const Array<std::uint32_t>& ef, const Array<std::uint8_t>& incidences,
                         const Array<std::uint32_t>& faces, const Array<std::int64_t>& first_vertex) {
  const auto triples = [](const Array<std::uint32_t>& a) {
    return std::span(reinterpret_cast<const std::array<std::uint32_t, 3>*>(a.data()),
                     static_cast<std::size_t>(a.size()) / 3);
  };
  return {triples(ef),
          {incidences.data(), static_cast<std::size_t>(incidences.size())},
          triples(faces),
          {first_vertex.data(), static_cast<std::size_t>(first_vertex.size())}};
}

py::array_t<double> widened(const Array<float>& from) {
  const StandardArithmetic arithmetic;
  py::array_t<double> to(std::vector<py::ssize_t>(from.shape(), from.shape() + from.ndim()));
  std::copy_n(from.data(), from.size(), to.mutable_data());
  return to;
}

// The context manager StandardArithmetic, for Python code that does arithmetic itself.
struct ArithmeticContext {
  std::optional<StandardArithmetic> entered;
};

// The arrays of a hpccd_core.Contacts; `kept` holds references to them.
ContactsOfPart part_of(const py::handle& contacts, double part, double parts, std::vector<py::array>& kept) {
  const auto read = [&]<class Row>(const char* name, std::span<const Row>& rows, auto number) {
    const auto array = py::cast<Array<decltype(number)>>(contacts.attr(name));
    rows = {reinterpret_cast<const Row*>(array.data()), static_cast<std::size_t>(array.nbytes()) / sizeof(Row)};
    kept.push_back(array);
  };
  ContactsOfPart of;
  read("vf", of.vf, std::uint32_t{}), read("vf_toc", of.vf_toc, double{});
  read("ee", of.ee, std::uint32_t{}), read("ee_toc", of.ee_toc, double{});
  read("vp", of.vp, std::uint32_t{}), read("vp_toc", of.vp_toc, double{});
  read("vv", of.vv, std::uint32_t{}), read("vv_toc", of.vv_toc, double{});
  read("ve", of.ve, std::uint32_t{}), read("ve_toc", of.ve_toc, double{});
  read("points", of.points, double{}), read("normals", of.normals, double{}), read("closest", of.closest, double{});
  read("vertices", of.vertices, std::uint32_t{}), read("weights", of.weights, double{});
  read("approach", of.approach, double{});
  of.part = part, of.parts = parts;
  return of;
}

const char* name_of(GapKind kind) {
  switch (kind) {
    case GapKind::vertex_face:
      return "vertex-face";
    case GapKind::edge_edge:
      return "edge-edge";
    case GapKind::edge_face:
      return "edge-face";
    case GapKind::vertex_plane:
      return "vertex-plane";
    case GapKind::vertex_vertex:
      return "vertex-vertex";
    case GapKind::vertex_edge:
      return "vertex-edge";
    case GapKind::none:
      break;
  }
  return "";
}

std::size_t n_features(GapKind kind) {
  switch (kind) {
    case GapKind::none:
      return 0;
    case GapKind::edge_edge:
      return 4;
    case GapKind::edge_face:
    case GapKind::vertex_edge:
      return 3;
    case GapKind::vertex_face:
    case GapKind::vertex_plane:
    case GapKind::vertex_vertex:
      break;
  }
  return 2;
}

const char* name_of(Inside inside) {
  switch (inside) {
    case Inside::a:
      return "a";
    case Inside::b:
      return "b";
    case Inside::both:
      return "both";
    case Inside::none:
      break;
  }
  return nullptr;  // None
}

// (mesh_a, mesh_b, distance, kind, features, points, vertices, weights, normal, inside) of each gap.
py::list to_list(const std::vector<Gap>& gaps) {
  py::list l;
  for (const Gap& g : gaps) {
    const std::span<const std::uint32_t> features(g.features.data(), n_features(g.kind));
    py::array_t<double> points(std::vector<py::ssize_t>{g.kind == GapKind::none ? 0 : 2, 3});
    if (g.kind != GapKind::none) std::copy_n(g.points[0].data(), 6, points.mutable_data());
    const bool apart = g.kind != GapKind::none && g.kind != GapKind::edge_face;
    const auto rows = [&](const auto& row) {
      return py::array_t<typename std::decay_t<decltype(row)>::value_type>(apart ? row.size() : 0, row.data());
    };
    l.append(py::make_tuple(g.mesh_a, g.mesh_b, g.distance, name_of(g.kind),
                            std::vector<std::uint32_t>(features.begin(), features.end()), points, rows(g.vertices),
                            rows(g.weights), rows(g.normal), name_of(g.inside)));
  }
  return l;
}

// Arrays that refer to rows in place and hold their memory.
py::dict in_place(const DeviceResults& r) {
  const py::capsule owner(new std::shared_ptr<const void>(r.memory),
                          [](void* p) { delete static_cast<std::shared_ptr<const void>*>(p); });
  const auto rows = [&](const auto* data, std::uint64_t n, auto... columns) {
    return py::array_t<std::remove_const_t<std::remove_pointer_t<decltype(data)>>>(
        std::vector<py::ssize_t>{static_cast<py::ssize_t>(n), py::ssize_t{columns}...}, data, owner);
  };
  py::dict d;
  d["vf"] = rows(reinterpret_cast<const std::uint32_t*>(r.vf), r.n_vf, 2);
  d["vf_toc"] = rows(r.values, r.n_vf);
  d["ee"] = rows(reinterpret_cast<const std::uint32_t*>(r.ee), r.n_ee, 4);
  d["ee_toc"] = rows(r.values + r.n_vf, r.n_ee);
  d["first_toc"] = r.first_toc;
  d["hash"] = r.hash;
  return d;
}

py::dict to_dict(Detected&& d) { return d.in_place ? in_place(*d.in_place) : to_dict(std::move(d.contacts)); }

template <class Query>
auto unlocked(Query&& query) {
  py::gil_scoped_release release;
  return query();
}

// Rows of seven numbers: positions and quaternions.
std::span<const Pose> poses_of(const Array<double>& rows) {
  static_assert(sizeof(Pose) == 7 * sizeof(double));
  return {reinterpret_cast<const Pose*>(rows.data()), static_cast<std::size_t>(rows.size()) / 7};
}

// The result of a query, with its rows where the detector's options require them.
template <class OnDevice, class OnHost>
py::dict rows_where_asked(const Detector& d, OnDevice&& on_device, OnHost&& on_host) {
  return d.options().results_on_device ? to_dict(unlocked(on_device), d.options().worlds) : to_dict(unlocked(on_host));
}

// Distances as arrays, where the detector leaves its results.
template <class Query>
py::dict arrays_of_gaps(const Detector& d, Query&& query) {
  std::optional<int> device;
  if (d.options().results_on_device) device = gpu::status().devices.at(0).number;
  return to_dict(unlocked(query), d.options().worlds, device);
}

// For queries that take less time than reacquiring the interpreter lock, which may take a whole time slice of another
// thread.
template <class Query>
auto unlocked_if_busy(const Detector& d, Query&& query) {
  std::optional<py::gil_scoped_release> release;
  if (d.busy()) release.emplace();
  return query();
}

template <auto test>
py::tuple run_queries(const Array<double>& queries, Accuracy accuracy, Simd simd, double separation) {
  const auto n = static_cast<std::size_t>(queries.shape(0));
  py::array_t<bool> hit(static_cast<py::ssize_t>(n));
  py::array_t<double> toc(static_cast<py::ssize_t>(n));
  const std::span<const Query> view(reinterpret_cast<const Query*>(queries.data()), n);
  bool* h = hit.mutable_data();
  double* t = toc.mutable_data();
  {
    py::gil_scoped_release release;
    Options options;
    options.accuracy = accuracy, options.simd = simd;
    options.minimum_separation = separation;
    test(view, options, h, t);
  }
  return py::make_tuple(hit, toc);
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  py::register_exception<InvalidArgument>(m, "InvalidArgument", PyExc_ValueError).doc() =
      R"(An argument that the compiled core rejects: a :class:`ValueError`.

The message begins with the name of the argument and ends with the remedy. The scene or the detector stays usable.

Notes
-----
Arguments are checked in Python first, which raises a plain ValueError or TypeError. Catch ValueError for both.

Examples
--------
>>> import hpccd_core as hc
>>> scene = hc.Scene()
>>> _ = scene.add_mesh("cloth", [[0, 1, 2]])
>>> _ = scene.add_mesh("cloth", [[0, 1, 2]])
Traceback (most recent call last):
...
hpccd_core._core.InvalidArgument: name: a mesh named 'cloth' is already in the scene; choose another
)";
  py::register_exception<Cancelled>(m, "Cancelled", PyExc_RuntimeError).doc() =
      R"(The detector was cancelled: a :class:`RuntimeError`.

The call in progress, those that wait for it and all later queries of the detector raise it after
:meth:`Detector.cancel`. Make another Detector to go on.

Examples
--------
>>> import hpccd_core as hc
>>> scene = hc.Scene()
>>> _ = scene.add_mesh("cloth", [[0, 1, 2]])
>>> detector = hc.Detector(scene)
>>> detector.cancel()
>>> detector.detect([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
Traceback (most recent call last):
...
hpccd_core._core.Cancelled: the detector was cancelled; create another one
)";
  py::enum_<Accuracy>(m, "Accuracy")
      .value("fast", Accuracy::fast)
      .value("balanced", Accuracy::balanced)
      .value("conservative", Accuracy::conservative)
      .value("exact", Accuracy::exact);
  py::enum_<Backend>(m, "Backend")
      .value("auto", Backend::automatic)
      .value("cpu", Backend::cpu)
      .value("hybrid", Backend::hybrid)
      .value("gpu", Backend::gpu);
  py::enum_<Report>(m, "Report").value("all", Report::all).value("first", Report::first).value("any", Report::any);
  py::enum_<Method>(m, "Method")
      .value("default", Method::standard)
      .value("published", Method::published)
      .value("naive", Method::naive)
      .value("front", Method::front);
  py::enum_<Simd>(m, "Simd")
      .value("auto", Simd::automatic)
      .value("scalar", Simd::scalar)
      .value("avx2", Simd::avx2)
      .value("avx512", Simd::avx512)
      .value("neon", Simd::neon);

  py::class_<TestedFeatures>(m, "TestedFeatures").def(py::init<bool, bool>(), "vertex_face"_a, "edge_edge"_a);
  py::class_<Scene, std::shared_ptr<Scene>>(m, "Scene")
      .def(py::init<>())
      .def(
          "add_mesh",
          [](Scene& s, const std::string& name, const Array<std::uint32_t>& faces, std::uint32_t n_vertices,
             bool self_collision, bool is_static, const Array<std::uint32_t>& edges, bool points) {
            return s.add_mesh(name, {faces.data(), static_cast<std::size_t>(faces.size())}, n_vertices,
                              {self_collision, is_static, points},
                              {edges.data(), static_cast<std::size_t>(edges.size())});
          },
          "name"_a, "faces"_a, "n_vertices"_a, "self_collision"_a, "static"_a, "edges"_a, "points"_a = false)
      .def(
          "add_plane",
          [](Scene& s, const std::string& name, const std::array<double, 3>& normal, double offset, bool is_static) {
            return s.add_plane(name, {normal, offset}, is_static);
          },
          "name"_a, "normal"_a, "offset"_a, "static"_a)
      .def(
          "set_shape",
          [](Scene& s, std::uint32_t mesh, const Array<double>& vertices) {
            s.set_shape(mesh, {vertices.data(), static_cast<std::size_t>(vertices.size())});
          },
          "mesh"_a, "vertices"_a)
      .def("ignore_pair", &Scene::ignore_pair, "mesh_a"_a, "mesh_b"_a)
      .def("set_accuracy", &Scene::set_accuracy, "mesh_a"_a, "mesh_b"_a, "accuracy"_a)
      .def("set_separation", &Scene::set_separation, "mesh_a"_a, "mesh_b"_a, "separation"_a)
      .def("set_features", &Scene::set_features, "mesh_a"_a, "mesh_b"_a, "features"_a)
      .def(
          "set_thickness",
          [](Scene& s, std::uint32_t mesh, const Array<double>& values) {
            s.set_thickness(mesh, {values.data(), static_cast<std::size_t>(values.size())});
          },
          "mesh"_a, "values"_a)
      .def(
          "ignore_rings", [](Scene& s, std::uint32_t mesh, std::uint32_t rings) { s.ignore_within(mesh, rings); },
          "mesh"_a, "rings"_a)
      .def(
          "ignore_at_rest",
          [](Scene& s, std::uint32_t mesh, const Array<double>& vertices, double distance) {
            s.ignore_within(mesh, RestFilter{{vertices.data(), vertices.data() + vertices.size()}, distance});
          },
          "mesh"_a, "vertices"_a, "distance"_a)
      .def(
          "ignore_faces",
          [](Scene& s, std::uint32_t mesh, const Array<std::uint32_t>& faces, std::uint32_t other) {
            s.ignore_faces(mesh, {faces.data(), static_cast<std::size_t>(faces.size())}, other);
          },
          "mesh"_a, "faces"_a, "other"_a)
      .def(
          "ignore_features",
          [](Scene& s, const Array<std::uint32_t>& vf, const Array<std::uint32_t>& ee, const Array<std::uint32_t>& ef) {
            const auto rows = []<std::size_t n>(const Array<std::uint32_t>& a, std::integral_constant<std::size_t, n>) {
              return std::span(reinterpret_cast<const std::array<std::uint32_t, n>*>(a.data()),
                               static_cast<std::size_t>(a.size()) / n);
            };
            s.ignore_features(rows(vf, std::integral_constant<std::size_t, 2>()),
                              rows(ee, std::integral_constant<std::size_t, 4>()),
                              rows(ef, std::integral_constant<std::size_t, 3>()));
          },
          "vf"_a, "ee"_a, "ef"_a)
      .def_property_readonly("n_vertices", &Scene::n_vertices)
      .def_property_readonly("n_faces", [](const Scene& s) { return s.faces().size(); })
      .def(
          "first_vertex", [](const Scene& s, std::size_t mesh) { return s.meshes().at(mesh).first_vertex; }, "mesh"_a)
      .def(
          "first_face", [](const Scene& s, std::size_t mesh) { return s.meshes().at(mesh).first_face; }, "mesh"_a)
      .def_property_readonly("n_edges", [](const Scene& s) { return s.edges().size(); });

  py::class_<GivenPositions>(m, "Positions")
      .def(py::init<const py::array&, GivenPositions::Stream>(), "array"_a, "made_on"_a = py::none(),
           py::keep_alive<1, 2>())
      .def(py::init<std::uintptr_t, std::size_t, bool, GivenPositions::Stream>(), "pointer"_a, "n"_a, "is_double"_a,
           "made_on"_a);
  py::implicitly_convertible<py::array, GivenPositions>();
  bind_device_array(m);
  bind_prepared(m);
  bind_rigid(m);
  bind_detail(m);

  py::class_<Options>(m, "Options")
      .def(py::init<>())
      .def_readwrite("accuracy", &Options::accuracy)
      .def_readwrite("backend", &Options::backend)
      .def_readwrite("report", &Options::report)
      .def_readwrite("simd", &Options::simd)
      .def_readwrite("threads", &Options::threads)
      .def_readwrite("points", &Options::points)
      .def_readwrite("normals", &Options::normals)
      .def_readwrite("closest", &Options::closest)
      .def_readwrite("weights", &Options::weights)
      .def_readwrite("directions", &Options::directions)
      .def_readwrite("minimum_separation", &Options::minimum_separation)
      .def_readwrite("method", &Options::method)
      .def_readwrite("restructure", &Options::restructure)
      .def_readwrite("hybrid_segments", &Options::hybrid_segments)
      .def_readwrite("hybrid_segment_pairs", &Options::hybrid_segment_pairs)
      .def_readwrite("gpus", &Options::gpus)
      .def_readwrite("gpu_stages", &Options::gpu_stages)
      .def_readwrite("features", &Options::features)
      .def_readwrite("results_on_device", &Options::results_on_device)
      .def_readwrite("worlds", &Options::worlds);

  py::class_<Detector>(m, "Detector")
      // Copies the scene: later changes of the caller's scene do not affect this detector.
      .def(py::init([](const Scene& scene, const Options& options) {
             auto copy = std::make_shared<const Scene>(scene);
             return unlocked([&] { return std::make_unique<Detector>(std::move(copy), options); });  // filters: seconds
           }),
           "scene"_a, "options"_a)
      .def(
          "detect",
          [](Detector& d, const GivenPositions& t0, const GivenPositions& t1) {
            return rows_where_asked(
                d, [&] { return d.detect_on_device(t0.positions, t1.positions); },
                [&] { return d.detect_in_place(t0.positions, t1.positions); });
          },
          "vertices_t0"_a, "vertices_t1"_a)
      .def(
          "prepare",
          [](Detector& d, const GivenPositions& t0, const GivenPositions& t1, double room) {
            return unlocked([&] { return d.prepare(t0.positions, t1.positions, room); });
          },
          "vertices_t0"_a, "vertices_t1"_a, "room"_a)
      .def(
          "collision_free_steps",
          [](Detector& d, const GivenPositions& t0, const GivenPositions& t1) {
            return hand_over<double>(unlocked([&] { return d.collision_free_steps(t0.positions, t1.positions); }));
          },
          "vertices_t0"_a, "vertices_t1"_a)
      .def(
          "collision_free_motion",
          [](Detector& d, const GivenPositions& t0, const GivenPositions& t1, const Array<std::int64_t>& groups) {
            const std::span<const std::int64_t> of_vertices(groups.data(), static_cast<std::size_t>(groups.size()));
            CollisionFreeMotion m =
                unlocked([&] { return d.collision_free_motion(t0.positions, t1.positions, of_vertices); });
            const py::object vertices =
                t0.positions.is_double ? py::object(hand_over<double>(std::move(m.vertices)))
                                       : hand_over<float>(std::vector<float>(m.vertices.begin(), m.vertices.end()));
            return py::make_tuple(vertices, hand_over<double>(std::move(m.factors)),
                                  hand_over<std::uint32_t>(std::move(m.stuck)));
          },
          "vertices_t0"_a, "vertices_t1"_a, "groups"_a)
      .def(
          "proximity",
          [](Detector& d, const GivenPositions& vertices, double distance) {
            return rows_where_asked(
                d, [&] { return d.proximity_on_device(vertices.positions, distance); },
                [&] { return d.proximity(vertices.positions, distance); });
          },
          "vertices"_a, "distance"_a)
      .def(
          "intersections",
          [](Detector& d, const GivenPositions& vertices) {
            return rows_where_asked(
                d, [&] { return d.intersections_on_device(vertices.positions); },
                [&] { return d.intersections(vertices.positions); });
          },
          "vertices"_a)
      .def(
          "distances",
          [](Detector& d, const GivenPositions& vertices) {
            return to_list(unlocked([&] { return d.distances(vertices.positions); }));
          },
          "vertices"_a)
      .def(
          "distance_arrays",
          [](Detector& d, const GivenPositions& vertices) {
            return arrays_of_gaps(d, [&] { return d.distances(vertices.positions); });
          },
          "vertices"_a)
      .def(
          "proximity_at",
          [](Detector& d, const Array<double>& poses, const GivenPositions& others, double distance) {
            return rows_where_asked(
                d,
                [&] {
                  const std::vector<double> x = d.positions_at(poses_of(poses), others.positions);
                  return d.proximity_on_device(Positions::of(x), distance);
                },
                [&] { return d.proximity_at(poses_of(poses), distance, others.positions); });
          },
          "poses"_a, "others"_a, "distance"_a)
      .def(
          "intersections_at",
          [](Detector& d, const Array<double>& poses, const GivenPositions& others) {
            return rows_where_asked(
                d,
                [&] {
                  const std::vector<double> x = d.positions_at(poses_of(poses), others.positions);
                  return d.intersections_on_device(Positions::of(x));
                },
                [&] { return d.intersections_at(poses_of(poses), others.positions); });
          },
          "poses"_a, "others"_a)
      .def(
          "distances_at",
          [](Detector& d, const Array<double>& poses, const GivenPositions& others) {
            return to_list(unlocked([&] { return d.distances_at(poses_of(poses), others.positions); }));
          },
          "poses"_a, "others"_a)
      .def(
          "distance_arrays_at",
          [](Detector& d, const Array<double>& poses, const GivenPositions& others) {
            return arrays_of_gaps(d, [&] { return d.distances_at(poses_of(poses), others.positions); });
          },
          "poses"_a, "others"_a)
      .def(
          "positions_at",
          [](Detector& d, const Array<double>& poses, const GivenPositions& others) {
            std::vector<double> x = unlocked([&] { return d.positions_at(poses_of(poses), others.positions); });
            return hand_over<double>(std::move(x));
          },
          "poses"_a, "others"_a)
      .def(
          "winding_numbers",
          [](Detector& d, const GivenPositions& vertices, const GivenPositions& points, std::uint32_t mesh) {
            WindingNumbers w = unlocked([&] { return d.winding_numbers(vertices.positions, points.positions, mesh); });
            return py::make_tuple(hand_over<std::int32_t>(std::move(w.numbers)),
                                  hand_over<bool>(std::move(w.on_surface)));
          },
          "vertices"_a, "points"_a, "mesh"_a)
      .def(
          "signed_distances",
          [](Detector& d, const GivenPositions& vertices, const GivenPositions& points, std::uint32_t mesh) {
            SignedDistances s =
                unlocked([&] { return d.signed_distances(vertices.positions, points.positions, mesh); });
            return py::make_tuple(hand_over<double>(std::move(s.distance)),
                                  hand_over<std::uint32_t>(std::move(s.faces)),
                                  hand_over<double>(std::move(s.closest), 3));
          },
          "vertices"_a, "points"_a, "mesh"_a)
      .def(
          "separating_translation",
          [](Detector& d, const GivenPositions& vertices, std::uint32_t mesh_a, std::uint32_t mesh_b,
             const std::array<double, 3>& direction) {
            return unlocked([&] { return d.separating_translation(vertices.positions, mesh_a, mesh_b, direction); });
          },
          "vertices"_a, "mesh_a"_a, "mesh_b"_a, "direction"_a)
      .def(
          "penetration",
          [](Detector& d, const GivenPositions& vertices, std::uint32_t mesh_a, std::uint32_t mesh_b,
             const std::optional<std::array<double, 3>>& start) {
            const Penetration p = unlocked([&] { return d.penetration(vertices.positions, mesh_a, mesh_b, start); });
            return py::make_tuple(
                py::array_t<double>(3, p.translation.data()), p.depth, p.lower_bound, name_of(p.kind),
                std::vector<std::uint32_t>(p.features.data(), p.features.data() + n_features(p.kind)));
          },
          "vertices"_a, "mesh_a"_a, "mesh_b"_a, "start"_a)
      .def(
          "set_separation",
          [](Detector& d, std::uint32_t mesh_a, std::uint32_t mesh_b, double separation) {
            unlocked_if_busy(d, [&] { d.set_separation(mesh_a, mesh_b, separation); });
          },
          "mesh_a"_a, "mesh_b"_a, "separation"_a)
      .def(
          "set_thickness",
          [](Detector& d, std::uint32_t mesh, const Array<double>& values) {
            const std::span<const double> numbers(values.data(), static_cast<std::size_t>(values.size()));
            unlocked_if_busy(d, [&] { d.set_thickness(mesh, numbers); });
          },
          "mesh"_a, "values"_a)
      .def(
          "set_separations",
          [](Detector& d, const Array<double>& of_pairs) {
            const std::span<const double> numbers(of_pairs.data(), static_cast<std::size_t>(of_pairs.size()));
            unlocked_if_busy(d, [&] { d.set_separations(numbers); });
          },
          "of_pairs"_a)
      .def(
          "set_plane",
          [](Detector& d, std::uint32_t plane, const std::array<double, 3>& normal, double offset) {
            unlocked_if_busy(d, [&] { d.set_plane(plane, {normal, offset}); });
          },
          "plane"_a, "normal"_a, "offset"_a)
      // Every face of the scene, with scene-wide vertices.
      .def("faces",
           [](const Detector& d) {
             const auto& faces = d.scene().faces();
             return Array<std::uint32_t>(std::vector<py::ssize_t>{static_cast<py::ssize_t>(faces.size()), 3},
                                         reinterpret_cast<const std::uint32_t*>(faces.data()));
           })
      .def("cancel", &Detector::cancel)
      .def("profile", [](const Detector& d) { return unlocked_if_busy(d, [&] { return d.profile(); }); })
      .def("stats", [](const Detector& d) { return unlocked_if_busy(d, [&] { return d.stats(); }); })
      .def_property_readonly("last_backend",
                             [](const Detector& d) {
                               const Backend b = d.last_backend();
                               return b == Backend::gpu ? "gpu" : b == Backend::hybrid ? "hybrid" : "cpu";
                             })
      .def_property_readonly("last_gpu_error",
                             [](const Detector& d) { return unlocked_if_busy(d, [&] { return d.last_gpu_error(); }); })
      .def_property_readonly("threads", [](const Detector& d) { return d.options().threads; })
      .def_property_readonly("simd", [](const Detector& d) { return name_of(d.options().simd); });

  py::class_<gpu::MemoryOnDevice>(m, "MemoryOnDevice")
      .def(py::init([] { return gpu::MemoryOnDevice::create(); }))
      .def(
          "assign",
          [](gpu::MemoryOnDevice& m, std::uintptr_t from, std::size_t bytes) {
            py::gil_scoped_release release;
            m.assign(reinterpret_cast<const void*>(from), bytes);
          },
          "pointer"_a, "bytes"_a)
      .def_property_readonly("pointer",
                             [](const gpu::MemoryOnDevice& m) { return reinterpret_cast<std::uintptr_t>(m.data()); });

  m.attr("__version__") = version();
  m.attr("MOST_WORLDS") = Options::most_worlds;
  m.def("test_vertex_face", &run_queries<&test_vertex_face>, "queries"_a, "accuracy"_a, "simd"_a,
        "minimum_separation"_a);
  m.def("test_edge_edge", &run_queries<&test_edge_edge>, "queries"_a, "accuracy"_a, "simd"_a, "minimum_separation"_a);
  m.def("widened", &widened, "array"_a);
  m.def(
      "is_closed",
      [](const Array<std::uint32_t>& faces) {
        using Face = std::array<std::uint32_t, 3>;
        const std::span rows(reinterpret_cast<const Face*>(faces.data()), static_cast<std::size_t>(faces.size()) / 3);
        return unlocked([&] { return is_closed(rows); });
      },
      "faces"_a);
  py::class_<ArithmeticContext>(m, "StandardArithmetic")
      .def(py::init())
      .def("__enter__", [](ArithmeticContext& c) { c.entered.emplace(); })
      .def("__exit__", [](ArithmeticContext& c, const py::args&) { c.entered.reset(); });
  m.def(
      "contacts_of_step",
      [](const std::vector<std::tuple<py::object, double, double>>& answers) {
        std::vector<ContactsOfPart> of_parts;
        std::vector<py::array> kept;
        for (const auto& [contacts, part, parts] : answers) of_parts.push_back(part_of(contacts, part, parts, kept));
        return to_dict(unlocked([&] { return contacts_of_step(of_parts); }));
      },
      "answers"_a);
  // (rows, closed, mesh_a, mesh_b) of each contour.
  m.def(
      "contours",
      [](const Array<std::uint32_t>& ef, const Array<std::uint8_t>& incidences, const Array<std::uint32_t>& faces,
         const Array<std::int64_t>& first_vertex) {
        const IntersectionRows rows = rows_of(ef, incidences, faces, first_vertex);
        py::list l;
        for (Contour& c : unlocked([&] { return contours_of(rows); }))
          l.append(py::make_tuple(hand_over<std::uint32_t>(std::move(c.rows)), c.closed, c.mesh_a, c.mesh_b));
        return l;
      },
      "ef"_a, "incidences"_a, "faces"_a, "first_vertex"_a);
  // (vertices_a, vertices_b) of each contour.
  m.def(
      "enclosed_regions",
      [](const Array<std::uint32_t>& ef, const Array<std::uint8_t>& incidences, const Array<std::uint32_t>& faces,
         const Array<std::int64_t>& first_vertex) {
        const IntersectionRows rows = rows_of(ef, incidences, faces, first_vertex);
        py::list l;
        for (EnclosedRegion& r : unlocked([&] { return enclosed_regions_of(rows); }))
          l.append(py::make_tuple(hand_over<std::uint32_t>(std::move(r.vertices_a)),
                                  hand_over<std::uint32_t>(std::move(r.vertices_b))));
        return l;
      },
      "ef"_a, "incidences"_a, "faces"_a, "first_vertex"_a);
  m.def(
      "hash_of_contacts",
      [](const py::object& contacts) {
        std::vector<py::array> kept;
        return hash_of_contacts(part_of(contacts, 0, 1, kept));
      },
      "contacts"_a);
  m.def("gpu_status", [] {
    const gpu::Status& s = gpu::status();
    py::list devices;
    for (const gpu::Device& x : s.devices)
      devices.append(py::dict("name"_a = x.name, "number"_a = x.number, "major"_a = x.major, "minor"_a = x.minor,
                              "multiprocessors"_a = x.multiprocessors, "memory"_a = x.memory));
    return py::dict("compiled"_a = s.compiled, "toolkit"_a = s.toolkit, "devices"_a = devices, "reason"_a = s.reason);
  });
  m.def("gpu_fail_after", &gpu::fail_after, "calls"_a);  // for tests
  m.def("simd_levels", [] {
    std::vector<std::string> names;
    for (Simd s : simd_levels()) names.push_back(name_of(s));
    return names;
  });
}
