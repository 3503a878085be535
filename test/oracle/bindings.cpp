// SPDX-License-Identifier: Apache-2.0
// Python module _oracle: conversion only. Arguments are checked in the Python files, which call it.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <limits>
#include <sstream>
#include <string>

#include "brute_force.h"
#include "distance.h"
#include "earliest.h"
#include "edge_face_point.h"
#include "elementary.h"
#include "intersection.h"
#include "parallel.h"
#include "separation.h"
#include "translation.h"
#include "winding.h"

namespace py = pybind11;

namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

template <class Row, class T>
std::vector<Row> rows(const Array<T>& array) {
  std::vector<Row> copy(static_cast<std::size_t>(array.shape(0)));
  std::memcpy(copy.data(), array.data(), copy.size() * sizeof(Row));
  return copy;
}

template <class Row>
auto columns(const std::vector<Row>& rows) {
  using T = typename Row::value_type;
  py::array_t<T> array({rows.size(), std::tuple_size_v<Row>});
  std::memcpy(array.mutable_data(), rows.data(), rows.size() * sizeof(Row));
  return array;
}

template <class T>
py::array_t<T> column(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

// of(i) for each i < count, on the given number of threads.
template <class T, class Of>
py::array_t<T> computed(std::size_t count, unsigned threads, const Of& of) {
  py::array_t<T> array(static_cast<py::ssize_t>(count));
  T* values = array.mutable_data();
  {
    py::gil_scoped_release release;
    oracle::parallel_for(count, threads, [&](std::size_t i) { values[i] = of(i); });
  }
  return array;
}

// Times of queries (Q,8,3); +inf for none.
template <class Test>
auto times(Test test) {
  return [test](const Array<double>& queries, unsigned threads) {
    const auto list = rows<oracle::Query>(queries);
    return computed<double>(list.size(), threads, [&](std::size_t i) {
      return test(list[i]).value_or(std::numeric_limits<double>::infinity());
    });
  };
}

template <class Test>
auto times_within(Test test) {
  return [test](const Array<double>& queries, const Array<double>& distances, unsigned threads) {
    const auto list = rows<oracle::Query>(queries);
    const auto d = rows<double>(distances);
    return computed<double>(list.size(), threads, [&](std::size_t i) {
      return test(list[i], d[i]).value_or(std::numeric_limits<double>::infinity());
    });
  };
}

// Results about points (Q,4,3) or (Q,5,3) at rest.
template <class T, class Points, class Of>
auto at_rest(Of of) {
  return [of](const Array<double>& points, unsigned threads) {
    const auto list = rows<Points>(points);
    return computed<T>(list.size(), threads, [&](std::size_t i) { return of(list[i]); });
  };
}

template <class Of>
auto within(Of of) {
  return [of](const Array<double>& points, const Array<double>& distances, unsigned threads) {
    const auto list = rows<oracle::Points>(points);
    const auto d = rows<double>(distances);
    return computed<bool>(list.size(), threads, [&](std::size_t i) { return of(list[i], d[i]); });
  };
}

// Numerator and denominator in hexadecimal, and the exponent of 4: for one set of points.
template <class Of>
auto squared(Of of) {
  return [of](const Array<double>& points) {
    const auto text = [](const oracle::Integer& n) {
      std::ostringstream out;
      out << std::hex << n;
      return out.str();
    };
    const oracle::SquaredDistance square = of(rows<oracle::Points>(points).at(0));
    return py::make_tuple(text(square.numerator), text(square.denominator), square.exponent);
  };
}

using Tested = std::vector<std::vector<std::uint8_t>>;

oracle::Meshes meshes_of(const Array<std::uint32_t>& faces, const Array<std::uint32_t>& edges,
                         const std::vector<std::uint32_t>& mesh_of_vertex, const Tested& tested) {
  return {rows<oracle::Face>(faces), rows<oracle::Edge>(edges), mesh_of_vertex, tested};
}

oracle::OneMesh one_mesh(const Array<double>& vertices, const Array<std::uint32_t>& faces, bool closed) {
  return {rows<oracle::Point>(vertices), rows<oracle::Triangle>(faces), closed};
}

template <class Of>
auto without_gil(Of of) {
  py::gil_scoped_release release;
  return of();
}

py::tuple arrays(const oracle::Pairs& pairs) {
  return py::make_tuple(columns(pairs.vf), column(pairs.vf_value), columns(pairs.ee), column(pairs.ee_value));
}

}  // namespace

PYBIND11_MODULE(_oracle, m) {
  using oracle::Meshes, oracle::Point, oracle::Points;
  m.def("vertex_face", times(oracle::vertex_face));
  m.def("edge_edge", times(oracle::edge_edge));
  m.def("separation_vertex_face", times_within(oracle::separation_vertex_face));
  m.def("separation_edge_edge", times_within(oracle::separation_edge_edge));
  m.def("distance_vertex_face", at_rest<double, Points>(oracle::distance_vertex_face));
  m.def("distance_edge_edge", at_rest<double, Points>(oracle::distance_edge_edge));
  m.def("within_vertex_face", within(oracle::within_vertex_face));
  m.def("within_edge_edge", within(oracle::within_edge_edge));
  m.def("squared_distance_vertex_face", squared(oracle::squared_distance_vertex_face));
  m.def("squared_distance_edge_edge", squared(oracle::squared_distance_edge_edge));
  m.def("edge_face_intersect", at_rest<bool, std::array<Point, 5>>(oracle::edge_face_intersect));

  py::class_<Meshes>(m, "Meshes").def(py::init(&meshes_of));
  m.def("contacts", [](const Meshes& meshes, const Array<double>& t0, const Array<double>& t1,
                       const oracle::Separations& separations, unsigned threads) {
    const auto first = rows<Point>(t0), second = rows<Point>(t1);
    return arrays(without_gil([&] { return oracle::contacts(meshes, first, second, separations, threads); }));
  });
  // Positions (N,V,3) of N steps, and a distance for each.
  m.def("earliest_contacts", [](const Meshes& meshes, const Array<double>& t0, const Array<double>& t1,
                                const Array<double>& distances, unsigned threads) {
    const auto n_vertices = static_cast<std::size_t>(t0.shape(1));
    const auto of_step = [n_vertices](const Array<double>& positions, std::size_t i) {
      std::vector<Point> points(n_vertices);
      std::memcpy(points.data(), positions.data() + 3 * n_vertices * i, n_vertices * sizeof(Point));
      return points;
    };
    return computed<double>(static_cast<std::size_t>(t0.shape(0)), threads, [&](std::size_t i) {
      return oracle::earliest_contact(meshes, of_step(t0, i), of_step(t1, i), distances.data()[i]);
    });
  });
  m.def("proximity", [](const Meshes& meshes, const Array<double>& vertices, double distance, unsigned threads) {
    const auto positions = rows<Point>(vertices);
    return arrays(without_gil([&] { return oracle::proximity(meshes, positions, distance, threads); }));
  });
  m.def("intersections", [](const Meshes& meshes, const Array<double>& vertices, unsigned threads) {
    const auto positions = rows<Point>(vertices);
    return columns(without_gil([&] { return oracle::intersections(meshes, positions, threads); }));
  });
  m.def("smallest_distances", [](const Meshes& meshes, const Array<double>& vertices, unsigned threads) {
    const auto positions = rows<Point>(vertices);
    py::list list;
    for (const oracle::Gap& gap : without_gil([&] { return oracle::smallest_distances(meshes, positions, threads); }))
      list.append(py::make_tuple(gap.mesh_a, gap.mesh_b, gap.distance, gap.intersect));
    return list;
  });
  m.def("winding_numbers", [](const Array<double>& vertices, const Array<std::uint32_t>& faces,
                              const Array<double>& points, unsigned threads) {
    const auto mesh = one_mesh(vertices, faces, true);
    const auto at = rows<Point>(points);
    const auto found = without_gil([&] { return oracle::winding_numbers(mesh.vertices, mesh.faces, at, threads); });
    return py::make_tuple(column(found.numbers), column(found.on_surface));
  });
  py::class_<oracle::OneMesh>(m, "OneMesh").def(py::init(&one_mesh));
  using MeshPair = std::pair<oracle::OneMesh, oracle::OneMesh>;
  m.def("separating_translations",
        [](const std::vector<MeshPair>& pairs, const Array<double>& directions, unsigned threads) {
          const auto d = rows<Point>(directions);
          return computed<double>(pairs.size(), threads, [&](std::size_t i) {
            return oracle::separating_translation(pairs[i].first, pairs[i].second, d[i]);
          });
        });
  m.def("convex_depths", [](const std::vector<MeshPair>& pairs, unsigned threads) {
    return computed<double>(pairs.size(), threads,
                            [&](std::size_t i) { return oracle::convex_depth(pairs[i].first, pairs[i].second); });
  });
  // (Q,7): edge parameter, barycentric coordinates, point; NaN where edge and face share no point.
  m.def("edge_face_points", [](const Array<double>& points, unsigned threads) {
    std::array<double, 7> none;
    none.fill(std::numeric_limits<double>::quiet_NaN());
    const auto list = rows<std::array<Point, 5>>(points);
    std::vector<std::array<double, 7>> found(list.size(), none);
    without_gil([&] {
      oracle::parallel_for(list.size(), threads,
                           [&](std::size_t i) { found[i] = oracle::edge_face_point(list[i]).value_or(none); });
      return 0;
    });
    return columns(found);
  });
}
