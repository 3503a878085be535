# SPDX-License-Identifier: Apache-2.0
"""Shapes of a link, as in its description; lengths in metres."""

from dataclasses import dataclass

from hpccd_core.rigid.transform import Rigid


@dataclass(frozen=True)
class Box:
    """Lengths along x, y and z, one of which may be 0; the origin is the centre."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """Along z; the origin is its centre."""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    radius: float


@dataclass(frozen=True)
class Capsule:
    """A cylinder along z with half a sphere at each end, not included in its length."""

    radius: float
    length: float


@dataclass(frozen=True)
class MeshFile:
    """``uri``: as in the description; ``scale``: of x, y, z, before the origin is applied."""

    uri: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Shape = Box | Cylinder | Sphere | Capsule | MeshFile


@dataclass(frozen=True, eq=False)
class Placed:
    """``origin`` transforms coordinates of the shape to those of its link. ``line``: of the description."""

    shape: Shape
    origin: Rigid
    line: int
