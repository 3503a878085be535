# SPDX-License-Identifier: Apache-2.0
"""Results of many worlds in one: where the rows of each world lie among those of all."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import arguments
from .mesh_layout import MeshLayout

Row = TypeVar("Row", bound=np.generic)


class ComparedByRows:
    """Base of dataclasses that are equal if all fields that count are equal: arrays row by row, and NaN equals NaN.

    Not hashable, like numpy arrays.
    """

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = [field.name for field in dataclasses.fields(self) if field.compare]  # type: ignore[arg-type]
        return self is other or all(_equal(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_equal(a[key], b[key]) for key in a)
    if isinstance(a, float) and isinstance(b, float):
        a, b = np.array(a), np.array(b)
    if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)):
        return bool(a == b)
    if a.dtype != b.dtype or a.shape != b.shape:
        return False
    if a.dtype not in arguments.REALS:
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    # Compare bits: if another library has set denormals-are-zero, comparisons take denormals for 0.
    bits = np.dtype(f"u{a.dtype.itemsize}")
    x, y = np.ascontiguousarray(a).view(bits), np.ascontiguousarray(b).view(bits)
    alike = (x == y) | ((x | y) << 1 == 0) | (np.isnan(a) & np.isnan(b)).reshape(x.shape)  # -0 equals 0
    return bool(alike.all())


@dataclasses.dataclass(frozen=True, eq=False)
class Slices(ComparedByRows):
    """Rows of W worlds; arrays that a result does not have are empty.

    vf, ee, ef, vp, vv, ve: (W+1,) int64, where the rows of each world begin, and their total. hashes: (W,) uint64, of
    each world's rows. first_tocs: (W,) float64.
    """

    vf: NDArray[np.int64]
    ee: NDArray[np.int64]
    ef: NDArray[np.int64]
    hashes: NDArray[np.uint64]
    first_tocs: NDArray[np.float64]
    vp: NDArray[np.int64] = dataclasses.field(default_factory=lambda: np.empty(0, np.int64))
    vv: NDArray[np.int64] = dataclasses.field(default_factory=lambda: np.empty(0, np.int64))
    ve: NDArray[np.int64] = dataclasses.field(default_factory=lambda: np.empty(0, np.int64))

    @classmethod
    def of_none(cls, worlds: int) -> Slices:
        """Worlds without contacts."""
        begin = np.zeros(worlds + 1, np.int64)
        return cls(begin, begin.copy(), np.empty(0, np.int64), np.zeros(worlds, np.uint64), np.full(worlds, np.inf))


class OfWorlds(ComparedByRows):
    """A result of one or many worlds. Without `slices` it is of one, whose rows are all."""

    slices: Slices | None

    def _offsets(self, kind: str, rows: int) -> NDArray[np.int64]:
        if self.slices is None:
            return np.array([0, rows], np.int64)
        offsets: NDArray[np.int64] = getattr(self.slices, kind)
        return offsets if len(offsets) else np.zeros(len(self.slices.hashes) + 1, np.int64)

    def _world_number(self, k: int) -> int:
        return arguments.whole_number("world", k, 0, 0 if self.slices is None else len(self.slices.hashes) - 1)


KIND_NAMES = {
    "vf": "vertex-face",
    "ee": "edge-edge",
    "vp": "vertex-plane",
    "vv": "vertex-vertex",
    "ve": "vertex-edge",
}

#: Kinds of pairs, in the order of their rows in the outputs, and the indices in a row.
PAIR_KINDS = {"vf": 2, "ee": 4, "vp": 2, "vv": 2, "ve": 3}


def _none(*shape: int, dtype: str) -> NDArray[Any]:
    empty = np.empty(shape, dtype)
    empty.flags.writeable = False  # all results share it
    return empty


#: Without rows, by the name of an array without its ending.
NO_PAIRS = {kind: _none(0, columns, dtype="uint32") for kind, columns in PAIR_KINDS.items()}
NO_VALUES = _none(0, dtype="float64")


class PairsOfWorlds(OfWorlds):
    """A result with pairs of these kinds. Most results have vertex-face and edge-edge pairs only: the core returns no
    arrays of the others, and those of the class are read."""

    vf: NDArray[np.uint32]
    ee: NDArray[np.uint32]
    vp: NDArray[np.uint32]
    vv: NDArray[np.uint32]
    ve: NDArray[np.uint32]
    outputs: dict[str, NDArray[Any]]
    layout: MeshLayout | None

    @property
    def vf_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the vertex-face pairs of world k are the rows vf_offsets[k] to vf_offsets[k + 1]."""
        return self._offsets("vf", len(self.vf))

    @property
    def ee_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the edge-edge pairs of world k are the rows ee_offsets[k] to ee_offsets[k + 1]."""
        return self._offsets("ee", len(self.ee))

    @property
    def vp_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the vertex-plane pairs of world k are the rows vp_offsets[k] to vp_offsets[k + 1]."""
        return self._offsets("vp", len(self.vp))

    @property
    def vv_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the point-point pairs of world k are the rows vv_offsets[k] to vv_offsets[k + 1]."""
        return self._offsets("vv", len(self.vv))

    @property
    def ve_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the point-edge pairs of world k are the rows ve_offsets[k] to ve_offsets[k + 1]."""
        return self._offsets("ve", len(self.ve))

    def _kinds(self) -> list[str]:
        """Kinds with rows, beside vertex-face and edge-edge, which come first."""
        return [kind for kind in PAIR_KINDS if kind in ("vf", "ee") or len(getattr(self, kind))]

    def _fields_of(self, k: int, value: str) -> dict[str, Any]:
        """The rows of world k: those of each kind, of their values, whose names end like this, and of the outputs."""
        fields, places, first = {}, [], 0
        for kind in self._kinds():
            pairs, offsets = getattr(self, kind), getattr(self, f"{kind}_offsets")
            begin, end = int(offsets[k]), int(offsets[k + 1])
            fields[kind] = pairs[begin:end]
            fields[f"{kind}_{value}"] = getattr(self, f"{kind}_{value}")[begin:end]
            places.append(slice(first + begin, first + end))
            first += len(pairs)
        outputs = {name: np.concatenate([rows[of] for of in places]) for name, rows in self.outputs.items()}
        assert self.slices is not None
        return fields | {"hash": int(self.slices.hashes[k]), "outputs": outputs, "layout": self.layout}

    def _values(self, value: str) -> NDArray[np.float64]:
        """The values of all rows, whose names end like this, in the order of the outputs."""
        return np.concatenate([getattr(self, f"{kind}_{value}") for kind in self._kinds()])

    def _worlds_of_rows(self) -> NDArray[np.intp]:
        """(n,): the world of each row, in the order of the outputs."""
        offsets = [getattr(self, f"{kind}_offsets") for kind in self._kinds()]
        return np.concatenate([np.repeat(np.arange(len(o) - 1), np.diff(o)) for o in offsets])

    def _pairs(self) -> dict[str, NDArray[np.uint32]]:
        return {kind: getattr(self, kind) for kind in self._kinds()}

    def _counts(self) -> str:
        """For repr()."""
        return ", ".join(f"{len(getattr(self, kind))} {KIND_NAMES[kind]}" for kind in self._kinds())

    def __len__(self) -> int:
        return sum(len(getattr(self, kind)) for kind in self._kinds())
