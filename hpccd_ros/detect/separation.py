# SPDX-License-Identifier: Apache-2.0
"""Separations and thicknesses of the meshes of a scene, and deviation bounds of their motion. No ROS."""

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc
from hpccd_ros.detect.layout import Layout, meshes_of_contacts


@dataclass(frozen=True)
class Separation:
    """``minimum``: for the whole scene; 0: features must touch. ``pairs``: (mesh, mesh, distance) for pairs with
    another separation; the same name twice: within the mesh. In the unit of the scene.
    """

    minimum: float = 0.0
    pairs: tuple[tuple[str, str, float], ...] = ()

    @property
    def text(self) -> str:
        """In words, each distance with the digits that distinguish it from all others; empty if features must touch."""
        if self == Separation():
            return ""
        return ", ".join([_number(self.minimum), *(f"{a}:{b}:{_number(distance)}" for a, b, distance in self.pairs)])

    def among(self, names: Collection[str]) -> "Separation":
        """The separation for a scene of these meshes."""
        kept = tuple(entry for entry in self.pairs if entry[0] in names and entry[1] in names)
        return Separation(self.minimum, kept)

    def table(self, names: tuple[str, ...]) -> NDArray[np.float64]:
        """(K, K): the separation of each pair of the K meshes."""
        index = {name: number for number, name in enumerate(names)}
        values = np.full((len(names), len(names)), float(self.minimum))
        for mesh_a, mesh_b, distance in self.pairs:
            a, b = index[mesh_a], index[mesh_b]
            values[a, b] = values[b, a] = distance
        return values

    def unusable(self) -> str | None:
        """Why it is invalid, or None."""
        for what, distance in [("", self.minimum), *((f"{a}:{b}: ", d) for a, b, d in self.pairs)]:
            if not (math.isfinite(distance) and distance >= 0):
                return f"{what}a separation must be finite and not negative, not {distance}"
        return None


def _number(distance: float) -> str:
    short = f"{distance:g}"
    return short if float(short) == distance else repr(float(distance))


#: Features must touch.
NONE = Separation()

#: (mesh, thickness) of meshes that are not infinitely thin.
Thickness = tuple[tuple[str, float], ...]

#: The core rejects more.
MOST_THICKNESS = 1e300


@dataclass(frozen=True)
class MotionBounds:
    """``parts``: number of parts of the step. ``of_meshes``: deviation bound of each mesh."""

    parts: int = 0
    of_meshes: tuple[float, ...] = ()


#: No mesh moves by poses.
NO_BOUNDS = MotionBounds()


def change_separation(detector: hc.Detector, names: tuple[str, ...], old: Separation, new: Separation) -> None:
    """From the next call of ``detector`` on, use ``new`` instead of ``old``; its scene is not rebuilt."""
    before, after = old.table(names), new.table(names)
    for a, b in np.argwhere(np.triu(before != after)).tolist():
        detector.set_separation(names[a], names[b], float(after[a, b]))


def change_thickness(detector: hc.Detector, old: Thickness, new: Thickness) -> None:
    """From the next call of ``detector`` on, use ``new`` instead of ``old``; its scene is not rebuilt."""
    before, after = dict(old), dict(new)
    for name in {**before, **after}:
        if before.get(name, 0.0) != after.get(name, 0.0):
            detector.set_thickness(name, after.get(name, 0.0))


def count_near(contacts: hc.Contacts, layout: Layout, separation: Separation, thickness: Thickness = ()) -> int:
    """Number of contacts of meshes with a separation, or a thickness, whether they touch or not."""
    if not separation.pairs and not thickness:  # the usual case costs nothing
        return len(contacts) if separation.minimum > 0 else 0
    apart = separation.table(layout.mesh_names) > 0
    for name, value in thickness:
        number = layout.mesh_names.index(name)
        if value > 0:
            apart[number, :] = apart[:, number] = True
    return sum(int(np.count_nonzero(apart[a, b])) for a, b, _ in meshes_of_contacts(contacts, layout))
