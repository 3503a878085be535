# SPDX-License-Identifier: Apache-2.0
"""Common parts of results: outputs that a detector computes on request only, and the meshes of each pair."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any, NamedTuple, NoReturn, TypeVar

import numpy as np

from .mesh_layout import Indices, MeshLayout, Sides
from .worlds import Slices

Result = TypeVar("Result")
Array = TypeVar("Array")


class OutputArray(NamedTuple):
    """One array of a result, and the word in `outputs` that asks for it."""

    asked: str
    row: tuple[int, ...]
    dtype: str = "float64"


#: By the name of the array.
OUTPUT_ARRAYS = {
    "points": OutputArray("points", (3,)),
    "normals": OutputArray("normals", (3,)),
    "closest": OutputArray("closest", (2, 3)),
    "vertices": OutputArray("weights", (4,), "uint32"),
    "weights": OutputArray("weights", (4,)),
    "approach": OutputArray("weights", ()),
}

#: Of intersections.
INTERSECTION_ARRAYS = {
    "points": OutputArray("points", (3,)),
    "edge_parameters": OutputArray("points", ()),
    "weights": OutputArray("points", (3,)),
    "incidences": OutputArray("points", (), "uint8"),
    "directions": OutputArray("directions", (3,)),
}


class OutputNotComputed(ValueError, AttributeError):
    """An output of a result was read that its detector was not asked for.

    It is a ValueError, and an AttributeError too, so that ``hasattr(contacts, "normals")`` is False and
    ``getattr(contacts, "normals", None)`` is None.

    Examples
    --------
    >>> import hpccd_core as hc
    >>> hc.Contacts.none().normals
    Traceback (most recent call last):
    ...
    hpccd_core.results.OutputNotComputed: normals: not computed; make the detector with outputs=('normals',)
    """


def output(outputs: dict[str, Array], name: str, *others: str, arrays: dict[str, OutputArray] = OUTPUT_ARRAYS) -> Array:
    """The output of this name. Raises OutputNotComputed where it was not asked for; names of others needed with it."""
    try:
        return outputs[name]
    except KeyError:
        asked = tuple(dict.fromkeys(arrays[array].asked for array in (*outputs, name, *others)))
        raise OutputNotComputed(f"{name}: not computed; make the detector with outputs={asked!r}") from None


class _NotASequence(TypeError, KeyError):
    """A TypeError. numpy tries to read elements, and takes an object that raises KeyError for one element: so object
    arrays can hold results."""

    __str__ = Exception.__str__


class WithSides:
    """A result whose rows are pairs of features, each side of which belongs to one mesh."""

    layout: MeshLayout | None

    def _pairs(self) -> dict[str, Indices]:
        """The pairs of each kind, in the order of the rows."""
        raise NotImplementedError

    def __getitem__(self, row: NoReturn) -> NoReturn:
        """Raise TypeError: rows are in the arrays."""
        counted = [field.name for field in dataclasses.fields(self) if field.compare]  # type: ignore[arg-type]
        arrays = ", ".join(name for name in counted if isinstance(getattr(self, name), np.ndarray))
        raise _NotASequence(f"{type(self).__name__}: not a sequence; its rows are in the arrays {arrays}")

    @functools.cached_property
    def _sides(self) -> Sides:
        if self.layout is None:
            raise ValueError(
                f"{type(self).__name__}: has no layout of meshes; use a result of a detector, or Scene.locate"
            )
        pairs = self._pairs()
        return Sides.zeros(sum(map(len, pairs.values()))).fill(self.layout, **pairs)

    @property
    def mesh_a(self) -> Indices:
        """(n,) uint32: the number of the mesh of side a of each row: of the vertex, or of edge a. `Scene.mesh_names`
        has the names."""
        return self._sides.mesh_a

    @property
    def mesh_b(self) -> Indices:
        """(n,) uint32: the number of the mesh of side b of each row: of the face, of edge b, or of the plane."""
        return self._sides.mesh_b

    @property
    def local_a(self) -> Indices:
        """(n, 2) uint32: side a in indices of its own mesh: the vertex and 2**32 - 1, or both vertices of the edge."""
        return self._sides.local_a

    @property
    def local_b(self) -> Indices:
        """(n, 2) uint32: side b in indices of its own mesh: the face and 2**32 - 1, or both vertices of the edge;
        for planes both are 2**32 - 1."""
        return self._sides.local_b


def with_outputs(
    found: dict[str, Any], outputs: tuple[str, ...], arrays: dict[str, OutputArray] = OUTPUT_ARRAYS
) -> dict[str, Any]:
    """The result of the core, with the requested outputs in a dict of their own."""
    # A loop, not comprehensions, which cost 1.3 us of a call of 15.
    kept = {}
    for name, (asked, _, _) in arrays.items():
        array = found.pop(name, None)
        if array is not None and asked in outputs:
            kept[name] = array
    found["outputs"] = kept
    return found


def result_of(kind: type[Result], found: dict[str, Any], layout: MeshLayout | None) -> Result:
    """The result of this kind from what the core returns."""
    if slices := found.get("slices"):
        found["slices"] = Slices(**slices)
    found["layout"] = layout
    # A frozen dataclass's own __init__ costs 1 us of a call of 12.
    result = object.__new__(kind)
    vars(result).update(found)
    return result
