// SPDX-License-Identifier: Apache-2.0
// Python has checked the arguments. The interpreter lock is released during work.
#include "bindings_detail.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/cancellation.h"
#include "base/standard_arithmetic.h"
#include "contacts/hash.h"
#include "detail/patches.h"
#include "scene/static_meshes.h"

namespace hpccd {
namespace {

namespace py = pybind11;
using namespace py::literals;
using namespace detail;

template <class T>
using Array = py::array_t<T, py::array::c_style>;

template <class Row, class T>
std::span<const Row> rows(const Array<T>& a) {
  return {reinterpret_cast<const Row*>(a.data()), static_cast<std::size_t>(a.nbytes()) / sizeof(Row)};
}

template <class T, class Row, class... Columns>
Array<T> copied(const std::vector<Row>& rows, Columns... columns) {
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(rows.size()), py::ssize_t{columns}...};
  return Array<T>(shape, reinterpret_cast<const T*>(rows.data()));
}

Positions positions(const py::array& a) {
  if ((a.flags() & py::array::c_style) == 0) throw py::value_error("vertices: must be C-contiguous");
  return {a.data(), static_cast<std::size_t>(a.size()) / 3, py::isinstance<py::array_t<double>>(a)};
}

// Threads of coarse meshes. One call at a time.
struct DetailThreads {
  ThreadPool pool;
  Cancellation cancellation;
  explicit DetailThreads(int threads) : pool(threads) { pool.heed(cancellation); }

  template <class Work>
  auto run(Work&& work) {
    const py::gil_scoped_release release;
    const StandardArithmetic arithmetic;
    pool.require_threads();
    cancellation.heed();
    return work(pool);
  }
};

// The patches of one mesh at one level of detail.
struct CoarseMesh {
  Array<std::uint32_t> faces;  // of the mesh
  Patches patches;
};

}  // namespace

void bind_detail(py::module_& m) {
  py::class_<DetailThreads>(m, "DetailThreads")
      .def(py::init<int>(), "threads"_a)
      .def("stop", [](DetailThreads& t) { t.cancellation.request(); })
      .def(
          "largest",
          [](DetailThreads& t, const char* name, const py::array& vertices, const Array<std::int64_t>& first_vertex,
             double most) {
            const std::vector<double> found = t.run([&, given = positions(vertices)](ThreadPool& pool) {
              return largest_coordinates(name, given, rows<std::int64_t>(first_vertex), most, pool);
            });
            return copied<double>(found);
          },
          "name"_a, "vertices"_a, "first_vertex"_a, "most"_a)
      // Some rows of positions, and whether all their coordinates look finite and not huge.
      .def(
          "rows",
          [](DetailThreads& t, const py::array& vertices, const Array<std::uint32_t>& of) {
            std::atomic<bool> good{true};
            const auto take = [&]<class Real>(Real) -> py::array {
              Array<Real> taken({of.size(), py::ssize_t{3}});
              const Real* from = static_cast<const Real*>(positions(vertices).data);
              Real* to = taken.mutable_data();
              const std::span numbers(of.data(), static_cast<std::size_t>(of.size()));
              t.run([&](ThreadPool& pool) {
                parallel_for(pool, numbers.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
                  bool all = true;
                  for (std::size_t i = begin; i < end; ++i)
                    for (std::size_t k = 0; k < 3; ++k) {
                      const Real x = to[3 * i + k] = from[3 * std::size_t{numbers[i]} + k];
                      all &= std::fabs(x) <=
                             static_cast<Real>(std::min<double>(most_coordinate_unchecked,
                                                                std::numeric_limits<Real>::max()));  // false for NaN
                    }
                  if (!all) good = false;
                });
              });
              return taken;
            };
            const py::array taken = positions(vertices).is_double ? take(double{}) : take(float{});
            return py::make_tuple(taken, good.load());
          },
          "vertices"_a, "of"_a);

  py::class_<CoarseMesh>(m, "CoarseMesh")
      .def(py::init([](const Array<std::uint32_t>& faces, const Array<std::uint32_t>& proposed,
                       const Array<std::uint32_t>& survivor, const Array<double>& rest, DetailThreads& threads) {
             return threads.run([&](ThreadPool& pool) {
               return std::make_unique<CoarseMesh>(
                   faces, patches_of(rows<Face>(faces), rows<Face>(proposed), rows<std::uint32_t>(survivor),
                                     {rest.data(), static_cast<std::size_t>(rest.size()) / 3, true}, pool));
             });
           }),
           "faces"_a, "proposed"_a, "survivor"_a, "rest"_a, "threads"_a)
      .def_property_readonly("faces", [](const CoarseMesh& c) { return copied<std::uint32_t>(c.patches.faces, 3); })
      // (coarse face, face) of each piece, without repetition.
      .def_property_readonly("held",
                             [](const CoarseMesh& c) {
                               std::vector<std::array<std::uint32_t, 2>> found;
                               for (std::uint32_t face = 0; face < c.patches.faces.size(); ++face)
                                 for (const std::uint32_t held : c.patches.held[face]) found.push_back({face, held});
                               return copied<std::uint32_t>(found, 2);
                             })
      // The corners of pieces and where they are mapped: (coarse face, v, w, s, b1, b2), and on coarse edges
      // (a, b, v, w, s, r).
      .def_property_readonly(
          "mapped",
          [](const CoarseMesh& c) {
            std::vector<std::array<double, 6>> in_faces, on_edges;
            for (std::size_t face = 0; face < c.patches.faces.size(); ++face) {
              const auto number = static_cast<double>(face);
              for (const MappedVertex& m : c.patches.vertices[face])
                in_faces.push_back({number, double(m.vertex), double(m.vertex), 0, double{m.b1}, double{m.b2}});
              for (const MappedPoint& m : c.patches.points[face])
                in_faces.push_back({number, double(m.v), double(m.w), double{m.s}, double{m.b1}, double{m.b2}});
            }
            for (std::size_t e = 0; e < c.patches.edges.size(); ++e)
              for (const Crossing& m : c.patches.crossings[e])
                on_edges.push_back({double(c.patches.edges[e][0]), double(c.patches.edges[e][1]), double(m.v),
                                    double(m.w), double{m.s}, double{m.r}});
            return py::make_tuple(copied<double>(in_faces, 6), copied<double>(on_edges, 6));
          })
      .def(
          "deviations",
          [](const CoarseMesh& c, const py::array& vertices, std::uint32_t first_vertex, std::optional<double> largest,
             double most, DetailThreads& threads) -> std::optional<Array<double>> {
            const Positions given = positions(vertices);
            const auto found = threads.run(
                [&](ThreadPool& pool) { return deviations(c.patches, given, first_vertex, largest, most, pool); });
            return found ? std::optional(copied<double>(*found)) : std::nullopt;
          },
          "vertices"_a, "first_vertex"_a, "largest"_a, "most"_a, "threads"_a)
      // (vf, ee, ef)
      .def(
          "neighbour_pairs",
          [](const CoarseMesh& c, const Array<std::uint32_t>& lone_edges, std::size_t n_vertices,
             DetailThreads& threads) {
            const NeighbourPairs found = threads.run([&](ThreadPool& pool) {
              return neighbour_pairs(rows<Face>(c.faces), c.patches, rows<Edge>(lone_edges), n_vertices, pool);
            });
            return py::make_tuple(copied<std::uint32_t>(found.vf, 2), copied<std::uint32_t>(found.ee, 4),
                                  copied<std::uint32_t>(found.ef, 3));
          },
          "lone_edges"_a, "n_vertices"_a, "threads"_a);

  py::class_<CoarseFeatures>(m, "CoarseFeatures")
      .def(py::init([](const Array<std::uint32_t>& faces, std::size_t n_vertices) {
             return std::make_unique<CoarseFeatures>(rows<Face>(faces), n_vertices);
           }),
           "faces"_a, "n_vertices"_a)
      .def(
          "bounds",
          [](const CoarseFeatures& c, const Array<std::uint32_t>& vf, const Array<std::uint32_t>& ee,
             const Array<double>& of_faces) {
            return copied<double>(c.bounds(rows<std::array<std::uint32_t, 2>>(vf),
                                           rows<std::array<std::uint32_t, 4>>(ee), rows<double>(of_faces)));
          },
          "vf"_a, "ee"_a, "of_faces"_a);

  // Its part of Contacts::hash, of edge-face pairs at the start.
  m.def(
      "hash_of_intersections",
      [](const Array<std::uint32_t>& ef) {
        std::uint64_t sum = 0;
        for (const auto& [a, b, face] : rows<std::array<std::uint32_t, 3>>(ef))
          sum += hash_of(Kind::edge_face, pack(a, b), face, 0);
        return sum;
      },
      "ef"_a);
  m.def(
      "require_static_at_rest",
      [](const Scene& scene, const py::array& t0, const py::array& t1) {
        const Positions start = positions(t0), end = positions(t1);
        const py::gil_scoped_release release;
        require_static_meshes_rest(scene, start, end);
      },
      "scene"_a, "vertices_t0"_a, "vertices_t1"_a);
}

}  // namespace hpccd
