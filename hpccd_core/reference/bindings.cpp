// SPDX-License-Identifier: Apache-2.0
// Python module _reference: conversion only. Arguments are checked in __init__.py, which calls it.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <limits>

#include "brute_force.h"
#include "elementary.h"
#include "parallel.h"

namespace py = pybind11;
namespace reference = hpccd::reference;

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

template <class Test>
py::tuple run(const Array<double>& queries, unsigned threads, Test test) {
  const auto list = rows<reference::Query>(queries);
  py::array_t<bool> hit(static_cast<py::ssize_t>(list.size()));
  py::array_t<double> toc(static_cast<py::ssize_t>(list.size()));
  bool* hits = hit.mutable_data();
  double* tocs = toc.mutable_data();
  {
    py::gil_scoped_release release;
    reference::parallel_for(list.size(), threads, [&](std::size_t i) {
      const auto time = test(list[i]);
      hits[i] = time.has_value();
      tocs[i] = time.value_or(std::numeric_limits<double>::infinity());
    });
  }
  return py::make_tuple(hit, toc);
}

py::dict brute_force(const Array<double>& vertices_t0, const Array<double>& vertices_t1,
                     const Array<std::uint32_t>& faces, const std::vector<std::uint32_t>& mesh_of_vertex,
                     const std::vector<std::vector<std::uint8_t>>& tested, unsigned threads) {
  const reference::Scene scene{rows<reference::Point>(vertices_t0), rows<reference::Point>(vertices_t1),
                               rows<reference::Face>(faces), mesh_of_vertex, tested};
  reference::Contacts contacts;
  {
    py::gil_scoped_release release;
    contacts = reference::brute_force(scene, threads);
  }
  py::dict result;
  result["vf"] = columns(contacts.vf);
  result["vf_toc"] = py::array_t<double>(static_cast<py::ssize_t>(contacts.vf_toc.size()), contacts.vf_toc.data());
  result["ee"] = columns(contacts.ee);
  result["ee_toc"] = py::array_t<double>(static_cast<py::ssize_t>(contacts.ee_toc.size()), contacts.ee_toc.data());
  return result;
}

}  // namespace

PYBIND11_MODULE(_reference, m) {
  m.def("vertex_face",
        [](const Array<double>& queries, unsigned threads) { return run(queries, threads, reference::vertex_face); });
  m.def("edge_edge",
        [](const Array<double>& queries, unsigned threads) { return run(queries, threads, reference::edge_edge); });
  m.def("brute_force", &brute_force);
}
