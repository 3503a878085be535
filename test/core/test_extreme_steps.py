# SPDX-License-Identifier: Apache-2.0
"""collision_free_step where coordinates, places and meshes are at their limits."""

import numpy as np
import oracle
import pytest
import random_scenes
from folded_patches import SHAPES

import hpccd_core as hc

TIERS = pytest.mark.parametrize("accuracy", ["exact", "conservative"])


def assert_true(meshes, accuracy="exact", separation=0.0, **rules):
    """The step, after it was compared with the oracle's."""
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    toc = oracle.earliest_contacts(
        v0[None], v1[None], meshes.faces, **meshes.beside_faces, minimum_separation=separation, **rules
    )
    true = min(float(toc[0]), 1.0)
    steps = {
        hc.Detector(
            meshes.scene(**rules), accuracy=accuracy, minimum_separation=separation, backend="cpu", threads=threads
        ).collision_free_step(v0, v1)
        for threads in (1, 3)
    }
    (step,) = steps
    assert true - 1e-9 <= step <= true
    return step


def patch(name):
    faces, start, end, _ = SHAPES[name]()
    return random_scenes.combine((faces, start, end))


@TIERS
@pytest.mark.parametrize("scale", [2.0**-465, 1e-140, 2.0**462, 1e140, 2.0**-1060])
@pytest.mark.parametrize("name", ["spiral_stairs", "book", "fold", "ring_that_stays_open", "unrolled_carpet"])
def test_huge_and_tiny(name, scale, accuracy):
    meshes = patch(name)
    meshes.vertices_t0, meshes.vertices_t1 = meshes.vertices_t0 * scale, meshes.vertices_t1 * scale
    assert_true(meshes, accuracy)


@TIERS
@pytest.mark.parametrize("name", ["spiral_stairs", "rolled_carpet", "discs_joined_at_a_vertex", "ring_that_stays_open"])
def test_far_from_the_origin(name, accuracy):
    """1e6 away with features of 1e-3: the coordinates hold seven digits of them."""
    meshes = patch(name)
    meshes.vertices_t0, meshes.vertices_t1 = (1e6 + 1e-3 * v for v in (meshes.vertices_t0, meshes.vertices_t1))
    assert_true(meshes, accuracy)


@TIERS
@pytest.mark.parametrize("generate", random_scenes.ALL)
def test_random_scenes(generate, accuracy):
    for seed in range(2):
        meshes = generate(np.random.default_rng([90, seed]))
        mesh = np.repeat(np.arange(len(meshes.faces)), meshes.n_vertices)
        meshes.vertices_t0[:, 2] = 0.125 * meshes.vertices_t0[:, 2] + 4 * mesh
        assert_true(meshes, accuracy)
        if generate is not random_scenes.huge_and_tiny:
            assert_true(meshes, accuracy, 0.03125)


@TIERS
def test_already_touching_and_all_on_one_point(accuracy):
    meshes = patch("sphere_that_swells")
    meshes.vertices_t0[:] = 1.0
    assert assert_true(meshes, accuracy) == 0.0
    meshes.vertices_t0, meshes.vertices_t1 = meshes.vertices_t1, meshes.vertices_t0
    assert assert_true(meshes, accuracy) == np.nextafter(1.0, 0), "at the very end"
    meshes.vertices_t1 = meshes.vertices_t0.copy()
    assert assert_true(meshes, accuracy) == 1.0


@pytest.mark.parametrize("separation", [0.0, 0.25])
@pytest.mark.parametrize("accuracy", ["exact", "conservative", "balanced", "fast"])
def test_contact_exactly_at_the_end(accuracy, separation):
    """The whole step would end in contact, from which no later one is free; 0.9 of what is free ends apart."""
    scene = hc.Scene()
    scene.add_mesh("falling", [[0, 1, 2]])
    scene.add_mesh("ground", [[0, 1, 2]], static=True)
    start = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [-5, -5, 0], [5, -5, 0], [0, 5, 0]], float)
    end = start.copy()
    end[:3, 2] = separation
    options = {"accuracy": accuracy, "minimum_separation": separation, "backend": "cpu"}
    detector = hc.Detector(scene, **options)
    step = detector.collision_free_step(start, end)
    assert 1 - 1e-9 <= step < 1
    assert len(detector.detect(start, end)) and not len(detector.detect(start, start + 0.9 * step * (end - start)))
    steps = hc.Detector(scene, worlds=2, **options).collision_free_step(np.stack([start] * 2), np.stack([end, start]))
    assert steps.tolist() == [step, 1.0]


@TIERS
def test_sliding_in_one_plane(accuracy):
    """Sheets that lie in one plane and slide into each other; on each other from the start; past each other."""
    faces, flat = random_scenes.sheet(4), np.array([[x, y, 0] for y in range(4) for x in range(4)], float)
    for start, end, step in (
        ([5.0, 0.5, 0], [1.0, 0.5, 0], 0.5),
        ([1.0, 0.5, 0], [5.0, 0, 0], 0.0),
        ([5.0, 9, 0], [-5.0, 9, 0], 1.0),
        ([3.0, 0, 0], [9.0, 0, 0], 0.0),
    ):
        meshes = random_scenes.combine((faces, flat, flat), (faces, flat + start, flat + end))
        assert assert_true(meshes, accuracy) == pytest.approx(step, abs=1e-9)


@TIERS
def test_first_contact_of_features_far_apart_in_the_tree(accuracy):
    """A vertex of a long strip flies past hundreds of later contacts to touch the other end before they do."""
    n = 200
    x = np.arange(n, dtype=float)
    low = np.stack([x, 0 * x, 0 * x], 1)
    faces = np.concatenate(
        [
            np.stack([np.arange(n - 1), np.arange(1, n), np.arange(n - 1) + n], 1),
            np.stack([np.arange(n - 1) + n, np.arange(1, n), np.arange(1, n) + n], 1),
        ]
    )
    start = np.concatenate([low, low + [0, 1, 0]])
    sheet = random_scenes.combine((faces, start, start), (faces, start + [0, 0.25, 1], start + [0.25, 0.25, -1]))
    assert 0.4 < assert_true(sheet, accuracy) <= 0.5
    point = 2 * n  # the second strip's first vertex is thrown to the other end of the first
    sheet.vertices_t0[point] = [0, 0.5, 0.75]
    sheet.vertices_t1[point] = [3 * n, 0.5, -2.25]
    assert assert_true(sheet, accuracy) == pytest.approx(0.25, abs=1e-6)


@TIERS
def test_fast_rotation_of_bodies_that_stay_apart(accuracy):
    """Boxes of the whole motion overlap, the bodies do not: on straight ways they shrink while they turn."""
    faces, ball, _, _ = SHAPES["sphere_that_swells"]()
    turn = np.array([[-0.6, -0.8, 0], [0.8, -0.6, 0], [0, 0, 1]])
    beside = [2.125, 0, 0]
    meshes = random_scenes.combine((faces, ball, ball @ turn), (faces, ball + beside, ball @ turn + beside))
    assert assert_true(meshes, accuracy) == 1.0


@TIERS
def test_next_to_nothing(accuracy):
    """No mesh, one triangle, points alone, an empty mesh among others, faces without area."""
    empty = hc.Detector(hc.Scene(), accuracy=accuracy, backend="cpu")
    assert empty.collision_free_step(np.empty((0, 3)), np.empty((0, 3))) == 1.0
    triangle = np.array([[0, 1, 2]]), np.eye(3), -np.eye(3)
    points = np.empty((0, 3), int), np.zeros((5, 3)), np.ones((5, 3))
    nothing = np.empty((0, 3), int), np.empty((0, 3)), np.empty((0, 3))
    for meshes in (
        random_scenes.combine(triangle),
        random_scenes.combine(points),
        random_scenes.combine(nothing),
        random_scenes.combine(nothing, triangle, nothing),
    ):
        assert assert_true(meshes, accuracy) == 1.0
    assert assert_true(random_scenes.combine(points, triangle), accuracy) < 1.0
    flat = np.array([[0, 0, 0], [0, 0, 1], [3, 3, 3]]), np.eye(4, 3), np.eye(4, 3)[::-1]
    assert_true(random_scenes.combine(flat, triangle), accuracy)


@TIERS
def test_a_contact_just_at_the_end_is_no_obstacle(accuracy):
    """And a hair beyond it is one."""
    for end, step in ((0.0, 1.0), (np.nextafter(0.0, 1.0), 1.0), (-(2.0**-20), 1 - 2.0**-20)):
        corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
        faces = np.array([[0, 1, 2]])
        falling = faces, corners + [1, 1, 1], corners + [1, 1, end]
        meshes = random_scenes.combine(falling, (faces, corners, corners))
        assert assert_true(meshes, accuracy) == pytest.approx(step, abs=1e-6)
