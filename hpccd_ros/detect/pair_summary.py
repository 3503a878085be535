# SPDX-License-Identifier: Apache-2.0
"""Summaries of pairs of meshes: contacts and smallest distance of each in a step. No ROS."""

import math
from dataclasses import dataclass

import numpy as np

from hpccd_ros.detect.approach import SIDES_INSIDE, inside_code
from hpccd_ros.detect.layout import meshes_of_contacts
from hpccd_ros.detect.step_detector import Detection


@dataclass(frozen=True)
class PairSummary:
    """``count`` contacts, the first at ``first_toc`` (+inf: none); ``distance`` at the step's end, NaN: unknown;
    ``inside``: 1 if mesh_a lies inside mesh_b then, 2 for the reverse, 3 for both."""

    mesh_a: str
    mesh_b: str
    count: int
    first_toc: float
    distance: float
    inside: int


def summarise(found: Detection) -> list[PairSummary]:
    """One for each pair that the scene of the step tests, about all contacts found."""
    names = found.layout.mesh_names
    counts, earliest = _by_pair(found)
    index = {name: number for number, name in enumerate(names)}
    gaps = {(gap.mesh_a, gap.mesh_b): gap for gap in found.gaps or ()}
    return [
        PairSummary(
            a,
            b,
            int(counts[index[a], index[b]]),
            float(earliest[index[a], index[b]]),
            gaps[a, b].distance if (a, b) in gaps else math.nan,
            inside_code(SIDES_INSIDE[gaps[a, b].inside]) if (a, b) in gaps else 0,
        )
        for a, b in found.tested_pairs
    ]


def _by_pair(found: Detection) -> tuple[np.ndarray, np.ndarray]:
    """(K, K): number of contacts of the meshes i <= j, and their earliest time."""
    meshes = len(found.layout.mesh_names)
    counts, earliest = np.zeros(meshes * meshes, np.int64), np.full(meshes * meshes, math.inf)
    for a, b, toc in meshes_of_contacts(found.contacts, found.layout):
        pair = np.minimum(a, b) * meshes + np.maximum(a, b)
        counts += np.bincount(pair, minlength=meshes * meshes)
        np.minimum.at(earliest, pair, toc)
    return counts.reshape(meshes, meshes), earliest.reshape(meshes, meshes)
