# SPDX-License-Identifier: Apache-2.0
"""Results of many worlds in one: where the rows of each world lie among those of all."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import arguments

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

    vf, ee, ef: (W+1,) int64, where the rows of each world begin, and their total. hashes: (W,) uint64, of each world's
    rows. first_tocs: (W,) float64.
    """

    vf: NDArray[np.int64]
    ee: NDArray[np.int64]
    ef: NDArray[np.int64]
    hashes: NDArray[np.uint64]
    first_tocs: NDArray[np.float64]

    @classmethod
    def of_none(cls, worlds: int) -> Slices:
        """Worlds without contacts."""
        begin = np.zeros(worlds + 1, np.int64)
        return cls(begin, begin.copy(), np.empty(0, np.int64), np.zeros(worlds, np.uint64), np.full(worlds, np.inf))


class OfWorlds(ComparedByRows):
    """A result of one or many worlds. Without `slices` it is of one, whose rows are all."""

    slices: Slices | None

    def _offsets(self, kind: str, rows: int) -> NDArray[np.int64]:
        return np.array([0, rows], np.int64) if self.slices is None else getattr(self.slices, kind)

    def _world_number(self, k: int) -> int:
        return arguments.whole_number("world", k, 0, 0 if self.slices is None else len(self.slices.hashes) - 1)


class PairsOfWorlds(OfWorlds):
    """A result with vertex-face and edge-edge pairs."""

    vf: NDArray[np.uint32]
    ee: NDArray[np.uint32]

    @property
    def vf_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the vertex-face pairs of world k are the rows vf_offsets[k] to vf_offsets[k + 1]."""
        return self._offsets("vf", len(self.vf))

    @property
    def ee_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the edge-edge pairs of world k are the rows ee_offsets[k] to ee_offsets[k + 1]."""
        return self._offsets("ee", len(self.ee))

    def _rows_of(self, k: int) -> tuple[slice, slice]:
        """Rows of world k, vertex-face and edge-edge."""
        vf, ee = self.vf_offsets, self.ee_offsets
        return slice(int(vf[k]), int(vf[k + 1])), slice(int(ee[k]), int(ee[k + 1]))

    def _places_of(self, k: int, places: NDArray[Row]) -> NDArray[Row]:
        """Rows of world k of an array that holds all vertex-face rows, then all edge-edge rows."""
        vf, ee = self._rows_of(k)
        n = len(self.vf)
        return np.concatenate([places[vf], places[n + ee.start : n + ee.stop]])
