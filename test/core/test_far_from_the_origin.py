# SPDX-License-Identifier: Apache-2.0
"""Boxes far from the origin, where sums of two coordinates lose more than floats do: no near pair may be lost."""

import numpy as np
import pytest

import hpccd_core as hc

N = 300
SPACING = 2.0**-19  # of doubles near 1e10


def points_beside_points(steps, seed):
    """Scene of N vertices and N faces that are points, near each other in pairs, a number of steps apart; (vertices,
    distance). All coordinates are multiples of the spacing, so differences and their squares are exact."""
    rng = np.random.default_rng(seed)
    first = np.round(rng.uniform(-0.5, 0.5, (N, 3)) / SPACING) * SPACING + 1e10
    second = first + SPACING * np.asarray(steps)
    corners = np.array([[1e10 - 1, 1e10 - 1, 1e10 - 1], [1e10 + 1, 1e10 + 1, 1e10 + 1]])
    scene = hc.Scene()
    scene.add_mesh("points", np.empty((0, 3), int), n_vertices=N + 2)
    scene.add_mesh("faces", np.repeat(np.arange(N), 3).reshape(N, 3), n_vertices=N)
    return scene, np.concatenate([first, corners, second]), SPACING * np.sqrt(np.dot(steps, steps))


# An odd sum or difference of two coordinates is halfway between doubles: the two points may round apart.
@pytest.mark.parametrize("steps", ((40, 0, 0), (41, 40, 0), (20, 0, -21), (0, 20, 21), (-41, 40, 0), (2, 41, 20)))
def test_no_near_pair_is_lost(steps):
    scene, vertices, distance = points_beside_points(steps, 1)
    distance = np.nextafter(distance, 1)
    pairs = np.stack([np.arange(N), np.arange(N)], axis=1)
    near = hc.Detector(scene, backend="cpu").proximity(vertices, distance)
    found = {tuple(row) for row in near.vf.tolist()}
    assert found >= {tuple(row) for row in pairs.tolist()}
    contacts = hc.Detector(scene, backend="cpu", minimum_separation=distance).detect(vertices, vertices)
    assert {tuple(row) for row in contacts.vf.tolist()} >= {tuple(row) for row in pairs.tolist()}
