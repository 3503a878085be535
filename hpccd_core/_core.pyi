# SPDX-License-Identifier: Apache-2.0
"""The compiled module (src/bindings.cpp and its neighbours). test/packaging/test_core_stub.py compares names and
arguments with it, and names the command that prints the stub of pybind11."""

from collections.abc import Sequence
from typing import Any, ClassVar, NoReturn, NotRequired, TypedDict, overload

import numpy as np
from numpy.typing import NDArray

from .devices import GpuStatus

__version__: str
MOST_WORLDS: int

class InvalidArgument(ValueError): ...
class Cancelled(RuntimeError): ...

class _Enumeration:
    __members__: ClassVar[dict[str, Any]]
    def __init__(self, value: int) -> None: ...
    def __index__(self) -> int: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Accuracy(_Enumeration):
    fast: ClassVar[Accuracy]
    balanced: ClassVar[Accuracy]
    conservative: ClassVar[Accuracy]
    exact: ClassVar[Accuracy]

class Backend(_Enumeration):
    auto: ClassVar[Backend]
    cpu: ClassVar[Backend]
    hybrid: ClassVar[Backend]
    gpu: ClassVar[Backend]

class Report(_Enumeration):
    all: ClassVar[Report]
    first: ClassVar[Report]
    any: ClassVar[Report]

class Method(_Enumeration):
    default: ClassVar[Method]
    published: ClassVar[Method]
    naive: ClassVar[Method]
    front: ClassVar[Method]

class Simd(_Enumeration):
    auto: ClassVar[Simd]
    scalar: ClassVar[Simd]
    avx2: ClassVar[Simd]
    avx512: ClassVar[Simd]
    neon: ClassVar[Simd]

class TestedFeatures:
    def __init__(self, vertex_face: bool, edge_edge: bool) -> None: ...

class Scene:
    def __init__(self) -> None: ...
    def add_mesh(
        self,
        name: str,
        faces: NDArray[np.uint32],
        n_vertices: int,
        self_collision: bool,
        static: bool,
        edges: NDArray[np.uint32],
        points: bool = False,
    ) -> int: ...
    def add_plane(self, name: str, normal: Sequence[float], offset: float, static: bool) -> int: ...
    def ignore_pair(self, mesh_a: int, mesh_b: int) -> None: ...
    def set_accuracy(self, mesh_a: int, mesh_b: int, accuracy: Accuracy) -> None: ...
    def set_separation(self, mesh_a: int, mesh_b: int, separation: float) -> None: ...
    def set_thickness(self, mesh: int, values: NDArray[np.float64]) -> None: ...
    def set_shape(self, mesh: int, vertices: NDArray[np.float64]) -> None: ...
    def set_features(self, mesh_a: int, mesh_b: int, features: TestedFeatures) -> None: ...
    def ignore_rings(self, mesh: int, rings: int) -> None: ...
    def ignore_at_rest(self, mesh: int, vertices: NDArray[np.float64], distance: float) -> None: ...
    def ignore_faces(self, mesh: int, faces: NDArray[np.uint32], other: int) -> None: ...
    def ignore_features(self, vf: NDArray[np.uint32], ee: NDArray[np.uint32], ef: NDArray[np.uint32]) -> None: ...
    @property
    def n_vertices(self) -> int: ...
    @property
    def n_faces(self) -> int: ...
    def first_vertex(self, mesh: int) -> int: ...
    def first_face(self, mesh: int) -> int: ...
    @property
    def n_edges(self) -> int: ...

class _Slices(TypedDict):
    vf: NDArray[np.int64]
    ee: NDArray[np.int64]
    ef: NDArray[np.int64]
    vp: NotRequired[NDArray[np.int64]]  # of scenes with such pairs, as vv and ve
    vv: NotRequired[NDArray[np.int64]]
    ve: NotRequired[NDArray[np.int64]]
    hashes: NDArray[np.uint64]
    first_tocs: NDArray[np.float64]

class _Contacts(TypedDict):
    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    vp: NotRequired[NDArray[np.uint32]]  # where there are rows, as vv and ve
    vp_toc: NotRequired[NDArray[np.float64]]
    vv: NotRequired[NDArray[np.uint32]]
    vv_toc: NotRequired[NDArray[np.float64]]
    ve: NotRequired[NDArray[np.uint32]]
    ve_toc: NotRequired[NDArray[np.float64]]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    closest: NDArray[np.float64]
    vertices: NDArray[np.uint32]
    weights: NDArray[np.float64]
    approach: NDArray[np.float64]
    first_toc: float
    hash: int
    slices: NotRequired[_Slices]  # of several worlds

class _Proximity(TypedDict):
    vf: NDArray[np.uint32]
    vf_distance: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_distance: NDArray[np.float64]
    vp: NotRequired[NDArray[np.uint32]]  # where there are rows, as vv and ve
    vp_distance: NotRequired[NDArray[np.float64]]
    vv: NotRequired[NDArray[np.uint32]]
    vv_distance: NotRequired[NDArray[np.float64]]
    ve: NotRequired[NDArray[np.uint32]]
    ve_distance: NotRequired[NDArray[np.float64]]
    closest: NDArray[np.float64]
    normals: NDArray[np.float64]
    vertices: NDArray[np.uint32]
    weights: NDArray[np.float64]
    hash: int
    slices: NotRequired[_Slices]  # of several worlds

class _Intersections(TypedDict):
    ef: NDArray[np.uint32]
    hash: int
    points: NDArray[np.float64]
    edge_parameters: NDArray[np.float64]
    weights: NDArray[np.float64]
    incidences: NDArray[np.uint8]
    directions: NDArray[np.float64]
    slices: NotRequired[_Slices]  # of several worlds

_Gap = tuple[
    int,
    int,
    float,
    str,
    list[int],
    NDArray[np.float64],
    NDArray[np.uint32],
    NDArray[np.float64],
    NDArray[np.float64],
    str | None,
]

class Positions:
    @overload
    def __init__(self, array: NDArray[Any], made_on: int | None = ...) -> None: ...
    @overload
    def __init__(self, pointer: int, n: int, is_double: bool, made_on: int | None) -> None: ...

_Given = Positions | NDArray[Any]

class DeviceArray:
    """A C-contiguous array in a GPU's memory. Arrays made of it by CUDA array interface or DLPack keep it alive.

    Attributes
    ----------
    shape : tuple of int
    dtype : numpy.dtype
    device : int
        Number of the GPU in CUDA.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None: ...  # raises TypeError: results hold them
    def __len__(self) -> int: ...
    def __array__(self, dtype: object = ..., copy: object = ...) -> NoReturn: ...  # its error names to_host
    def __dlpack__(
        self, *, stream: object = ..., max_version: object = ..., dl_device: object = ..., copy: object = ...
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...
    def rows(self, begin: int, end: int) -> DeviceArray: ...
    def row(self, k: int) -> DeviceArray: ...
    def seen_as(self, kind: str) -> DeviceArray: ...
    def joined(self, other: DeviceArray) -> DeviceArray: ...
    def to_host(self) -> NDArray[Any]: ...
    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def device(self) -> int: ...

class _SlicesOnDevice(TypedDict):
    vf: DeviceArray | None
    ee: DeviceArray | None
    ef: DeviceArray | None
    hashes: DeviceArray
    first_tocs: DeviceArray | None

class _OnDevice(TypedDict):  # result of every query; arrays that a query does not have are empty
    vf: DeviceArray
    ee: DeviceArray
    ef: DeviceArray
    vf_values: DeviceArray
    ee_values: DeviceArray
    points: DeviceArray
    normals: DeviceArray
    closest: DeviceArray
    vertices: DeviceArray
    weights: DeviceArray
    approach: DeviceArray
    first_toc: float
    hash: int
    slices: _SlicesOnDevice | None

_GapArray = DeviceArray | NDArray[Any]  # numpy arrays for results on the host

class _GapArrays(TypedDict):  # (W, P, ...), also of one world
    pairs: list[tuple[int, int]]
    distance: _GapArray
    kind: _GapArray
    features: _GapArray
    points: _GapArray
    vertices: _GapArray
    weights: _GapArray
    normal: _GapArray
    inside: _GapArray

class Options:
    accuracy: Accuracy
    backend: Backend
    report: Report
    simd: Simd
    threads: int
    points: bool
    normals: bool
    closest: bool
    weights: bool
    directions: bool
    minimum_separation: float
    method: Method
    restructure: bool
    hybrid_segments: int
    hybrid_segment_pairs: int
    gpus: int
    gpu_stages: bool
    features: TestedFeatures
    results_on_device: bool
    worlds: int
    def __init__(self) -> None: ...

class Detector:
    def __init__(self, scene: Scene, options: Options) -> None: ...
    def detect(self, vertices_t0: _Given, vertices_t1: _Given) -> _Contacts | _OnDevice: ...
    def prepare(self, vertices_t0: _Given, vertices_t1: _Given, room: float) -> PreparedDetection: ...
    def collision_free_steps(self, vertices_t0: _Given, vertices_t1: _Given) -> NDArray[np.float64]: ...
    def collision_free_motion(
        self, vertices_t0: _Given, vertices_t1: _Given, groups: NDArray[np.int64]
    ) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.uint32]]: ...
    def proximity(self, vertices: _Given, distance: float) -> _Proximity | _OnDevice: ...
    def intersections(self, vertices: _Given) -> _Intersections | _OnDevice: ...
    def distances(self, vertices: _Given) -> list[_Gap]: ...
    def distance_arrays(self, vertices: _Given) -> _GapArrays: ...
    def proximity_at(self, poses: NDArray[np.float64], others: _Given, distance: float) -> _Proximity: ...
    def intersections_at(self, poses: NDArray[np.float64], others: _Given) -> _Intersections: ...
    def distances_at(self, poses: NDArray[np.float64], others: _Given) -> list[_Gap]: ...
    def distance_arrays_at(self, poses: NDArray[np.float64], others: _Given) -> _GapArrays: ...
    def positions_at(self, poses: NDArray[np.float64], others: _Given) -> NDArray[np.float64]: ...
    def winding_numbers(
        self, vertices: _Given, points: _Given, mesh: int
    ) -> tuple[NDArray[np.int32], NDArray[np.bool_]]: ...
    def signed_distances(
        self, vertices: _Given, points: _Given, mesh: int
    ) -> tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]: ...
    def separating_translation(self, vertices: _Given, mesh_a: int, mesh_b: int, direction: list[float]) -> float: ...
    def penetration(
        self, vertices: _Given, mesh_a: int, mesh_b: int, start: list[float] | None
    ) -> tuple[NDArray[np.float64], float, float, str, list[int]]: ...
    def faces(self) -> NDArray[np.uint32]: ...
    def set_separation(self, mesh_a: int, mesh_b: int, separation: float) -> None: ...
    def set_thickness(self, mesh: int, values: NDArray[np.float64]) -> None: ...
    def set_plane(self, plane: int, normal: Sequence[float], offset: float) -> None: ...
    def set_separations(self, of_pairs: NDArray[np.float64]) -> None: ...
    def cancel(self) -> None: ...
    def profile(self) -> dict[str, float]: ...
    def stats(self) -> dict[str, int]: ...
    @property
    def last_backend(self) -> str: ...
    @property
    def last_gpu_error(self) -> str: ...
    @property
    def threads(self) -> int: ...
    @property
    def simd(self) -> str: ...

class PreparedDetection:
    def __init__(self, *args: Any, **kwargs: Any) -> None: ...  # raises TypeError: Detector.prepare makes them
    def enqueue(self, stream: int) -> None: ...
    def contacts(self, n_worlds: int) -> _OnDevice: ...
    def arrays(self, n_worlds: int) -> dict[str, DeviceArray | None]: ...

class JointKind(_Enumeration):
    fixed: ClassVar[JointKind]
    turning: ClassVar[JointKind]
    sliding: ClassVar[JointKind]

class JointChain:
    """The joints of a robot in the order of their tree; parent -1 is the base. numbers (m,11): for each joint the
    quaternion x y z w and the shift of its origin, its axis, and an upper bound on the length of that shift."""

    def __init__(self, kinds: Sequence[JointKind], parents: Sequence[int], numbers: NDArray[np.float64]) -> None: ...
    def poses(
        self, values: NDArray[np.float64], turn: NDArray[np.float64], shift: NDArray[np.float64]
    ) -> NDArray[np.float64]: ...  # (m,7): quaternion and shift; turn, shift: pose of the base

class JointBounds:
    """Bounds of a step in which joints move at constant speed."""

    def __init__(
        self,
        chain: JointChain,
        start: NDArray[np.float64],
        end: NDArray[np.float64],
        turn: NDArray[np.float64],
        shift: NDArray[np.float64],
    ) -> None: ...
    def of_link(
        self, link: int, radius: float, girth: float, centre: NDArray[np.float64]
    ) -> tuple[float, float, float]: ...  # acceleration, span, rounding

class MemoryOnDevice:
    def __init__(self) -> None: ...
    def assign(self, pointer: int, bytes: int) -> None: ...
    @property
    def pointer(self) -> int: ...

def test_vertex_face(
    queries: NDArray[np.float64], accuracy: Accuracy, simd: Simd, minimum_separation: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]: ...
def test_edge_edge(
    queries: NDArray[np.float64], accuracy: Accuracy, simd: Simd, minimum_separation: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]: ...
def contacts_of_step(answers: Sequence[tuple[object, float, float]]) -> _Contacts: ...
def hash_of_contacts(contacts: object) -> int: ...
def contours(
    ef: NDArray[np.uint32],
    incidences: NDArray[np.uint8],
    faces: NDArray[np.uint32],
    first_vertex: NDArray[np.int64],
) -> list[tuple[NDArray[np.uint32], bool, int, int]]: ...
def enclosed_regions(
    ef: NDArray[np.uint32],
    incidences: NDArray[np.uint8],
    faces: NDArray[np.uint32],
    first_vertex: NDArray[np.int64],
) -> list[tuple[NDArray[np.uint32], NDArray[np.uint32]]]: ...

class StandardArithmetic:  # a context manager: the standard floating-point mode in this thread
    def __init__(self) -> None: ...
    def __enter__(self) -> None: ...
    def __exit__(self, *exception: object) -> None: ...

def widened(array: NDArray[np.float32]) -> NDArray[np.float64]: ...
def is_closed(faces: NDArray[np.uint32]) -> bool: ...
def placed(
    poses: NDArray[np.float64], meshes: Sequence[tuple[int, int]], vertices: NDArray[np.float64]
) -> NDArray[np.float64]: ...  # meshes: for each the number of its pose, and the end of its vertices
def integers_on_device(numbers: Sequence[int], device: int) -> DeviceArray: ...

class DetailThreads:
    def __init__(self, threads: int) -> None: ...
    def stop(self) -> None: ...
    def largest(
        self, name: str, vertices: NDArray[Any], first_vertex: NDArray[np.int64], most: float
    ) -> NDArray[np.float64]: ...
    def rows(self, vertices: NDArray[Any], of: NDArray[np.uint32]) -> tuple[NDArray[Any], bool]: ...

class CoarseMesh:
    def __init__(
        self,
        faces: NDArray[np.uint32],
        proposed: NDArray[np.uint32],
        survivor: NDArray[np.uint32],
        rest: NDArray[np.float64],
        threads: DetailThreads,
    ) -> None: ...
    @property
    def faces(self) -> NDArray[np.uint32]: ...
    @property
    def held(self) -> NDArray[np.uint32]: ...
    @property
    def mapped(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def deviations(
        self, vertices: NDArray[Any], first_vertex: int, largest: float | None, most: float, threads: DetailThreads
    ) -> NDArray[np.float64] | None: ...
    def neighbour_pairs(
        self, lone_edges: NDArray[np.uint32], n_vertices: int, threads: DetailThreads
    ) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.uint32]]: ...

class CoarseFeatures:
    def __init__(self, faces: NDArray[np.uint32], n_vertices: int) -> None: ...
    def bounds(
        self, vf: NDArray[np.uint32], ee: NDArray[np.uint32], of_faces: NDArray[np.float64]
    ) -> NDArray[np.float64]: ...

def hash_of_intersections(ef: NDArray[np.uint32]) -> int: ...
def require_static_at_rest(scene: Scene, vertices_t0: NDArray[Any], vertices_t1: NDArray[Any]) -> None: ...
def gpu_status() -> GpuStatus: ...
def gpu_fail_after(calls: int) -> None: ...
def simd_levels() -> list[str]: ...
