# SPDX-License-Identifier: Apache-2.0
"""Meshes of solids contain them, and stand out no more than they say."""

import re
from collections import Counter

import numpy as np
import pytest

from hpccd_ros.robots import solids
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.shapes import Box, Capsule, Cylinder, Sphere

ROUND = [Cylinder(0.3, 1.1), Cylinder(2.0, 0.01), Sphere(0.4), Sphere(5.0), Capsule(0.2, 0.7), Capsule(0.3, 0.001)]
ALL = [Box((0.2, 1.0, 3.0)), *ROUND]
TOLERANCES = (1.0, 0.05, 1e-3)


def surface(solid, rng, count):
    """Points of its surface."""
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    if isinstance(solid, Box):
        return direction / np.abs(direction).max(axis=1)[:, None] * np.array(solid.size) / 2
    if isinstance(solid, Sphere):
        return direction * solid.radius
    if isinstance(solid, Capsule):
        along = rng.uniform(-1, 1, count) * solid.length / 2
        rim = np.sign(direction[:, 2]) * solid.length / 2
        side = direction * [1, 1, 0] / np.linalg.norm(direction[:, :2], axis=1)[:, None]
        walls = side * solid.radius + along[:, None] * [0, 0, 1]
        return np.where(rng.random(count)[:, None] < 0.5, walls, direction * solid.radius + rim[:, None] * [0, 0, 1])
    angle, half = rng.uniform(0, 2 * np.pi, count), solid.length / 2
    radius = solid.radius * np.where(rng.random(count) < 0.5, 1.0, rng.random(count))
    z = np.where(radius == solid.radius, rng.uniform(-half, half, count), half * rng.choice([-1, 1], count))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def distance(solid, points):
    """From the solid, 0 inside."""
    if isinstance(solid, Box):
        return np.linalg.norm(np.maximum(np.abs(points) - np.array(solid.size) / 2, 0), axis=1)
    if isinstance(solid, Cylinder):
        out = np.maximum(np.linalg.norm(points[:, :2], axis=1) - solid.radius, 0)
        return np.hypot(out, np.maximum(np.abs(points[:, 2]) - solid.length / 2, 0))
    half = solid.length / 2 if isinstance(solid, Capsule) else 0.0
    centre = np.column_stack([np.zeros((len(points), 2)), np.clip(points[:, 2], -half, half)])
    return np.maximum(np.linalg.norm(points - centre, axis=1) - solid.radius, 0)


def winding(points, vertices, faces):
    """How often the surface goes round each point: the solid angles of its triangles, 1 inside."""
    total = np.zeros(len(points))
    for number, point in enumerate(points):
        a, b, c = (vertices[faces[:, k]] - point for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        above = (a * np.cross(b, c)).sum(axis=1)
        below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
        total[number] = 2 * np.arctan2(above, below).sum()
    return total / (4 * np.pi)


def height(points, vertices, faces):
    """Over the plane of the face that is highest above each point: negative inside a convex surface."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    offset = (normal * a).sum(axis=1)
    return np.array([(normal @ point - offset).max() for point in points])


def samples(vertices, faces, rng, count):
    weights = rng.dirichlet(np.ones(3), count)
    return (vertices[faces[rng.integers(len(faces), size=count)]] * weights[:, :, None]).sum(axis=1)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("solid", ALL, ids=str)
def test_the_solid_lies_in_its_mesh(solid, tolerance):
    rng = np.random.default_rng(3)
    vertices, faces = solids.triangles(solid, tolerance)
    # Just below the surface, where the mesh is nearest; flat ends are the mesh's own.
    points = surface(solid, rng, 400) * (1 - 1e-9)
    assert height(points, vertices, faces).max() < 0 < height(points * 50, vertices, faces).min()
    # A face too many or too few changes what goes round each point.
    assert np.abs(winding(points[:20], vertices, faces) - 1).max() < 1e-6
    assert np.abs(winding(points[:20] * 50, vertices, faces)).max() < 1e-6


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("solid", ROUND, ids=str)
def test_the_planes_of_round_sides_are_no_nearer_than_the_radius(solid, tolerance):
    """Exact but for the rounding of this test: beyond the radius even where a random point would miss it."""
    vertices, faces = solids.triangles(solid, tolerance)
    half = 0.0 if isinstance(solid, Sphere) else solid.length / 2
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    flat = np.abs(normal[:, 2]) > 0.5 if isinstance(solid, Cylinder) else np.zeros(len(faces), bool)
    assert (np.abs(a[flat, 2]) == half).all()
    for z in (-half, half):  # of a convex solid: the plane supports the ball at each end
        assert (normal * (a - [0, 0, z])).sum(axis=1)[~flat].min() >= solid.radius * (1 + 1e-12)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("solid", ALL, ids=str)
def test_no_point_of_the_mesh_stands_out_more_than_it_says(solid, tolerance):
    vertices, faces = solids.triangles(solid, tolerance)
    bound = solids.outstanding(solid, tolerance)
    assert bound <= tolerance
    points = np.concatenate([vertices, samples(vertices, faces, np.random.default_rng(4), 2000)])
    worst = distance(solid, points).max()
    assert worst <= bound + 1e-14
    if isinstance(solid, Box):
        assert bound == distance(solid, vertices).max() == 0.0
    else:
        assert worst > 0.9 * bound  # corners reach it


@pytest.mark.parametrize("solid", ALL, ids=str)
def test_meshes_are_closed_and_turned_outwards(solid):
    vertices, faces = solids.triangles(solid, 0.01)
    edges = Counter((int(f[k]), int(f[(k + 1) % 3])) for f in faces for k in range(3))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert sorted(set(faces.ravel().tolist())) == list(range(len(vertices)))
    assert len(vertices) - len(edges) // 2 + len(faces) == 2
    assert len(np.unique(vertices, axis=0)) == len(vertices)


def test_a_smaller_tolerance_takes_more_triangles():
    counts = [len(solids.triangles(Sphere(0.1), tolerance)[1]) for tolerance in (0.1, 0.01, 0.001, 1e-4)]
    assert counts == sorted(set(counts))


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), 1e-9])
def test_tolerances_that_cannot_be_kept_are_rejected(tolerance):
    with pytest.raises(RobotError, match="tolerance"):
        solids.triangles(Cylinder(1.0, 1.0), tolerance)


COUNTS = range(solids.FEWEST_SEGMENTS, solids.MOST_SEGMENTS + 1, 4)


@pytest.mark.parametrize("kind", [Cylinder, Sphere])
def test_the_segments_are_the_fewest_that_keep_the_tolerance(kind):
    solid = Sphere(1.0) if kind is Sphere else Cylinder(1.0, 1.0)
    inner = [solids._inner(solid, count) for count in COUNTS]
    assert inner == sorted(inner)
    low, high = solids._OF_SPHERE if kind is Sphere else solids._OF_CYLINDER
    assert all(low < (1.0 - d) * (count / 4) ** 2 < high for d, count in zip(inner, COUNTS, strict=True))
    rng = np.random.default_rng(5)
    for radius, share in zip(10.0 ** rng.uniform(-3, 3, 100), 10.0 ** rng.uniform(-4.2, 1, 100), strict=True):
        solid = Sphere(radius) if kind is Sphere else Cylinder(radius, 1.0)
        found = solids.segments(solid, radius * share)
        keep = [count for count in COUNTS if solids._stands_out(solid, count) <= radius * share]
        assert found == keep[0]


@pytest.mark.parametrize("solid", [Sphere(100.0), Capsule(1e6, 1.0), Cylinder(1e12, 1.0), Sphere(1e300)], ids=str)
def test_what_is_too_large_for_its_tolerance_says_which_tolerance_would_do(solid):
    solids._inner_of_sphere.cache_clear()
    with pytest.raises(RobotError, match="would need more than 512 segments per ring; set the tolerance to") as no:
        solids.triangles(solid, 1e-3)
    assert solids._inner_of_sphere.cache_info().misses <= 1
    assert solids.segments(solid, float(re.search("tolerance to (.*) or more", str(no.value))[1])) >= 500


def test_few_spheres_are_made_to_find_the_segments_of_one_and_fewer_are_kept():
    for cache in (solids._inner_of_sphere, solids._half_sphere):
        cache.cache_clear()
    for number, radius in enumerate(np.geomspace(0.01, 15.0, 30), 1):
        solids.segments(Sphere(radius), 1e-3)
        assert solids._inner_of_sphere.cache_info().misses <= 6 * number
    assert solids._half_sphere.cache_info().currsize <= 4
