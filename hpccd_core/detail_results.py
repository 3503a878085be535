# SPDX-License-Identifier: Apache-2.0
"""Results of core detectors, with the numbers of the scene, merged."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .mesh_layout import Indices
from .results import OUTPUT_ARRAYS
from .worlds import PAIR_KINDS

#: The columns that are vertices.
_KINDS = {"vf": 1, "ee": 4, "vp": 1, "vv": 2, "ve": 3}


def copied_rows(found: Any) -> dict[str, Any]:
    """The result of a core detector on the host. Rows that a GPU wrote are copied: they are renumbered in place."""
    return {
        name: value if not isinstance(value, np.ndarray) or value.flags.owndata else value.copy()
        for name, value in found.items()
    }


def intersections(core: _core.Detector, vertices: NDArray[Any]) -> Indices:
    found: Any = core.intersections(vertices)
    crossing: Indices = found["ef"].copy()
    return crossing


def count(found: dict[str, Any]) -> int:
    """The number of rows with places in the outputs."""
    return sum(len(found[kind]) for kind in _KINDS if kind in found)


def nothing() -> dict[str, Any]:
    """A result without rows."""
    rows: dict[str, Any] = {kind: np.empty((0, columns), np.uint32) for kind, columns in PAIR_KINDS.items()}
    rows |= {f"{kind}_toc": np.empty(0) for kind in PAIR_KINDS}
    rows |= {name: np.empty((0, *kind.row), kind.dtype) for name, kind in OUTPUT_ARRAYS.items()}
    return {**rows, "bounds": np.empty(0), "first_toc": np.inf, "hash": 0}


def renumbered(found: dict[str, Any], vertices: Indices, first_face: int = 0) -> dict[str, Any]:
    """The result with the vertices of the scene, and faces numbered from this one."""
    for kind, columns in _KINDS.items():
        if kind in found:
            found[kind][:, :columns] = vertices[found[kind][:, :columns]]
    found["vf"][:, 1] += np.uint32(first_face)
    found["vertices"] = vertices[found["vertices"]]
    return found


def translated(gap: tuple[Any, ...], vertices: Indices, first_face: int = 0) -> tuple[Any, ...]:
    """A gap with the vertices of the scene. Coarse meshes do not tell what is inside."""
    a, b, distance, kind, features, points, of_gap, *others, _ = gap
    faces = {"vertex-face": 1, "edge-face": 2}.get(kind, len(features))
    new = [int(vertices[f]) if k < faces else f + first_face for k, f in enumerate(features)]
    return (a, b, distance, kind, new, points, vertices[of_gap], *others, None)


def merged(results: list[dict[str, Any]]) -> dict[str, Any]:
    """The rows of all results, in canonical order."""
    some = [found for found in results if count(found)]
    if len(some) == 1:  # the usual case, without copies
        return {**results[0], **some[0]}
    all_rows, places = dict(results[0]), []
    begins = np.cumsum([0, *map(count, results)])[:-1]
    for kind in PAIR_KINDS:
        rows = np.concatenate([found.get(kind, results[0][kind]) for found in results])
        order = np.lexsort(rows.T[::-1])
        all_rows[kind] = rows[order]
        toc = f"{kind}_toc"
        all_rows[toc] = np.concatenate([found.get(toc, results[0][toc]) for found in results])[order]
        counts = [len(found.get(kind, ())) for found in results]
        places.append(np.concatenate([b + np.arange(n) for b, n in zip(begins, counts, strict=True)])[order])
        begins = begins + counts
    place = np.concatenate(places).astype(np.intp)
    for name in (*OUTPUT_ARRAYS, "bounds"):
        rows = np.concatenate([found.get(name, results[0][name]) for found in results])
        all_rows[name] = rows[place] if len(rows) == len(place) else results[0][name]
    all_rows["first_toc"] = min(found["first_toc"] for found in results)
    return all_rows


def at_time(time_of_impact: float, found: dict[str, Any]) -> dict[str, Any]:
    """The rows with this time."""
    kept = {kind: found[f"{kind}_toc"] == time_of_impact for kind in PAIR_KINDS}
    place = np.concatenate(list(kept.values()))
    if place.all():
        return found
    for kind, those in kept.items():
        found[kind], found[f"{kind}_toc"] = found[kind][those], found[f"{kind}_toc"][those]
    for name in (*OUTPUT_ARRAYS, "bounds"):
        if len(found[name]) == len(place):
            found[name] = found[name][place]
    return found
