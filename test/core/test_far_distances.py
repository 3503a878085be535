# SPDX-License-Identifier: Apache-2.0
"""Smallest distances where bounds tell little, of meshes far apart or everywhere nearly equally near, against the exact
oracle: at each tier, with any number of threads and whatever was asked before."""

import numpy as np
import pytest
import random_scenes
from scene_pairs import size_of
from test_distances import assert_gaps, told

import hpccd_core as hc
from hpccd_core import _core

TIERS = ("exact", "conservative", "balanced", "fast")


def grid(n, height=0.0, slope=0.0):
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    return random_scenes.sheet(n), np.stack([x.ravel(), y.ravel(), height + slope * x.ravel()], axis=1)


def sphere(n, radius, shift=(0, 0, 0)):
    u, v = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, n), indexing="ij")
    unit = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=2).reshape(-1, 3)
    return random_scenes.sheet(n), radius * unit + shift


def body(rng, shift):
    faces, start, _ = random_scenes.tetrahedron(rng)
    return faces, start + shift


def turned(meshes, rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return [(mesh[0], np.asarray(mesh[1]) @ turn, *mesh[2:]) for mesh in meshes]


def far(rng):
    """Along a diagonal, where boxes of any feature are within the smallest distance along each axis."""
    faces, start, _ = random_scenes.crumpled_sheet(rng, 5)
    return [(faces, start), body(rng, [30, 29, 31]), body(rng, [-40, 35, 3]), sphere(6, 2, [300, -310, 290])]


def parallel(rng):
    return [grid(6), grid(6, 0.25), grid(5, -2.0)]


def parallel_turned(rng):
    return turned([grid(6), grid(6, 0.25), grid(6, 4.0)], rng)


def nearly_parallel(rng):
    return turned([grid(6), grid(6, 0.5, 1e-9), grid(6, 1.5, -1e-5)], rng)


def concentric(rng):
    return [sphere(7, 1.0), sphere(7, 1.25), sphere(6, 3.0), body(rng, [0, 0, 0])]


def degenerate(rng):
    """Faces that are edges, points, or flat; vertices in one place."""
    faces = np.array([[0, 1, 1], [2, 2, 2], [3, 4, 5], [0, 3, 3]])
    flat = np.stack([np.arange(6.0), 2 * np.arange(6.0), -np.arange(6.0)], axis=1)
    same = np.tile([[4.0, 1.0, 2.0]], (6, 1))
    return [(faces, flat), (faces, same + [9, 9, 9]), (faces, flat[::-1] + [0, 12, 12]), body(rng, [20, 0, 0])]


def touching(rng):
    faces, start = grid(5)
    return [
        (faces, start),
        (faces, start + [2, 0, 0]),
        (faces, start + [2, 2, 1]),
        (faces, start * [1, 1, 0] + [0, 0, 1]),
    ]


def intersecting(rng):
    faces, start = grid(5)
    return [(faces, start), (faces, start[:, [0, 2, 1]]), (faces, start + [30, 30, 30]), sphere(6, 0.5, [30, 30, 30])]


def single_triangles(rng):
    return [([[0, 1, 2]], rng.normal(0, 0.1, (3, 3)) + rng.uniform(-9, 9, 3)) for _ in range(8)]


def ropes_and_points(rng):
    """Points are tested against faces alone: not against ropes, however near, nor against a rope that hangs
    from a face."""
    no_faces = random_scenes.NO_FACES
    rope = [random_scenes.rope(rng, n) for n in (20, 9)]
    points = no_faces, rng.normal(0, 1, (12, 3)) + [25, -25, 25]
    hanging = [[0, 1, 2]], np.array([[25, -25, 90], [26, -25, 90], [25, -26, 95], [25, -25, 24.0]]), [[2, 3]]
    return [
        (no_faces, rope[0][1], rope[0][3]),
        (no_faces, rope[1][1] + [20, 20, 20], rope[1][3]),
        points,
        hanging,
        body(rng, [-30, 30, 30]),
    ]


def ties(rng):
    """Cubes on a lattice: many pairs are exactly as near."""
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T.astype(float)
    a, b, c, d, e, f, g, h = range(8)
    faces = np.array([[a, b, c], [b, d, c], [e, g, f], [f, g, h], [a, e, b], [b, e, f], [c, d, g], [d, h, g]])
    return [(faces, corners + shift) for shift in ([0, 0, 0], [3, 0, 0], [0, 8, 0], [4, 8, 16])]


def tiny_beside_huge(rng):
    faces, start = grid(5)
    return [
        (faces, 2.0**30 * start),
        (faces, 2.0**-30 * start + [0, 0, 1]),
        (faces, 2.0**-30 * start + [0, 0, 2.0**20]),
    ]


def far_beside_their_size(rng):
    """Single precision has one distance for all pairs of their features. A face leads from one to the other."""
    faces, start, _ = random_scenes.crumpled_sheet(rng, 5)
    by = np.array([1e7, 0.7e7, 0.9e7])
    bridge = np.array([[0, 1, 2]]), np.stack([start[3], start[7] + [0, 3, 0], start[11] + by])
    return [(faces, start), (faces, start[::-1] + by), body(rng, by - [9, 8, 7]), bridge]


def tiny_inside_a_dome(rng):
    return [sphere(8, 1.0), (sphere(5, 1e-7)[0], sphere(5, 1e-7)[1] + [0.1, 0, 0]), body(rng, [0, 0, 1e5])]


def with_an_escaped_vertex(rng):
    faces, start, _ = random_scenes.crumpled_sheet(rng, 5)
    start[12] = [1e8, 2e8, -1e8]
    return [(faces, start), (faces, start[::-1] + [0.5, 0.5, 3]), sphere(5, 1, [3, 3, 9])]


SCENES = (
    far,
    far_beside_their_size,
    tiny_inside_a_dome,
    with_an_escaped_vertex,
    parallel,
    parallel_turned,
    nearly_parallel,
    concentric,
    degenerate,
    touching,
    intersecting,
    single_triangles,
    ropes_and_points,
    ties,
    tiny_beside_huge,
)


def scene_of(generate):
    rng = np.random.default_rng(7)
    return random_scenes.combine(*[(m[0], m[1], m[1], *m[2:]) for m in generate(rng)])


@pytest.mark.parametrize("generate", SCENES)
@pytest.mark.parametrize("scale", [1.0, 2.0**400, pytest.param(2.0**-400, marks=pytest.mark.long)])
def test_distances(generate, scale):
    meshes = scene_of(generate)
    vertices = meshes.vertices_t0 * scale
    results = []
    for accuracy in TIERS:
        for threads in (1, 7):
            detector = hc.Detector(meshes.scene(), accuracy=accuracy, threads=threads, backend="cpu")
            gaps = detector.distances(vertices)
            results.append(told(gaps))
            detector.distances(np.roll(vertices, 1, axis=0))  # another question between leaves nothing behind
            results.append(told(detector.distances(vertices)))
    assert_gaps(gaps, meshes, vertices, {}, size_of(vertices))
    assert all(result == results[0] for result in results)


@pytest.mark.parametrize("generate", SCENES)
def test_every_instruction_set(generate):
    meshes = scene_of(generate)
    results = [
        told(hc.Detector(meshes.scene(), simd=simd, backend="cpu").distances(meshes.vertices_t0))
        for simd in _core.simd_levels()
    ]
    assert all(result == results[0] for result in results)


def test_of_equally_near_pairs_the_first_is_named():
    """Unit cubes three apart: all of their facing features are, of which a vertex and a face come first."""
    gaps = {
        (g.mesh_a, g.mesh_b): g
        for g in hc.Detector(scene_of(ties).scene(), backend="cpu").distances(scene_of(ties).vertices_t0)
    }
    gap = gaps["mesh0", "mesh1"]
    assert (gap.distance, gap.kind) == (2.0, "vertex-face")
    assert gap.features[0] == min(v for v in range(8) if scene_of(ties).vertices_t0[v, 0] == 1)


@pytest.mark.parametrize("shift", [(9.0, 8.0, 7.0), (0.0, 0.0, 0.3), (1e4, -1e4, 1e4)])
def test_few_pairs_are_looked_at(shift):
    """Of sheets that are apart, a small part of the 930,000 pairs of features."""
    faces, start = grid(17)
    meshes = random_scenes.combine((faces, start, start), (faces, start + shift, start + shift))
    detector = hc.Detector(meshes.scene(no_self_collision=(0, 1)), backend="cpu", threads=1)
    detector.distances(meshes.vertices_t0)
    assert detector.stats["ee_candidates"] + detector.stats["vf_candidates"] < 60_000
