// SPDX-License-Identifier: Apache-2.0
// Computations for the joints of a robot take microseconds, less than reacquiring the interpreter lock: the lock is
// kept, except for many vertices.
#include "bindings_rigid.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstring>
#include <optional>
#include <utility>

#include "hpccd/errors.h"
#include "rigid/joint_bounds.h"
#include "rigid/joint_chain.h"
#include "rigid/placed_vertices.h"

namespace hpccd {
namespace {

namespace py = pybind11;
using namespace py::literals;
using namespace rigid;

using Doubles = py::array_t<double, py::array::c_style>;

constexpr std::size_t many_vertices = 10'000;

// The layout that Python sees: rows of numbers.
static_assert(sizeof(Vector) == 3 * sizeof(double) && sizeof(rigid::Pose) == 7 * sizeof(double));

std::span<const double> numbers(const Doubles& a) { return {a.data(), static_cast<std::size_t>(a.size())}; }

// float64 arrays in place; other arrays and numbers if float64 can hold them exactly. Errors name the argument.
Doubles doubles(const char* name, const py::object& given) {
  // Not for subclasses: a masked array is more than its numbers.
  const bool plain = Py_TYPE(given.ptr()) == py::detail::npy_api::get().PyArray_Type_;
  if (plain && py::isinstance<py::array_t<double>>(given)) return Doubles(py::reinterpret_borrow<py::array>(given));
  return Doubles(py::module_::import("hpccd_core.arguments").attr("reals")(name, given));
}
double real(const char* name, const py::object& given) {
  if (PyFloat_Check(given.ptr())) return PyFloat_AS_DOUBLE(given.ptr());
  return py::cast<double>(py::module_::import("hpccd_core.arguments").attr("real")(name, given));
}

template <class Row>
std::span<const Row> rows(const char* name, const Doubles& a) {
  if (a.size() * sizeof(double) % sizeof(Row))
    throw InvalidArgument(std::string(name) + ": expected rows of " + std::to_string(sizeof(Row) / sizeof(double)));
  return {reinterpret_cast<const Row*>(a.data()), a.size() * sizeof(double) / sizeof(Row)};
}

template <class Row>
Row row(const char* name, const Doubles& a) {
  const auto all = rows<Row>(name, a);
  if (all.size() != 1)
    throw InvalidArgument(std::string(name) + ": expected " + std::to_string(sizeof(Row) / sizeof(double)) +
                          " numbers");
  return all.front();
}

// The numbers of a joint, as a row of an array.
struct JointRow {
  rigid::Pose origin;
  Vector axis;
  double offset;
};

std::shared_ptr<JointChain> chain_of(const std::vector<JointKind>& kinds, const std::vector<int>& parents,
                                     const py::object& given) {
  const Doubles array = doubles("numbers", given);
  const auto joint_rows = rows<JointRow>("numbers", array);
  if (parents.size() != kinds.size() || joint_rows.size() != kinds.size())
    throw InvalidArgument("kinds, parents, numbers: expected as many of each");
  std::vector<Joint> joints;
  joints.reserve(kinds.size());
  for (std::size_t k = 0; k < kinds.size(); ++k)
    joints.push_back({kinds[k], parents[k], joint_rows[k].origin, joint_rows[k].axis, joint_rows[k].offset});
  return std::make_shared<JointChain>(std::move(joints));
}

rigid::Pose pose_of(const py::object& turn, const py::object& shift) {
  return {row<Quaternion>("turn", doubles("turn", turn)), row<Vector>("shift", doubles("shift", shift))};
}

Doubles poses_of(const JointChain& chain, const py::object& values, const py::object& turn, const py::object& shift) {
  const std::vector<rigid::Pose> poses = chain.poses(numbers(doubles("values", values)), pose_of(turn, shift));
  Doubles found({poses.size(), std::size_t{7}});
  std::memcpy(found.mutable_data(), poses.data(), poses.size() * sizeof(rigid::Pose));
  return found;
}

Doubles placed(const py::object& given_poses, const std::vector<std::pair<std::size_t, std::size_t>>& meshes,
               const py::object& given_vertices) {
  const Doubles poses = doubles("poses", given_poses), vertices = doubles("vertices", given_vertices);
  const auto pose_rows = rows<rigid::Pose>("poses", poses);
  const auto from = rows<Vector>("vertices", vertices);
  std::vector<LinkMesh> of_links;
  of_links.reserve(meshes.size());
  for (const auto& [link, end] : meshes) of_links.push_back({link, end});
  Doubles found({from.size(), std::size_t{3}});
  const std::span<Vector> to{reinterpret_cast<Vector*>(found.mutable_data()), from.size()};
  std::optional<py::gil_scoped_release> release;
  if (from.size() > many_vertices) release.emplace();
  place_vertices(pose_rows, of_links, from, to);
  return found;
}

}  // namespace

void bind_rigid(py::module_& m) {
  py::enum_<JointKind>(m, "JointKind")
      .value("fixed", JointKind::fixed)
      .value("turning", JointKind::turning)
      .value("sliding", JointKind::sliding);
  py::class_<JointChain, std::shared_ptr<JointChain>>(m, "JointChain")
      .def(py::init(&chain_of), "kinds"_a, "parents"_a, "numbers"_a)
      .def("poses", &poses_of, "values"_a, "turn"_a, "shift"_a);
  py::class_<JointBounds>(m, "JointBounds")
      .def(py::init([](std::shared_ptr<JointChain> chain, const py::object& start, const py::object& end,
                       const py::object& turn, const py::object& shift) {
             return JointBounds(std::move(chain), numbers(doubles("start", start)), numbers(doubles("end", end)),
                                pose_of(turn, shift));
           }),
           "chain"_a.none(false), "start"_a, "end"_a, "turn"_a, "shift"_a)
      .def(
          "of_link",
          [](const JointBounds& bounds, std::size_t link, const py::object& radius, const py::object& girth,
             const py::object& centre) {
            const LinkBounds found = bounds.of_link(
                link, {real("radius", radius), real("girth", girth), row<Vector>("centre", doubles("centre", centre))});
            return py::make_tuple(found.acceleration, found.span, found.rounding);
          },
          "link"_a, "radius"_a, "girth"_a, "centre"_a);
  m.def("placed", &placed, "poses"_a, "meshes"_a, "vertices"_a);
}

}  // namespace hpccd
