// SPDX-License-Identifier: Apache-2.0
#include "bindings_device.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "contacts/gap_fields.h"
#include "gpu/download.h"
#include "gpu/results_to_device.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace hpccd {
namespace {

// DLPack's structures, version 0.x (the ABI of capsules named "dltensor").
struct DLDevice {
  std::int32_t type, id;
};
struct DLTensor {
  void* data;
  DLDevice device;
  std::int32_t ndim;
  struct {
    std::uint8_t code, bits;
    std::uint16_t lanes;
  } dtype;
  std::int64_t *shape, *strides;
  std::uint64_t byte_offset;
};
struct DLManagedTensor {
  DLTensor tensor;
  void* context;
  void (*deleter)(DLManagedTensor*);
};
constexpr std::int32_t on_cuda = 2;

// A C-contiguous array in a device's memory, which is held as long as there are references to it.
struct DeviceArray {
  std::shared_ptr<const void> memory;
  const void* data;
  std::vector<std::int64_t> shape;
  char kind;  // 'u', 'i' or 'f'
  int item_bytes, device;

  std::int64_t size() const {
    std::int64_t n = 1;
    for (const std::int64_t s : shape) n *= s;
    return n;
  }
  std::string type() const { return std::string("<") + kind + std::to_string(item_bytes); }
};

// The same memory, freed without the interpreter's lock: freeing waits for the device, which may wait for functions
// that other Python threads run.
std::shared_ptr<const void> freed_unlocked(std::shared_ptr<const void> memory) {
  const void* data = memory.get();
  return {data, [memory = std::move(memory)](const void*) mutable {
            if (!PyGILState_Check()) return memory.reset();
            py::gil_scoped_release release;
            memory.reset();
          }};
}

py::dict interface_of(const DeviceArray& a) {
  py::dict d;
  d["shape"] = py::tuple(py::cast(a.shape));
  d["typestr"] = a.type();
  d["data"] = py::make_tuple(a.size() ? reinterpret_cast<std::uintptr_t>(a.data) : 0, false);
  d["version"] = 3;
  d["strides"] = py::none();
  d["stream"] = py::none();  // its contents are complete
  return d;
}

struct Exported {
  DeviceArray array;
  DLManagedTensor managed;
};

py::capsule dlpack_of(const DeviceArray& a) {
  auto* e = new Exported{a, {}};
  const std::uint8_t code = a.kind == 'f' ? 2 : a.kind == 'u' ? 1 : 0;
  e->managed.tensor = {const_cast<void*>(a.data),
                       {on_cuda, a.device},
                       static_cast<std::int32_t>(a.shape.size()),
                       {code, static_cast<std::uint8_t>(8 * a.item_bytes), 1},
                       e->array.shape.data(),
                       nullptr,
                       0};
  e->managed.context = e;
  e->managed.deleter = [](DLManagedTensor* m) { delete static_cast<Exported*>(m->context); };
  return py::capsule(&e->managed, "dltensor", [](PyObject* capsule) {
    // A consumer renames the capsule when it takes the array, and calls the deleter itself.
    if (!PyCapsule_IsValid(capsule, "dltensor")) return;
    auto* m = static_cast<DLManagedTensor*>(PyCapsule_GetPointer(capsule, "dltensor"));
    m->deleter(m);
  });
}

// Rows [begin, end), without a copy.
DeviceArray rows_of(const DeviceArray& a, std::int64_t begin, std::int64_t end) {
  if (begin < 0 || end < begin || a.shape.empty() || end > a.shape[0]) throw py::index_error("rows: out of range");
  DeviceArray part = a;
  const std::int64_t row = a.shape[0] ? a.size() / a.shape[0] * a.item_bytes : 0;
  part.data = static_cast<const unsigned char*>(a.data) + begin * row;
  part.shape[0] = end - begin;
  return part;
}

// Row k, without a copy and without the first axis.
DeviceArray row_of(const DeviceArray& a, std::int64_t k) {
  if (k < 0 || a.shape.empty() || k >= a.shape[0]) throw py::index_error("row: out of range");
  DeviceArray row = rows_of(a, k, k + 1);
  row.shape.erase(row.shape.begin());
  return row;
}

// Allocation and copies may wait for the device: other Python threads continue meanwhile.
std::shared_ptr<const void> copied_there(const void* a, std::size_t a_bytes, const void* b, std::size_t b_bytes,
                                         int device) {
  py::gil_scoped_release release;
  return freed_unlocked(gpu::joined_on_device(a, a_bytes, b, b_bytes, device));
}

DeviceArray joined(const DeviceArray& a, const DeviceArray& b) {
  if (a.shape.empty() || b.shape.empty()) throw py::type_error("joined: an array without axes has no rows");
  const auto bytes = [](const DeviceArray& x) {
    return static_cast<std::size_t>(x.size()) * static_cast<std::size_t>(x.item_bytes);
  };
  DeviceArray both = a;
  both.memory = copied_there(a.data, bytes(a), b.data, bytes(b), a.device);
  both.data = both.memory.get();
  both.shape[0] += b.shape[0];
  return both;
}

DeviceArray of_integers(const std::vector<std::int64_t>& numbers, int device) {
  auto memory = copied_there(numbers.data(), numbers.size() * sizeof numbers[0], nullptr, 0, device);
  const void* data = memory.get();
  return {std::move(memory), data, {static_cast<std::int64_t>(numbers.size())}, 'i', 8, device};
}

py::array to_host(const DeviceArray& a) {
  py::array to(py::dtype(a.type()), std::vector<py::ssize_t>(a.shape.begin(), a.shape.end()));
  void* p = to.mutable_data();
  {
    py::gil_scoped_release release;
    gpu::download(a.data, p, static_cast<std::size_t>(a.size()) * static_cast<std::size_t>(a.item_bytes));
  }
  return to;
}

// Otherwise numpy silently makes an array of one object.
[[noreturn]] void refuse_numpy(const DeviceArray&, const py::object&, const py::object&) {
  throw py::type_error("numpy: this array is in a GPU's memory, which numpy cannot read; .to_host() gives a copy");
}

}  // namespace

void bind_device_array(py::module_& m) {
  py::class_<DeviceArray>(m, "DeviceArray", R"(A C-contiguous array in a GPU's memory, which results hold.

CuPy, PyTorch, Numba and Warp take it in place, by CUDA array interface or DLPack. Arrays made of it keep its memory
alive. Its contents are complete when a query returns.

Attributes
----------
shape : tuple of int
dtype : numpy.dtype
    int32, uint32, int64, uint64 or float64.
device : int
    Number of the GPU in CUDA.

Raises
------
TypeError
    By ``numpy.asarray``, which cannot read this memory; :meth:`to_host` gives a copy. Also by ``DeviceArray()``:
    results of a Detector with results="device" hold them.
BufferError
    By ``__dlpack__``, if a copy or another device is requested.

Examples
--------
With a GPU and CuPy::

    contacts = hc.Detector(scene, results="device").detect(vertices_t0, vertices_t1)
    vf = cupy.asarray(contacts.vf)               # in place
    toc = torch.from_dlpack(contacts.vf_toc)     # in place
    ee = contacts.ee.to_host()                   # a numpy array
)")
      .def_property_readonly(
          "shape", [](const DeviceArray& a) { return py::tuple(py::cast(a.shape)); }, "Number of elements by axis.")
      .def_property_readonly(
          "dtype", [](const DeviceArray& a) { return py::dtype(a.type()); }, "numpy.dtype of the elements.")
      .def_property_readonly(
          "device", [](const DeviceArray& a) { return a.device; }, "Number of the GPU in CUDA.")
      .def("__len__",
           [](const DeviceArray& a) {
             if (a.shape.empty()) throw py::type_error("len() of an array without axes");
             return a.shape[0];
           })
      .def_property_readonly("__cuda_array_interface__", &interface_of)
      .def("__array__", &refuse_numpy, py::arg("dtype") = py::none(), py::arg("copy") = py::none())
      .def("__dlpack_device__", [](const DeviceArray& a) { return py::make_tuple(on_cuda, a.device); })
      .def(
          "__dlpack__",
          [](const DeviceArray& a, const py::object&, const py::object&, const py::object& device,
             const py::object& copy) {
            if (!copy.is_none() && copy.cast<bool>())
              throw py::buffer_error("copy: these arrays are given out as they are; copy what from_dlpack returns");
            if (!device.is_none() && !device.equal(py::make_tuple(on_cuda, a.device)))
              throw py::buffer_error("dl_device: the array stays on its device; to_host() gives a numpy array");
            return dlpack_of(a);
          },
          py::kw_only(), py::arg("stream") = py::none(), py::arg("max_version") = py::none(),
          py::arg("dl_device") = py::none(), py::arg("copy") = py::none())
      .def("rows", &rows_of, py::arg("begin"), py::arg("end"),
           R"(Rows [begin, end), in place.

Parameters
----------
begin, end : int
    0 <= begin <= end <= len(self).

Returns
-------
DeviceArray

Raises
------
IndexError
    If the rows are out of range.
)")
      .def("row", &row_of, py::arg("k"), R"(Row k, in place, without the first axis.

Parameters
----------
k : int
    0 <= k < len(self).

Returns
-------
DeviceArray

Raises
------
IndexError
    If there is no such row.
)")
      .def(
          "seen_as", [](DeviceArray a, char kind) { return a.kind = kind, a; }, py::arg("kind"),
          R"(The same memory read as another kind of number of the same size.

Parameters
----------
kind : {"u", "i", "f"}
    Unsigned, signed or floating point.

Returns
-------
DeviceArray
)")
      .def("joined", &joined, py::arg("other"), R"(A copy of the rows of this array, then of another one.

Parameters
----------
other : DeviceArray
    Of the same dtype, row shape and device, which is not checked.

Returns
-------
DeviceArray

Raises
------
RuntimeError
    If the GPU fails.
)")
      .def("to_host", &to_host, R"(A copy as a numpy array; waits for it.

Returns
-------
ndarray
    Of the same shape and dtype.

Raises
------
RuntimeError
    If the GPU fails.
)")
      .def("__repr__", [](const DeviceArray& a) {
        return "DeviceArray(shape=" + std::string(py::str(py::tuple(py::cast(a.shape)))) +
               ", dtype=" + std::string(py::str(py::dtype(a.type()))) + ", device=" + std::to_string(a.device) + ")";
      });
  m.def("integers_on_device", &of_integers, py::arg("numbers"), py::arg("device"));
}

py::dict to_dict(const DeviceResults& r, std::uint32_t n_worlds) {
  const std::shared_ptr<const void> memory = freed_unlocked(r.memory);
  const auto array = [&](const void* data, char kind, int item_bytes, std::vector<std::int64_t> shape) {
    return py::cast(DeviceArray{memory, data, std::move(shape), kind, item_bytes, r.device});
  };
  const auto n_vf = static_cast<std::int64_t>(r.n_vf), n_ee = static_cast<std::int64_t>(r.n_ee),
             n_ef = static_cast<std::int64_t>(r.n_ef);
  py::dict d;
  d["vf"] = array(r.vf, 'u', 4, {n_vf, 2});
  d["ee"] = array(r.ee, 'u', 4, {n_ee, 4});
  d["ef"] = array(r.ef, 'u', 4, {n_ef, 3});
  d["vf_values"] = array(r.values, 'f', 8, {n_vf});
  d["ee_values"] = array(r.values ? r.values + n_vf : nullptr, 'f', 8, {n_ee});
  const auto places = [&](const void* p, std::vector<std::int64_t> row, char kind = 'f', int item_bytes = 8) {
    row.insert(row.begin(), p ? n_vf + n_ee : 0);
    return array(p, kind, item_bytes, std::move(row));
  };
  d["points"] = places(r.points, {3});
  d["normals"] = places(r.normals, {3});
  d["closest"] = places(r.closest, {2, 3});
  d["vertices"] = places(r.vertices, {4}, 'u', 4);
  d["weights"] = places(r.weights, {4});
  d["approach"] = places(r.approach, {});
  d["first_toc"] = r.first_toc;
  d["hash"] = r.hash;
  d["slices"] = py::none();
  if (!r.hashes) return d;
  const std::int64_t worlds = n_worlds;
  const auto of_worlds = [&](const void* p, char kind, std::int64_t n) -> py::object {
    return p ? array(p, kind, 8, {n}) : py::none();
  };
  d["slices"] = py::dict(py::arg("vf") = of_worlds(r.vf_offsets, 'i', worlds + 1),
                         py::arg("ee") = of_worlds(r.ee_offsets, 'i', worlds + 1),
                         py::arg("ef") = of_worlds(r.ef_offsets, 'i', worlds + 1),
                         py::arg("hashes") = of_worlds(r.hashes, 'u', worlds),
                         py::arg("first_tocs") = of_worlds(r.first_tocs, 'f', worlds));
  return d;
}

py::dict to_dict(const std::vector<Gap>& gaps, std::uint32_t n_worlds, std::optional<int> device) {
  std::shared_ptr<const GapFields> packed;
  std::shared_ptr<const void> there;
  {
    py::gil_scoped_release release;
    packed = std::make_shared<const GapFields>(gaps);
    if (device)
      there =
          freed_unlocked(gpu::joined_on_device(packed->block().data(), packed->block().size(), nullptr, 0, *device));
  }
  const auto* begin = static_cast<const unsigned char*>(device ? there.get() : packed->block().data());
  const std::size_t n_pairs = gaps.size() / n_worlds;
  py::dict d;
  for (const GapFields::Field& f : packed->fields()) {
    DeviceArray a{there,  begin + f.begin, {n_worlds, static_cast<std::int64_t>(n_pairs)},
                  f.kind, f.item_bytes,    device.value_or(-1)};
    a.shape.insert(a.shape.end(), f.row.begin(), f.row.end());
    if (device) {
      d[f.name] = a;
      continue;
    }
    const py::capsule owner(new auto(packed),
                            [](void* p) { delete static_cast<std::shared_ptr<const GapFields>*>(p); });
    d[f.name] = py::array(py::dtype(a.type()), std::vector<py::ssize_t>(a.shape.begin(), a.shape.end()), a.data, owner);
  }
  py::list pairs;
  for (std::size_t i = 0; i < n_pairs; ++i) pairs.append(py::make_tuple(gaps[i].mesh_a, gaps[i].mesh_b));
  d["pairs"] = pairs;
  return d;
}

namespace {

// The output arrays of a prepared detection.
py::dict arrays_of(const PreparedDetection& d, std::uint32_t n_worlds) {
  const PreparedResults& p = d.results();
  const std::shared_ptr<const void> memory = freed_unlocked(p.memory);
  const auto array = [&](const void* data, char kind, int item_bytes, std::vector<std::int64_t> shape) {
    return py::cast(DeviceArray{memory, data, std::move(shape), kind, item_bytes, p.device});
  };
  const auto n_vf = static_cast<std::int64_t>(p.room_vf), n_ee = static_cast<std::int64_t>(p.room_ee);
  const auto* counts = reinterpret_cast<const unsigned char*>(p.counts);
  py::dict a("vf"_a = array(p.vf, 'u', 4, {n_vf, 2}), "ee"_a = array(p.ee, 'u', 4, {n_ee, 4}),
             "toc"_a = array(p.tocs, 'f', 8, {n_vf + n_ee}),
             "counts"_a = array(counts + offsetof(PreparedCounts, vertex_face), 'i', 8, {3}),
             "hash"_a = array(counts + offsetof(PreparedCounts, hash), 'u', 8, {1}),
             "first_toc"_a = array(counts + offsetof(PreparedCounts, first_toc), 'f', 8, {1}));
  const std::int64_t worlds = n_worlds;
  const auto of_worlds = [&](const void* data, char kind, std::int64_t n) -> py::object {
    return data ? array(data, kind, 8, {n}) : py::none();
  };
  a["vf_offsets"] = of_worlds(p.vf_offsets, 'i', worlds + 1);
  a["ee_offsets"] = of_worlds(p.ee_offsets, 'i', worlds + 1);
  a["hashes"] = of_worlds(p.hashes, 'u', worlds);
  a["first_tocs"] = of_worlds(p.first_tocs, 'f', worlds);
  const auto output = [&](const char* name, const void* data, std::vector<std::int64_t> row, char kind = 'f',
                          int item_bytes = 8) {
    if (!data) return;
    row.insert(row.begin(), n_vf + n_ee);
    a[name] = array(data, kind, item_bytes, std::move(row));
  };
  output("points", p.points, {3}), output("normals", p.normals, {3}), output("closest", p.closest, {2, 3});
  output("vertices", p.vertices, {4}, 'u', 4), output("weights", p.weights, {4}), output("approach", p.approach, {});
  return a;
}

}  // namespace

void bind_prepared(py::module_& m) {
  py::class_<PreparedDetection>(m, "PreparedDetection")
      .def(
          "enqueue", [](PreparedDetection& d, std::uintptr_t stream) { d.enqueue(reinterpret_cast<void*>(stream)); },
          "stream"_a, py::call_guard<py::gil_scoped_release>())
      .def(
          "contacts",
          [](const PreparedDetection& d, std::uint32_t n_worlds) {
            const DeviceResults r = [&] {
              py::gil_scoped_release release;
              return d.contacts();
            }();
            return to_dict(r, n_worlds);
          },
          "n_worlds"_a)
      .def("arrays", &arrays_of, "n_worlds"_a);
}

}  // namespace hpccd
