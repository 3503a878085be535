# SPDX-License-Identifier: Apache-2.0
"""Checks of arguments, each with an error that names the argument and the remedy."""

from __future__ import annotations

import difflib
import inspect
import math
import operator
import struct
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any, NoReturn, SupportsIndex, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from .options import ALL_OUTPUTS, FEATURES

if TYPE_CHECKING:
    from .mesh_layout import MeshLayout

REALS = frozenset({np.dtype(np.float32), np.dtype(np.float64)})  # in this machine's byte order
LARGEST_COORDINATE = 1e150  # largest_coordinate in src/base/coordinate_limits.h
LARGEST_IN_SNAPSHOT = 1e300  # largest_in_snapshot there
DEEPEST = 8  # levels of nested lists: arguments have at most three dimensions, and a list may contain itself

#: Words that may be meant for a choice, beside misspellings of it.
ALIASES = {"vertices": "weights", "approach": "weights", "barycentrics": "weights", "toc_gradients": "weights"}

Word = TypeVar("Word", bound=str)
Function = TypeVar("Function", bound=Callable[..., object])


def flag(name: str, value: object) -> bool:
    """The value as bool: True, False, 1 or 0. Other values have a truth value too, but that of "no" is True."""
    if isinstance(value, (bool, np.bool_)) or (_is_integer(value) and value in (0, 1)):
        return bool(value)
    raise TypeError(f"{name}: expected True or False, got {type(value).__name__}")


def text(name: str, value: object) -> str:
    """A string that has a UTF-8 encoding and is not empty."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected a string, got {type(value).__name__}")
    if not value:
        raise ValueError(f"{name}: must not be empty")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{name}: {value!r} has no UTF-8 encoding ({error.reason}); use another string") from None
    return value


def choice(name: str, value: Word, choices: Iterable[str]) -> Word:
    """The value, if it is one of the choices."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected a string, got {type(value).__name__}; use one of {', '.join(choices)}")
    if value not in choices:
        raise ValueError(
            f"{name}: {value!r} is not known; use one of {', '.join(choices)}{did_you_mean(value, choices)}"
        )
    return value


def hide_unnamed(function: Function) -> Function:
    """Shorten the signature that help() shows: without annotations, as the docstring has the types, and without
    ``*unnamed`` and ``**unknown``, which are there for their errors.
    """
    signature = inspect.signature(function)
    extra = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    parameters = [p.replace(annotation=p.empty) for p in signature.parameters.values() if p.kind not in extra]
    function.__signature__ = _Wrapped(parameters)  # type: ignore[attr-defined]
    return function


class _Wrapped(inspect.Signature):
    """A signature that is printed in lines of at most 200 characters: that of Detector would be one of 320."""

    def __str__(self) -> str:
        return textwrap.fill(super().__str__(), 200, subsequent_indent="    ", break_long_words=False)


def reject_unnamed(query: str, remedy: str) -> NoReturn:
    """Raise TypeError for an argument too many, which may be a stream."""
    raise TypeError(f"{query}: takes {remedy}; a CUDA stream is given by name, as stream=")


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """The end of an error message: the choice that is spelled most like the word, if one is."""
    by_lower = {choice.lower(): choice for choice in choices}
    by_lower |= {alias: choice for alias, choice in ALIASES.items() if choice in by_lower}
    near = difflib.get_close_matches(word.lower().replace("-", "_"), by_lower, n=1)
    return f"; did you mean {by_lower[near[0]]}?" if near else ""


def whole_number(name: str, value: SupportsIndex, low: int, high: int) -> int:
    """The value as int, if it lies in [low, high]."""
    if isinstance(value, bool):
        raise TypeError(f"{name}: expected an integer, got bool")
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected an integer, got {type(value).__name__}") from None
    if not low <= number <= high:
        raise ValueError(f"{name}: must lie in [{low}, {high}], got {shown(number)}")
    return number


def mesh_number(name: str, mesh: str | int, numbers: Mapping[str, int]) -> int:
    """The number of a mesh given by name or number. numbers: name -> number of all meshes."""
    if isinstance(mesh, str):
        if mesh not in numbers:
            there = ", ".join(numbers) or "none"
            raise ValueError(f"{name}: no mesh is named {mesh!r}; the scene has {there}{did_you_mean(mesh, numbers)}")
        return numbers[mesh]
    if not hasattr(mesh, "__index__") or isinstance(mesh, np.ndarray):
        raise TypeError(f"{name}: expected the name or number of a mesh, got {type(mesh).__name__}")
    if not numbers:
        raise ValueError(f"{name}: the scene has no mesh yet; call add_mesh first")
    return whole_number(name, mesh, 0, len(numbers) - 1)


def length(name: str, value: object) -> float:
    """The value as float, finite and not negative. Raises ValueError if float64 cannot hold it exactly."""
    number = real(name, value)
    (bits,) = struct.unpack("<Q", struct.pack("<d", number))  # comparisons may take a negative denormal for 0
    if not math.isfinite(number) or bits > 1 << 63:
        raise ValueError(f"{name}: must be finite and not negative, got {shown(value)}")
    return number


def separation(value: object) -> float:
    """The last argument of set_separation as float."""
    if isinstance(value, str):
        raise TypeError("separation: expected a number, got str; write set_separation(mesh_a, mesh_b, separation)")
    return length("separation", value)


def thickness(value: object) -> NDArray[np.float64]:
    """A number or a list of them -> 1-D float64; the core sees how many the mesh needs."""
    numbers = np.atleast_1d(reals("thickness", value))
    if numbers.ndim != 1:
        raise ValueError(f"thickness: expected a number or a list of them, got shape {numbers.shape}")
    bad = np.flatnonzero(~(np.isfinite(numbers) & (numbers >= 0)))
    if bad.size:
        raise ValueError(f"thickness[{bad[0]}]: must be finite and not negative, got {numbers[bad[0]]}")
    bad = np.flatnonzero(numbers > LARGEST_IN_SNAPSHOT)
    if bad.size:
        raise ValueError(f"thickness[{bad[0]}]: must be at most {LARGEST_IN_SNAPSHOT:g}; choose a larger unit")
    return numbers


def shape(value: object, used: int, n_vertices: int | None) -> NDArray[np.float64]:
    """Positions of a mesh in its own frame -> (n, 3) float64, at least one row for each vertex that is used."""
    positions = reals("shape", value)
    if positions.ndim != 2 or positions.shape[1] != 3:
        remedy = "; transpose it: shape.T" if positions.ndim == 2 and positions.shape[0] == 3 else ""
        raise ValueError(f"shape: expected (n_vertices, 3), the positions of this mesh, got {positions.shape}{remedy}")
    expected = used if n_vertices is None else whole_number("n_vertices", n_vertices, 0, 2**32 - 2)
    if len(positions) < used or (n_vertices is not None and len(positions) != expected):
        raise ValueError(f"shape: expected {expected} rows, one for each vertex of this mesh, got {len(positions)}")
    bad = np.argwhere(~(np.abs(positions) <= LARGEST_IN_SNAPSHOT))
    if len(bad):
        where = tuple(bad[0])
        raise ValueError(f"shape[{where[0]}, {where[1]}] is {positions[where]}; all coordinates must be finite")
    return positions


def poses(value: object, meshes: Sequence[str], worlds: int | None) -> NDArray[np.float64]:
    """(K, 7), or of many worlds (W, K, 7): the rows of K meshes; None: no rows, the identity of all."""
    if value is None:
        return np.empty((0, 7))
    array = reals("poses", value)
    expected = (len(meshes), 7) if worlds is None else (worlds, len(meshes), 7)
    if array.shape == expected:
        return np.require(array, None, ["C", "A"])
    there = ", ".join(meshes) or "none: give shape= to Scene.add_mesh"
    remedy = ""
    if array.shape[-2:] == (4, 4):
        remedy = "; from matrices: position matrix[:3, 3], and the quaternion of matrix[:3, :3]"
    elif array.shape == (7,) and expected == (1, 7):
        remedy = "; for one mesh give poses=[pose]"
    raise ValueError(
        f"poses: expected shape {expected}, position x y z and quaternion x y z w of each mesh that has a shape and is "
        f"not static ({there}), got {array.shape}{remedy}"
    )


def real(name: str, value: Any) -> float:
    """The value as float. Raises ValueError if float64 cannot hold it exactly."""
    if isinstance(value, np.float32):
        return float(widened(np.asarray(value)))
    if isinstance(value, bool) or not (_is_integer(value) or isinstance(value, (float, np.floating))):
        if type(value) is np.ndarray and value.ndim == 0 and value.dtype.kind in "fiu":
            return real(name, value[()])
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    try:
        with np.errstate(all="ignore"):
            number = float(value)
    except OverflowError:
        raise _beyond(name, value) from None
    if not _holds(number, value):
        raise _not_held(name, value) if math.isfinite(number) else _beyond(name, value)
    return number


def reals(name: str, value: object) -> NDArray[np.float64]:
    """Numbers of any real type -> float64, C-contiguous. Raises ValueError if float64 cannot hold one exactly."""
    array = _array(name, value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected an array of numbers, got {_kind(value, array)}")
    return _as_float64(name, array)


def vector(name: str, value: object) -> list[float]:
    """Three numbers."""
    array = reals(name, value)
    if array.shape != (3,):
        raise ValueError(f"{name}: expected shape (3,), got {array.shape}; give x, y and z")
    x: list[float] = array.tolist()
    return x


def _is_integer(value: object) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, np.timedelta64)


def _holds(number: float, value: Any) -> bool:
    """Whether ``number``, which is float(value), equals the value. NaN does."""
    if isinstance(value, (int, np.integer)):
        return math.isfinite(number) and int(number) == int(value)
    with np.errstate(all="ignore"):  # only long doubles have more bits
        return bool(type(value)(number) == value or value != value)


def _not_held(name: str, value: object) -> ValueError:
    return ValueError(f"{name}: float64 cannot hold {shown(value)} exactly; round it first, as float() does")


def _beyond(name: str, value: object) -> ValueError:
    return ValueError(f"{name}: must lie within float64, got {shown(value)}")


def _as_float64(name: str, array: NDArray[Any]) -> NDArray[np.float64]:
    """Integers or floats of any size -> float64, C-contiguous. Raises ValueError if float64 cannot hold one exactly."""
    if (native := array.dtype.newbyteorder("=")) in REALS:
        return widened(array.astype(native, copy=False))
    with np.errstate(all="ignore"):
        numbers: NDArray[np.float64] = np.ascontiguousarray(array, np.float64).reshape(array.shape)
        if array.dtype.kind == "f":
            rounded = np.isfinite(array) & (numbers.astype(array.dtype) != array)
        else:
            rounded = np.abs(numbers) >= 2.0**53  # smaller ones are exact
    for where in np.argwhere(rounded):
        if not _holds(float(numbers[tuple(where)]), array[tuple(where)]):
            raise _not_held(f"{name}[{', '.join(map(str, where))}]", array[tuple(where)])
    return numbers


def lengths_of_pairs(name: str, value: object, n: int) -> NDArray[np.float64]:
    """(n, n) numbers -> float64, C-contiguous; the core sees whether they are lengths, and symmetric."""
    numbers = reals(name, value)
    if numbers.shape != (n, n):
        raise ValueError(f"{name}: expected shape ({n}, {n}), a row for each mesh of the scene, got {numbers.shape}")
    return numbers


def faces(value: object) -> NDArray[np.uint32]:
    """(F, 3) integers -> (F, 3) uint32, C-contiguous."""
    return _indices("faces", value, "F", 3)


def edges(value: object) -> NDArray[np.uint32]:
    """(E, 2) integers -> (E, 2) uint32, C-contiguous."""
    return _indices("edges", value, "E", 2)


def index_rows(name: str, value: object, columns: int) -> NDArray[np.uint32]:
    """(N, columns) integers, scene-wide numbers as in results -> uint32, C-contiguous."""
    return _indices(name, value, "N", columns, "give scene-wide numbers, as in results")


def _indices(name: str, value: object, rows: str, columns: int, scene_wide: str = "") -> NDArray[np.uint32]:
    array = _array(name, value)
    if array.size == 0 and array.ndim in (1, 2):
        return np.empty((0, columns), np.uint32)
    integers = _integers_of_any_size(value, array) if array.dtype.kind in "fO" else array
    if array.dtype.kind not in "iu" and integers is array:
        remedy = _remedy_for_object(name, value, array, "faces") or "give indices of vertices"
        if array.dtype.kind == "f":
            remedy = f"convert with {name}.astype(numpy.uint32)"
        if array.dtype.kind == "f" and (array != np.round(array)).any():
            remedy = (
                f"these look like positions: {name} holds indices of vertices, and positions are given to detect() "
                "and the other queries"
            )
        raise TypeError(f"{name}: expected integers, got {_kind(value, array)}; {remedy}")
    if array.ndim != 2 or array.shape[1] != columns:
        remedy = f"; {scene_wide}" if scene_wide else _remedy_for_indices(name, array, columns)
        raise ValueError(f"{name}: expected shape ({rows}, {columns}), got {array.shape}{remedy}")
    for bad, what in ((integers < 0, "is negative"), (integers > 0xFFFFFFFE, "is beyond 2**32 - 2")):
        if bad.any():
            row, column = np.argwhere(bad)[0]
            raise ValueError(
                f"{name}[{row}, {column}] is {shown(integers[row, column])}, which {what}; "
                + (scene_wide or "indices count this mesh's vertices from 0")
            )
    return np.ascontiguousarray(integers, np.uint32)


def integers(name: str, value: object) -> NDArray[Any]:
    """Integers of any shape and size -> an array; a scalar is for `whole_number` to check."""
    array = _array(name, value)
    indices = _integers_of_any_size(value, array) if array.dtype.kind in "fO" else array
    if array.ndim and array.size and array.dtype.kind not in "iu" and indices is array:
        remedy = f"; of a mask give numpy.flatnonzero({name})" if array.dtype.kind == "b" else ""
        raise TypeError(f"{name}: expected integers, got {_kind(value, array)}{remedy}")
    return indices


def _remedy_for_indices(name: str, array: NDArray[Any], columns: int) -> str:
    """The end of an error message about the shape of faces or edges."""
    if name == "faces":
        padded = array.reshape(-1, 4) if array.ndim in (1, 2) and array.size % 4 == 0 else None
        if padded is not None and (padded[:, 0] == 3).all():
            return "; for VTK's format, in which each triangle begins with 3: faces.reshape(-1, 4)[:, 1:]"
        if array.ndim == 2 and array.shape[1] == 4:
            return (
                "; triangulate quadrilaterals: faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3); of tetrahedra give the "
                "triangles of the surface"
            )
        if array.ndim == 2 and array.shape[1] == 2:
            return "; give segments as edges="
    elif array.ndim == 2 and array.shape[1] == 3:
        return "; give triangles as faces"
    if array.ndim == 2 and array.shape[0] == columns:
        return f"; transpose it: {name}.T"
    if array.ndim == 1 and array.size % columns == 0:
        return f"; reshape it: {name}.reshape(-1, {columns})"
    return "; triangulate polygons first" if name == "faces" and array.ndim == 2 and array.shape[1] > 4 else ""


def _integers_of_any_size(value: object, array: NDArray[Any]) -> NDArray[Any]:
    """The same as Python's integers, where it holds nothing else: numpy turns those beyond its own into floats."""
    if isinstance(value, np.ndarray) and array.dtype.kind == "f":
        return array
    objects = np.asarray(value, object)
    return objects if all(type(x) is int for x in objects.flat) else array


def output_names(value: Iterable[str]) -> tuple[str, ...]:
    """A tuple of output names from one name or several."""
    return _names("outputs", value, ALL_OUTPUTS)


def feature_names(value: Iterable[str]) -> tuple[str, ...]:
    """The features to test, from one name or both: in the order of FEATURES, each once."""
    names = _names("features", value, FEATURES)
    if not names:
        raise ValueError(
            f"features: empty, so nothing would be tested; use {' or '.join(FEATURES)}, or both; to leave out "
            "a pair of meshes, use scene.ignore_pair"
        )
    return tuple(name for name in FEATURES if name in names)


def _no_names(argument: str, value: object, choices: tuple[str, ...]) -> TypeError:
    return TypeError(
        f"{argument}: expected one or several of {', '.join(choices)}, got {type(value).__name__}; write, for example, "
        f"{argument}=({choices[0]!r},)"
    )


def _names(argument: str, value: Iterable[str], choices: tuple[str, ...]) -> tuple[str, ...]:
    try:
        names = (value,) if isinstance(value, str) else tuple(value)
    except TypeError:
        raise _no_names(argument, value, choices) from None
    if isinstance(value, (bytes, bytearray)):
        raise _no_names(argument, value, choices)
    return tuple(choice(argument, name, choices) for name in names)


def vertices(name: str, value: object, shape: tuple[int, ...], layout: MeshLayout) -> NDArray[Any]:
    """(V, 3), or of many worlds (W, V, 3), float32 or float64; C-contiguous arrays are taken without a copy.

    A mapping holds the array of each mesh by its name.
    """
    if type(value) is np.ndarray:
        array = _reals(name, value, value)
    elif isinstance(value, Mapping):
        array = _of_meshes(name, value, shape, layout)
    elif len(shape) == 2 and _is_list_of_meshes(value):
        raise ValueError(
            f"{name}: expected one array, got a list of {len(value)}; for several meshes give "
            f"numpy.concatenate({name}), or a dict {{mesh: array}}"
        )
    else:
        array = _reals(name, _array(name, value), value)
    if array.shape != shape:
        raise ValueError(
            f"{name}: expected shape {shape}, {'for each world ' if len(shape) > 2 else ''}one row per "
            f"vertex, meshes in the order added, got {array.shape}{_remedy_for_positions(name, array, shape, layout)}"
        )
    usable_in_place = array.flags.c_contiguous and array.flags.aligned
    return array if usable_in_place else np.require(array, None, ["C", "A"])


def positions_of_others(value: object, shape: tuple[int, ...]) -> NDArray[Any]:
    """Positions beside poses: of the meshes without a shape, (U, 3) or (W, U, 3), float32 or float64."""
    array = _reals("vertices", _array("vertices", value), value)
    if array.shape != shape:
        raise ValueError(
            f"vertices: expected shape {shape}: with poses, one row per vertex of the meshes without a shape, in the "
            f"order added, got {array.shape}"
        )
    return np.require(array, None, ["C", "A"])


def _is_list_of_meshes(value: object) -> TypeGuard[Sequence[object]]:
    if not isinstance(value, (list, tuple)) or not value:
        return False
    return all(isinstance(mesh, np.ndarray) and mesh.ndim == 2 for mesh in value)


def points(name: str, value: object, worlds: int | None) -> NDArray[Any]:
    """(K, 3), or of many worlds (W, K, 3), float32 or float64, C-contiguous."""
    array = _reals(name, value if type(value) is np.ndarray else _array(name, value), value)
    shape_of_points(name, array.shape, worlds)
    return np.require(array, None, ["C", "A"])


def shape_of_points(name: str, shape: tuple[int, ...], worlds: int | None) -> tuple[int, ...]:
    """The shape, if it is that of points."""
    expected = "(K, 3)" if worlds is None else f"({worlds}, K, 3)"
    if len(shape) == (2 if worlds is None else 3) and shape[-1] == 3 and worlds in (None, shape[0]):
        return shape
    remedy = ""
    if len(shape) == 1:
        remedy = f"; for one point give {name}=[point]" if shape == (3,) else ""
    elif shape[-2:-1] == (3,) and shape[-1] != 3 and len(shape) == 2:
        remedy = f"; transpose it: {name}.T"
    elif len(shape) == 2 and worlds is not None:
        remedy = "; give points for each world"
    raise ValueError(f"{name}: expected shape {expected}, got {shape}{remedy}")


def group_numbers(value: object, layout: MeshLayout) -> NDArray[np.int64]:
    """(V,) int64, each at least -1."""
    array = _array("groups", value)
    if array.shape == (0,):
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        converted = {"b": "write numpy.where(groups, 0, -1)", "f": "convert with groups.astype(int)"}
        remedy = converted.get(array.dtype.kind if array.ndim else "", "give a number for each vertex, in their order")
        raise TypeError(f"groups: expected integers, got {_kind(value, array)}; {remedy}; -1: a vertex on its own")
    n_vertices = int(sum(layout.vertex_counts))
    if array.shape != (n_vertices,):
        remedy = ""
        if array.shape == (len(layout.mesh_names),):
            remedy = "; from one of each mesh: numpy.repeat(groups, n), with the numbers n of their vertices"
        elif array.ndim == 2 and array.shape[1] == n_vertices:
            remedy = "; all worlds have the same groups: groups[0]"
        elif array.size == n_vertices:
            remedy = "; reshape it: groups.reshape(-1)"
        raise ValueError(f"groups: expected shape ({n_vertices},), a number for each vertex, got {array.shape}{remedy}")
    if array.size and not -1 <= array.min() <= array.max() < 2**63:
        wrong = array.min() if array.min() < -1 else array.max()
        raise ValueError(f"groups: numbers from 0 to 2**63 - 1, or -1 for a vertex on its own, got {wrong}")
    return np.require(array, np.int64, ["C", "A"])


def _of_meshes(name: str, value: Mapping[Any, Any], shape: tuple[int, ...], layout: MeshLayout) -> NDArray[Any]:
    """The arrays of all meshes as one, in the order in which the meshes were added."""
    there = ", ".join(layout.mesh_names) or "none"
    for mesh in value:
        if mesh not in layout.mesh_names:
            near = did_you_mean(mesh, layout.mesh_names) if isinstance(mesh, str) else ""
            raise ValueError(f"{name}: no mesh is named {mesh!r}; the scene has {there}{near}")
    parts = []
    planes = {layout.mesh_names[plane] for plane in layout.planes}  # they have no vertices
    for mesh, n_vertices in zip(layout.mesh_names, layout.vertex_counts, strict=True):
        if mesh not in value:
            if mesh in planes:
                continue
            every = ", ".join(other for other in layout.mesh_names if other not in planes)
            raise ValueError(f"{name}: has no positions of mesh {mesh!r}; give those of every mesh: {every}")
        of_mesh = f"{name}[{mesh!r}]"
        given = value[mesh]
        if type(given) is not np.ndarray and hasattr(given, "__cuda_array_interface__"):
            raise TypeError(
                f"{of_mesh}: is in a GPU's memory; give one device array of all meshes, or copy it to the host"
            )
        array = _reals(of_mesh, _array(of_mesh, given), given)
        expected = (*shape[:-2], n_vertices, 3)
        if array.shape != expected:
            if mesh in planes:
                raise ValueError(f"{of_mesh}: is a plane, which has no vertices; leave it out")
            remedy = _remedy_for_positions(of_mesh, array, expected, None)
            raise ValueError(f"{of_mesh}: expected shape {expected}, one row per vertex, got {array.shape}{remedy}")
        parts.append(array)
    if len({array.dtype for array in parts}) > 1:
        parts = [widened(array) for array in parts]
    return np.concatenate(parts, axis=-2) if parts else np.empty(shape)


def _remedy_for_positions(name: str, array: NDArray[Any], expected: tuple[int, ...], layout: MeshLayout | None) -> str:
    """The end of an error message about the shape of positions. layout: None where they are of one mesh."""
    got, n = array.shape, expected[-2]
    if got == expected[::-1]:
        return f"; transpose it: {name}.T"
    if got[:-1] == expected[:-1] and got[-1] == 2:
        return f"; add a third coordinate: numpy.pad({name}, {((0, 0),) * (len(got) - 1) + ((0, 1),)})"
    if got[:-1] == expected[:-1] and got[-1] == 4:
        return f"; leave out the fourth coordinate: {name}[..., :3]"
    if array.size == math.prod(expected) and len(got) == 1:
        return f"; reshape it: {name}.reshape{expected}"
    if len(got) == 3 and len(expected) == 2 and got[1:] == expected:
        return "; for many worlds make the detector with worlds="
    if len(expected) == 3 and got == expected[1:]:
        return "; give the positions of every world"
    if layout is None or len(got) != len(expected) or got[-1] != 3 or len(layout.mesh_names) == 0:
        return ""
    rows = got[-2]
    for mesh, count in zip(layout.mesh_names, layout.vertex_counts, strict=True):
        if rows == count < n:
            return f"; these may be of mesh {mesh!r} alone: give all meshes, concatenated or as a dict {{mesh: array}}"
    if rows == n - 1:
        return "; one row is missing: from faces that count vertices from 1, subtract 1"
    if rows > n:
        return "; for vertices in no face, add the mesh with n_vertices="
    return ""


def usable(name: str, array: NDArray[Any]) -> None:
    """Raises ValueError where a coordinate is NaN, infinite, or so large that intermediate results could overflow."""
    # In the array's own precision, which may end below that.
    good = np.abs(array) <= min(LARGEST_COORDINATE, float(np.finfo(array.dtype).max))  # false for NaN too
    if good.all():
        return
    where = tuple(np.argwhere(~good)[0])
    remedy = "scale the coordinates down" if np.isfinite(array[where]) else "all coordinates must be finite"
    raise ValueError(f"{name}[{', '.join(map(str, where))}] is {array[where]}; {remedy}")


def queries(value: object) -> NDArray[np.float64]:
    """(Q, 8, 3) float64: four points at t=0, then the same at t=1. The core says which is not finite."""
    array = _reals("queries", _array("queries", value), value)
    if array.ndim != 3 or array.shape[1:] != (8, 3):
        expected = "(Q, 8, 3), four points at t=0 and the same at t=1"
        raise ValueError(f"queries: expected shape {expected}, got {array.shape}")
    return widened(array)


def widened(array: NDArray[Any]) -> NDArray[np.float64]:
    """float32 or float64 -> float64, C-contiguous and exact. numpy would turn denormal numbers into 0 if another
    library has set denormals-are-zero."""
    there = np.require(array, None, ["C", "A"])
    return there if there.dtype == np.float64 else _core.widened(there)


def _reals(name: str, array: NDArray[Any], value: object) -> NDArray[Any]:
    if array.dtype in REALS:
        return array
    if array.dtype.newbyteorder("=") in REALS:
        return array.astype(array.dtype.newbyteorder("="))
    remedy = _remedy_for_object(name, value, array, "vertices") or "give an array of numbers"
    if array.dtype.kind in "iuf" and array.ndim > 0:
        has_method = isinstance(value, np.ndarray)
        remedy = f"convert with {f'{name}.astype(numpy.float64)' if has_method else f'numpy.asarray({name}, float)'}"
    elif array.dtype.kind == "c":
        remedy = "coordinates are real numbers: give the array of their real parts, if that is what you mean"
    raise TypeError(f"{name}: expected float32 or float64, got {_kind(value, array)}; {remedy}")


def _remedy_for_object(name: str, value: object, array: NDArray[Any], attribute: str) -> str:
    """How to get an array from a mesh of trimesh, or from what only DLPack exports; empty for other objects."""
    if array.dtype != object or array.ndim > 0:
        return ""
    if all(inspect.getattr_static(value, part, None) is not None for part in ("vertices", "faces")):
        return f"give mesh.{attribute}"
    exported = hasattr(type(value), "__dlpack__") and not isinstance(value, np.ndarray)
    return f"give numpy.from_dlpack({name})" if exported else ""


def _array(name: str, value: object) -> NDArray[Any]:
    kinds = _kinds(name, value)
    try:
        array = np.asarray(value)
    except ValueError as error:  # rows of different lengths
        raise ValueError(f"{name}: not a rectangular array ({error}); give every row the same length") from None
    except OverflowError as error:  # an integer among floats
        raise ValueError(f"{name}: holds a number beyond float64 ({error}); scale the numbers down") from None
    except MemoryError:
        raise
    except Exception as error:  # the object's own conversion: a PyTorch tensor that requires a gradient has none
        raise _no_array(name, value, error) from error
    if kinds and array.dtype.kind in "fiu":
        _keep(name, value, array, kinds)
    return array


def _no_array(name: str, value: object, error: Exception) -> TypeError:
    kind, library = type(value).__name__, type(value).__module__.partition(".")[0]
    see = f"; for derivatives see hpccd_core.{library}" if library in ("torch", "jax") else ""
    return TypeError(f"{name}: {kind} cannot be converted to an array ({error}); give an array of numbers{see}")


def reject_masked(name: str, value: object) -> None:
    """Raises TypeError for an array with masked elements, whose mask would be lost."""
    _kinds(name, value)


def _kinds(name: str, value: object) -> set[type]:
    """The types of the elements of nested lists and of arrays in them; empty if the value is an array."""
    kinds: set[type] = set()
    if type(value) is np.ndarray:
        return kinds
    level = [value]
    for depth in range(DEEPEST):
        found = set(map(type, level))  # level by level: visiting each number takes longer than numpy's conversion
        nested = {kind for kind in found if _is_nested(kind)}
        for array in (x for x in level if isinstance(x, np.ndarray)) if _some(found, np.ndarray) else ():
            if isinstance(array, np.ma.MaskedArray) and np.ma.is_masked(array):
                raise TypeError(
                    f"{name}: some elements are masked, but all are needed; remove the masked ones, or give an array "
                    "in which they are filled (numpy.ma.filled)"
                )
            kinds.add(array.dtype.type)
        kinds.update(kind for kind in found - nested if not issubclass(kind, np.ndarray))
        if not nested:
            return kinds if depth else set()
        lists: Any = level if nested == found else [x for x in level if type(x) in nested]
        try:
            level = list(chain.from_iterable(lists))
        except MemoryError:
            raise
        except Exception as error:
            raise _no_array(name, value, error) from error
    raise ValueError(f"{name}: lists are nested more than {DEEPEST - 1} deep; give an array of numbers")


def _is_nested(kind: type) -> bool:
    """Whether numpy takes values of this type for rows: sequences, except arrays, strings and bytes."""
    if issubclass(kind, (list, tuple)):
        return True
    if issubclass(kind, (str, bytes, bytearray, memoryview, Mapping, np.generic)) or hasattr(kind, "__array__"):
        return False
    return hasattr(kind, "__len__") and hasattr(kind, "__getitem__")


def _some(kinds: Iterable[type], *bases: type) -> bool:
    return any(issubclass(kind, bases) for kind in kinds)


def _keep(name: str, value: object, array: NDArray[Any], kinds: set[type]) -> None:
    """Check the array that numpy made of nested lists. Raises an error if numpy took a Boolean for a number, or rounded
    an integer because of floats in the list; restores denormal float32 that numpy turned into 0."""
    if _some(kinds, bool, np.bool_):
        raise TypeError(f"{name}: expected numbers, got True or False among them; write 1 or 0")
    if array.dtype != np.float64:
        return
    if not all(issubclass(kind, (float, np.floating)) for kind in kinds):
        with np.errstate(all="ignore"):
            large = np.argwhere(np.abs(array) >= 2.0**53)
        for where in large:
            given = _at(value, where)
            if _is_integer(given) and not _holds(float(array[tuple(where)]), given):
                raise _not_held(name, given)
    if not all(issubclass(kind, (float, int, np.float64, np.integer)) for kind in kinds):
        for where in np.argwhere(array == 0):
            if isinstance(given := _at(value, where), np.float32):
                array[tuple(where)] = real(name, given)


def _at(value: Any, where: Iterable[int]) -> Any:
    """The element at this place in nested lists and arrays."""
    for place in where:
        value = value[place] if _is_nested(type(value)) else np.asarray(value)[place]
    return value if isinstance(value, (int, float, np.generic)) else np.asarray(value)[()]


def _kind(value: object, array: NDArray[Any]) -> str:
    """The given value in a few words."""
    if array.ndim == 0 and not isinstance(value, (np.ndarray, np.generic)):
        return type(value).__name__
    return f"dtype {array.dtype}"


def shown(value: object) -> str:
    """As text that fits on a line; of a huge integer its size."""
    if isinstance(value, int) and abs(value) >= 10**20:
        return f"{'-' if value < 0 else ''}1e{(abs(value).bit_length() - 1) * 0.30103:.0f}"
    return str(value)  # format() would convert long doubles to float64
