# SPDX-License-Identifier: Apache-2.0
"""Times of impact and distances with their gradients, as the functions for PyTorch and JAX use them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contacts import Contacts
from .detector import Detector
from .device_distances import DeviceDistances
from .options import Output
from .proximity import Gap, Proximity

NEEDED: tuple[Output, ...] = ("normals", "weights")


@dataclasses.dataclass(frozen=True, eq=False)
class Linearization:
    """n numbers, each with its gradient, which is with respect to the positions of four vertices.

    values: (n,) float64. vertices: (n, 4) int64, numbered through all worlds. gradients: (n, 4, 3) float64 for each
    array of positions; zero where the number has no derivative.
    """

    values: NDArray[np.float64]
    vertices: NDArray[np.int64]
    gradients: tuple[NDArray[np.float64], ...]


def check(detector: object, outputs: tuple[Output, ...] = NEEDED) -> None:
    """Raises TypeError or ValueError unless the detector computes these outputs, on the host."""
    if not isinstance(detector, Detector):
        raise TypeError(f"detector: expected hpccd_core.Detector, got {type(detector).__name__}; create one of a Scene")
    if outputs and detector.results != "host":
        raise ValueError("detector: gradients are computed on the host; create it with results='host'")
    if not set(outputs) <= set(detector._outputs):
        asked = tuple(dict.fromkeys((*detector._outputs, *outputs)))
        raise ValueError(f"detector: gradients need its normals and weights; create it with outputs={asked!r}")


def check_earliest(detector: Any) -> None:
    """Raises TypeError or ValueError unless the detector computes the earliest contact with its gradient."""
    check(detector)
    if detector.report == "any":
        raise ValueError("detector: with report='any' no contact is surely the earliest; use report='first'")


def times(detector: Any, start: object, end: object) -> tuple[Contacts, Linearization]:
    """The contacts of a motion, and their times of impact in the order of their rows."""
    found: Contacts = detector.detect(start, end)
    # Zero instead of NaN: one contact without a derivative would make the sum over all of them NaN.
    g0, g1 = (np.where(np.isnan(g), 0.0, g) for g in found.toc_gradients())
    return found, Linearization(found._values("toc"), _vertices(found, detector), (g0, g1))


def first_times(detector: Any, start: object, end: object) -> Linearization:
    """The earliest time of impact of each world, +inf if it has none. Of equal times the first in order counts."""
    _, every = times(detector, start, end)
    n_worlds, n = detector.worlds or 1, detector.n_vertices
    of_row = every.vertices[:, 0] // max(n, 1)
    order = np.lexsort((every.values, of_row))
    worlds, at = np.unique(of_row[order], return_index=True)
    rows = order[at]
    first = Linearization(
        np.full(n_worlds, np.inf),
        np.zeros((n_worlds, 4), np.int64),
        (np.zeros((n_worlds, 4, 3)), np.zeros((n_worlds, 4, 3))),
    )
    first.values[worlds], first.vertices[worlds] = every.values[rows], every.vertices[rows]
    for of_worlds, of_rows in zip(first.gradients, every.gradients, strict=True):
        of_worlds[worlds] = of_rows[rows]
    return first


def proximity(detector: Any, positions: object, distance: float) -> tuple[Proximity, Linearization]:
    """The pairs within a distance, and their distances in the order of their rows."""
    near: Proximity = detector.proximity(positions, distance)
    gradient = near.weights[:, :, None] * near.normals[:, None, :]
    return near, Linearization(near._values("distance"), _vertices(near, detector), (gradient,))


def smallest_distances(detector: Any, positions: object) -> tuple[Any, Linearization]:
    """What `Detector.distances` returns, and its distances, world by world."""
    found = detector.distances(positions)
    on_host: Any = found.to_host() if isinstance(found, DeviceDistances) else found
    worlds: list[list[Gap]] = [on_host] if detector.worlds is None else on_host
    gaps = [(k, gap) for k, of_world in enumerate(worlds) for gap in of_world]
    vertices, gradient = np.zeros((len(gaps), 4), np.int64), np.zeros((len(gaps), 4, 3))
    for row, (k, gap) in enumerate(gaps):
        if len(gap.vertices):
            vertices[row] = gap.vertices.astype(np.int64) + k * detector.n_vertices
            gradient[row] = gap.weights[:, None] * gap.normal
    return found, Linearization(np.array([gap.distance for _, gap in gaps], float), vertices, (gradient,))


def _vertices(found: Contacts | Proximity, detector: Any) -> NDArray[np.int64]:
    vertices: NDArray[np.int64] = found.vertices + detector.n_vertices * found._worlds_of_rows()[:, None]
    return vertices
