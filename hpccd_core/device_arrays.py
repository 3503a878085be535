# SPDX-License-Identifier: Apache-2.0
"""Positions that live in a GPU's memory: CUDA array interface (CuPy, PyTorch, Numba, Warp) or DLPack."""

import ctypes
import math
import operator
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from . import _core


class CudaArray(Protocol):
    """An array of PyTorch, CuPy, Numba or Warp with this attribute."""

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...


class DlpackArray(Protocol):
    """An array with the DLPack protocol of the array API."""

    def __dlpack__(self, *, stream: Any = ...) -> Any: ...

    def __dlpack_device__(self) -> tuple[Any, int]: ...


DeviceArrayLike = CudaArray | DlpackArray

# shape, strides in bytes (None: C-contiguous), type as in "<f4", address (None: no memory).
_Layout = tuple[tuple[int, ...], tuple[int, ...] | None, str, int | None]


class DevicePositions(NamedTuple):
    """A C-contiguous (V, 3) or (W, V, 3) array on the device. made_on: the stream after whose work it is there; None:
    after all of the device's."""

    pointer: int
    is_double: bool
    made_on: int | None = None

    def for_core(self, rows: int) -> _core.Positions:
        return _core.Positions(self.pointer, rows, self.is_double, self.made_on)


def is_on_device(value: object) -> bool:
    """Whether the array lies in the memory of a CUDA device."""
    if type(value) is np.ndarray:  # looking for attributes that it has not takes 3 us
        return False
    if _interface_of(value) is not None:
        return True
    device = getattr(value, "__dlpack_device__", None)
    try:
        return device is not None and int(device()[0]) == 2  # kDLCUDA
    except Exception:  # a class, a PyTorch tensor without memory: rejected by name as an array on the host
        return False


def _interface_of(value: object) -> Any:
    try:
        return getattr(value, "__cuda_array_interface__", None)
    except Exception:  # PyTorch raises RuntimeError where a gradient is required; DLPack says so as well
        return None


def stream_number(stream: object) -> int | None:
    """A cudaStream_t as a number, from one, or from a stream of CuPy (ptr), PyTorch or Warp (cuda_stream)."""
    if stream is None:
        return None
    for name in ("ptr", "cuda_stream"):
        stream = getattr(stream, name, stream)
    try:
        if isinstance(stream, bool):
            raise TypeError
        number = operator.index(stream)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(
            f"stream: expected a cudaStream_t as an integer, or an object with .ptr or .cuda_stream, got "
            f"{type(stream).__name__}"
        ) from None
    if not 0 <= number < 1 << 64:
        raise ValueError(f"stream: a cudaStream_t is an address, 0 (the default stream) or more, got {number}")
    return number


def on_host(vertices: NDArray[Any], stream: int | None) -> _core.Positions | NDArray[Any]:
    """Positions for the core, with the stream that may still read device rows of a released result."""
    return vertices if stream is None else _core.Positions(vertices, stream)


def positions(name: str, value: Any, expected: tuple[int, ...], stream: int | None = None) -> DevicePositions:
    """The place and type of an array of this shape. Raises TypeError or ValueError naming the argument."""
    interface = _interface_of(value)
    if interface is not None:
        shape, strides, kind, pointer = _from_interface(name, interface)
    else:
        shape, strides, kind, pointer = _from_dlpack(name, value, stream)
    if kind not in ("<f4", "<f8"):
        raise TypeError(f"{name}: expected float32 or float64 on the device, got type {kind}")
    if shape != expected:
        rows = f"{'for each world ' if len(expected) > 2 else ''}one row per vertex of the scene"
        raise ValueError(f"{name}: expected shape {expected}, {rows}, got {shape}")
    size, some = int(kind[2]), math.prod(shape) > 0
    if strides is not None and some and not _in_order(shape, strides, size):
        raise ValueError(f"{name}: must be C-contiguous, got strides {strides} bytes; copy it first")
    if some and not pointer:
        raise ValueError(f"{name}: its address on the device is null; give an array that holds memory")
    if pointer and pointer % size:
        raise ValueError(f"{name}: its address must be a multiple of {size} bytes, the size of a number; copy it first")
    return DevicePositions(int(pointer or 0), size == 8, stream)


def _in_order(shape: tuple[int, ...], strides: tuple[int, ...], size: int) -> bool:
    """Whether it is C-contiguous; along an axis of one element, such as one world, any stride is valid."""
    steps = (math.prod(shape[i + 1 :]) * size for i in range(len(shape)))
    return all(n == 1 or step == stride for n, step, stride in zip(shape, steps, strides, strict=True))


def _from_interface(name: str, interface: Any) -> _Layout:
    try:
        strides, mask = interface.get("strides"), interface.get("mask")
        shape, strides = tuple(interface["shape"]), None if strides is None else tuple(strides)
        if strides is not None and len(strides) != len(shape):
            raise TypeError(f"shape {shape}, strides {strides}")
        kind, address = interface["typestr"], interface["data"][0]
        address = None if address is None else operator.index(address)
        if not 0 <= (address or 0) < 1 << 64:
            raise TypeError(f"address {address}")
        place = shape, strides, kind, address
    except (AttributeError, IndexError, KeyError, TypeError) as error:
        raise TypeError(f"{name}: its __cuda_array_interface__ does not follow the protocol ({error!r})") from None
    if mask is not None:
        raise TypeError(f"{name}: has a mask, and every element is needed; give an array without one")
    return place


class LastStep:
    """A copy of the positions of the last step on their device, so that the caller may overwrite its own array."""

    def __init__(self) -> None:
        self._memory: _core.MemoryOnDevice | None = None
        self.place: DevicePositions | None = None

    def __bool__(self) -> bool:
        return self.place is not None

    def keep(self, place: DevicePositions, rows: int) -> None:
        """Copy the positions of a query, which are complete by then. Raises RuntimeError if the device fails."""
        if self._memory is None:
            self._memory = _core.MemoryOnDevice()
        self.place = None
        self._memory.assign(place.pointer, rows * 3 * (8 if place.is_double else 4))
        self.place = DevicePositions(self._memory.pointer, place.is_double)

    def forget(self) -> None:
        """Without a last step; the memory stays for the next one."""
        self.place = None


class _Tensor(ctypes.Structure):
    # DLTensor of dlpack.h, at the start of DLManagedTensor.
    _fields_ = [
        ("data", ctypes.c_void_p),
        ("device_type", ctypes.c_int32),
        ("device_id", ctypes.c_int32),
        ("ndim", ctypes.c_int32),
        ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8),
        ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("byte_offset", ctypes.c_uint64),
    ]


def _from_dlpack(name: str, value: Any, stream: int | None) -> _Layout:
    # Stream 1 is the legacy default stream: the producer's work is done before ours starts there. The capsule stays
    # unconsumed, so the producer's own destructor frees it; the caller keeps the array itself alive.
    try:
        capsule = value.__dlpack__(stream=stream or 1)
    except Exception as error:
        raise TypeError(f"{name}: {type(value).__name__} cannot be exported by DLPack ({error})") from error
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    tensor = ctypes.cast(get(capsule, b"dltensor"), ctypes.POINTER(_Tensor)).contents
    if tensor.lanes != 1 or tensor.code != 2:
        raise TypeError(f"{name}: expected float32 or float64 on the device")
    size = tensor.bits // 8
    shape = tuple(tensor.shape[i] for i in range(tensor.ndim))
    strides = tuple(tensor.strides[i] * size for i in range(tensor.ndim)) if tensor.strides else None
    return shape, strides, f"<f{size}", (tensor.data or 0) + tensor.byte_offset
