# SPDX-License-Identifier: Apache-2.0
"""Boxes, cylinders, spheres and capsules as closed triangle meshes that contain them.

A box is exact; one without thickness is a rectangle. Round shapes get a mesh around them, so that everything that
touches the solid touches or enters the mesh. No point of the mesh is farther outside the solid than `outstanding`, at
most the requested tolerance.

Why the mesh contains the solid. *Cylinder*: its ring is a regular polygon of n corners at the distance R from the axis;
the sides are at R cos(pi/n) from it, which is the radius r. *Sphere*: rings of 0, 4, 8, ..., 4n, ..., 8, 4, 0 corners,
all at the distance R from the centre, with the planes of all triangles at least at d R from it; d is computed. The
surface surrounds the centre and is no closer to it than the nearest of these planes; R = r / d. *Capsule*: that
sphere cut at its widest ring, with walls of the capsule's length between both halves. The half balls at its ends are
contained like the sphere; each edge of the ring lies in a triangle, so it is at least at d R from the axis.
How far it is outside: each point of these surfaces is within R of the axis, the centre, or the segment between the
centres, and no farther along the axis than the solid, where that has flat ends: R - r.

Each R is multiplied by 1 + 2**-36. That exceeds the rounding errors of R and of the positions of the corners (64 times
2**-53 of their distance from the link's origin, up to 2,000 radii).
"""

import math
from bisect import bisect_left
from functools import lru_cache

import numpy as np

from hpccd_core import shapes
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.shapes import Box, Capsule, Cylinder, Sphere

Solid = Box | Cylinder | Sphere | Capsule
Triangles = tuple[np.ndarray, np.ndarray]

FEWEST_SEGMENTS = 8  # of a ring
MOST_SEGMENTS = 512
_LARGER = 1.0 + 2.0**-36
# 1 - `_inner` lies between these over (count / 4)**2; a test checks it for each count.
_OF_CYLINDER, _OF_SPHERE = (0.3, 0.32), (0.7, 1.1)


def triangles(solid: Solid, tolerance: float) -> Triangles:
    """(vertices (n,3) float64, faces (F,3) uint32), normals outwards. tolerance: how far it may be outside the solid.

    Raises RobotError: a tolerance that is not above 0, or needs more than MOST_SEGMENTS a ring.
    """
    if isinstance(solid, Box):
        return shapes.box(solid.size)
    if isinstance(solid, Cylinder):
        return _cylinder(solid, segments(solid, tolerance))
    return _rounded(solid, segments(solid, tolerance))


def outstanding(solid: Solid, tolerance: float) -> float:
    """How far the mesh of that tolerance is outside the solid at most."""
    if isinstance(solid, Box):
        return 0.0
    return _stands_out(solid, segments(solid, tolerance))


def segments(solid: Cylinder | Sphere | Capsule, tolerance: float) -> int:
    """Corners of the widest ring: the fewest, a multiple of 4, that keep the tolerance."""
    if not tolerance > 0.0:
        raise RobotError(f"tolerance {tolerance:g}: must be above 0")
    counts = range(FEWEST_SEGMENTS, MOST_SEGMENTS + 1, 4)
    # More corners bring the mesh closer to the solid. Few counts are tried, because each needs the mesh of a sphere.
    room = 1.0 - _LARGER / (1.0 + tolerance / solid.radius)  # bound on 1 - `_inner`
    shares = _OF_CYLINDER if isinstance(solid, Cylinder) else _OF_SPHERE
    low, high = (4.0 * math.sqrt(share / room) if room > 0.0 else math.inf for share in shares)
    first, last = (bisect_left(counts, bound) for bound in (low, high))
    at = bisect_left(counts, True, first, last, key=lambda count: _stands_out(solid, count) <= tolerance)
    if at < len(counts):
        return counts[at]
    raise RobotError(
        f"tolerance {tolerance:g}: a radius of {solid.radius:g} would need more than {MOST_SEGMENTS} segments per "
        f"ring; set the tolerance to {_two_digits_up(_stands_out(solid, MOST_SEGMENTS)):g} or more, or make the shape "
        "smaller"
    )


def _stands_out(solid: Cylinder | Sphere | Capsule, count: int) -> float:
    return solid.radius * (_LARGER / _inner(solid, count) - 1.0)


def _two_digits_up(number: float) -> float:
    step = 10.0 ** (math.floor(math.log10(number)) - 1)
    return math.ceil(number / step) * step


def _inner(solid: Cylinder | Sphere | Capsule, count: int) -> float:
    """The radius of the solid that a mesh with corners at distance 1 contains."""
    return math.cos(math.pi / count) if isinstance(solid, Cylinder) else _inner_of_sphere(count // 4)


def _ring(count: int) -> list[tuple[float, float]]:
    return [(math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count)) for k in range(count)]


def _cylinder(cylinder: Cylinder, count: int) -> Triangles:
    radius, top = cylinder.radius / _inner(cylinder, count) * _LARGER, cylinder.length / 2
    ring = np.array(_ring(count)) * radius
    ends = [np.column_stack([ring, np.full(count, z)]) for z in (-top, top)]
    vertices = np.concatenate([*ends, [[0.0, 0.0, -top], [0.0, 0.0, top]]])
    faces = []
    for k in range(count):
        n = (k + 1) % count
        faces += [
            (k, n, count + n),
            (k, count + n, count + k),
            (2 * count, n, k),
            (2 * count + 1, count + k, count + n),
        ]
    return vertices, np.array(faces, np.uint32)


def _rounded(solid: Sphere | Capsule, count: int) -> Triangles:
    n = count // 4
    radius = solid.radius / _inner_of_sphere(n) * _LARGER
    upper, faces = _half_sphere(n)
    if isinstance(solid, Sphere):
        # Both halves share the widest ring, whose corners are the last ones.
        inner = len(upper) - count
        lower = upper[:inner] * [1.0, 1.0, -1.0]
        mirrored = np.where(faces < inner, faces + len(upper), faces)[:, ::-1]
        return np.concatenate([upper, lower]) * radius, np.concatenate([faces, mirrored]).astype(np.uint32)
    shift = np.array([0.0, 0.0, solid.length / 2])
    vertices = np.concatenate([upper * radius + shift, upper * [1.0, 1.0, -1.0] * radius - shift])
    first, second = len(upper) - count, 2 * len(upper) - count
    walls = []
    for k in range(count):
        m = (k + 1) % count
        walls += [(second + k, second + m, first + m), (second + k, first + m, first + k)]
    return vertices, np.concatenate([faces, faces[:, ::-1] + len(upper), walls]).astype(np.uint32)


@lru_cache(maxsize=4)  # up to 2.4 MB each
def _half_sphere(n: int) -> Triangles:
    """Of radius 1, z not negative: the pole, then ring after ring of 4, 8, ..., 4n corners; open below."""
    vertices = [(0.0, 0.0, 1.0)]
    for k in range(1, n + 1):
        angle = math.pi / 2 * k / n
        sine, z = math.sin(angle), math.cos(angle) if k < n else 0.0
        vertices += [(x * sine, y * sine, z) for x, y in _ring(4 * k)]
    faces = []
    for k in range(1, n + 1):
        quarter, j = np.divmod(np.arange(4 * k), k)
        a, b = _corners(k, quarter * k + j), _corners(k, quarter * k + j + 1)
        above, beside = (_corners(k - 1, quarter * (k - 1) + j + more) for more in (0, 1))
        both = np.stack([above, a, b, above, b, beside], axis=1).reshape(-1, 3)
        faces.append(both[np.column_stack([np.full(4 * k, True), j + 1 < k]).ravel()])
    return np.array(vertices), np.concatenate(faces)


def _corners(ring: int, numbers: np.ndarray) -> np.ndarray:
    """Indices of the corners of ring k: there are 1 + 4 (1 + ... + k - 1) corners before it."""
    return 1 + 2 * ring * (ring - 1) + numbers % (4 * ring) if ring else np.zeros_like(numbers)


@lru_cache(maxsize=MOST_SEGMENTS // 4)
def _inner_of_sphere(n: int) -> float:
    """From the centre to the nearest plane of a triangle, of the sphere of radius 1."""
    vertices, faces = _half_sphere(n)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    away = (normals * a).sum(axis=1) / np.sqrt((normals * normals).sum(axis=1))
    return float(away.min())
