# SPDX-License-Identifier: Apache-2.0
"""Summaries of pairs of meshes: contacts and smallest distance of each in a step, and approach speeds. No ROS."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc
from hpccd_core.mesh_layout import mesh_of
from hpccd_ros.detect.step_detector import Detection


@dataclass(frozen=True)
class PairSummary:
    """``count`` contacts, the first at ``first_toc`` (+inf: none); ``distance`` at the step's end, NaN: unknown."""

    mesh_a: str
    mesh_b: str
    count: int
    first_toc: float
    distance: float


def summarise(found: Detection) -> list[PairSummary]:
    """One for each pair that the scene of the step tests, about all contacts found."""
    names = found.layout.mesh_names
    counts, earliest = _by_pair(found)
    index = {name: number for number, name in enumerate(names)}
    distances = {frozenset((gap.mesh_a, gap.mesh_b)): gap.distance for gap in found.gaps or ()}
    return [
        PairSummary(
            a,
            b,
            int(counts[index[a], index[b]]),
            float(earliest[index[a], index[b]]),
            float(distances.get(frozenset((a, b)), math.nan)),
        )
        for a, b in found.tested_pairs
    ]


def _by_pair(found: Detection) -> tuple[np.ndarray, np.ndarray]:
    """(K, K): number of contacts of the meshes i <= j, and their earliest time."""
    contacts, vertices, faces = found.contacts, found.layout.vertex_offsets, found.layout.face_offsets
    meshes = len(found.layout.mesh_names)
    counts, earliest = np.zeros(meshes * meshes, np.int64), np.full(meshes * meshes, math.inf)
    for first, second, offsets, toc in (
        (contacts.vf[:, 0], contacts.vf[:, 1], faces, contacts.vf_toc),
        (contacts.ee[:, 0], contacts.ee[:, 2], vertices, contacts.ee_toc),
    ):
        a, b = mesh_of(first, vertices), mesh_of(second, offsets)
        pair = np.minimum(a, b) * meshes + np.maximum(a, b)
        counts += np.bincount(pair, minlength=meshes * meshes)
        np.minimum.at(earliest, pair, toc)
    return counts.reshape(meshes, meshes), earliest.reshape(meshes, meshes)


def directions(gaps: Sequence[hc.Gap]) -> NDArray[np.float64]:
    """(P, 3): unit vector from the first nearest point to the second; 0 if there is none."""
    found = np.zeros((len(gaps), 3))
    for row, gap in enumerate(gaps):
        if not gap.kind or gap.distance == 0:
            continue
        # Halved, because the difference of points of opposite signs may overflow.
        along = gap.points[1] / 2 - gap.points[0] / 2
        if largest := np.abs(along).max():  # points that differ by less than their rounding have no direction
            along = along / largest  # squares neither overflow nor vanish
            found[row] = along / np.linalg.norm(along)
    return found


def approach_speeds(before: Sequence[hc.Gap] | None, now: Sequence[hc.Gap], seconds: float) -> NDArray[np.float64]:
    """(P,): decrease of the distances per second; > 0: approaching. NaN: unknown.

    before: gaps of the same pairs of meshes, ``seconds`` ago; None: unknown.

    Distances are compared, not the velocities of the nearest points: other points may be nearest in the next
    snapshot, and then their velocities are unrelated to the distance.
    """
    if before is None or len(before) != len(now) or not seconds > 0:
        return np.full(len(now), np.nan)
    then, distances = (np.array([gap.distance for gap in gaps], dtype=float) for gaps in (before, now))
    known = np.isfinite(then) & np.isfinite(distances)
    speeds = np.full(len(now), np.nan)
    speeds[known] = (then[known] - distances[known]) / seconds
    return speeds
