# SPDX-License-Identifier: Apache-2.0
"""The compiled module (src/bindings.cpp). Names and arguments are compared with it by test/packaging/test_core_stub.py,
which tells how to draw up anew what pybind11 itself says of them."""

from typing import Any, ClassVar, TypedDict

import numpy as np
from numpy.typing import NDArray

from .devices import GpuStatus

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

class Scene:
    def __init__(self) -> None: ...
    def add_mesh(
        self, arg0: str, arg1: NDArray[np.uint32], arg2: int, arg3: bool, arg4: bool
    ) -> int: ...
    def ignore_pair(self, arg0: int, arg1: int) -> None: ...
    def set_accuracy(self, arg0: int, arg1: int, arg2: Accuracy) -> None: ...
    @property
    def n_vertices(self) -> int: ...
    @property
    def n_faces(self) -> int: ...
    @property
    def meshes(self) -> list[tuple[str, int, int, int, int]]: ...

class _Contacts(TypedDict):
    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    first_toc: float
    hash: int

class Detector:
    def __init__(
        self,
        arg0: Scene,
        arg1: Accuracy,
        arg2: Backend,
        arg3: Report,
        arg4: Simd,
        arg5: int,
        arg6: bool,
        arg7: bool,
        arg8: float,
        arg9: float,
        arg10: Method,
        arg11: bool,
        arg12: int,
        arg13: int,
        arg14: int,
    ) -> None: ...
    def detect(self, arg0: NDArray[Any], arg1: NDArray[Any]) -> _Contacts: ...
    def detect_on_device(self, arg0: int, arg1: int, arg2: int, arg3: bool) -> _Contacts: ...
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

class MemoryOnDevice:
    def __init__(self) -> None: ...
    def assign(self, arg0: int, arg1: int) -> None: ...
    @property
    def pointer(self) -> int: ...

def test_vertex_face(
    arg0: NDArray[np.float64], arg1: Accuracy, arg2: Simd, arg3: float, arg4: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]: ...
def test_edge_edge(
    arg0: NDArray[np.float64], arg1: Accuracy, arg2: Simd, arg3: float, arg4: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]: ...
def gpu_status() -> GpuStatus: ...
def gpu_fail_after(arg0: int) -> None: ...
def simd_levels() -> list[str]: ...
