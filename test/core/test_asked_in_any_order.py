# SPDX-License-Identifier: Apache-2.0
"""One detector asked everything in any order returns what a new one does: nothing of one query counts for another."""

import numpy as np
import pytest

import hpccd_core as hc


def _sheet(rng, n):
    grid = np.arange(n * n).reshape(n, n)
    a, b, c, d = (x.ravel() for x in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], 1).astype(float)
    return faces, flat + 0.3 * rng.normal(size=flat.shape)


def _soup(rng, n):
    corners = rng.uniform(0, 8, size=(n, 1, 3)) * [1, 1, 0.2] + rng.normal(size=(n, 3, 3))
    return np.arange(3 * n).reshape(n, 3), corners.reshape(-1, 3)


@pytest.mark.parametrize("simd", ["auto", "scalar"])
@pytest.mark.parametrize("seed", range(4))
def test_as_a_new_detector(seed, simd):
    rng = np.random.default_rng(seed)
    scene, vertices = hc.Scene(), []
    for name, (faces, xyz) in {"a": _sheet(rng, 9), "b": _sheet(rng, 8), "soup": _soup(rng, 40)}.items():
        scene.add_mesh(name, faces, n_vertices=len(xyz))
        vertices.append(xyz)
    at = np.concatenate(vertices)
    options = {"backend": "cpu", "simd": simd, "threads": 1}
    asked = {report: hc.Detector(scene, report=report, **options) for report in ("all", "first")}
    separation = 0.0
    found_rows = 0
    for call in range(80):
        start = at + 0.1 * rng.normal(size=at.shape) if call % 3 == 0 else at
        end = start + 10.0 ** rng.uniform(-3, 0) * rng.normal(size=at.shape)
        report = ("all", "first")[rng.integers(2)]
        fresh = hc.Detector(scene, report=report, **options)
        fresh.set_separation("a", "b", separation)
        question = rng.integers(6)
        if question == 0:
            separation = float(rng.choice([0.0, 0.01, 0.3]))
            for detector in asked.values():
                detector.set_separation("a", "b", separation)
        elif question == 1:
            assert asked[report].proximity(start, 0.5).hash == fresh.proximity(start, 0.5).hash
        elif question == 2:
            assert asked[report].intersections(start).hash == fresh.intersections(start).hash
        elif question == 3:
            assert asked[report].collision_free_step(start, end) == fresh.collision_free_step(start, end)
        else:
            contacts = fresh.detect(start, end)
            assert asked[report].detect(start, end).hash == contacts.hash
            found_rows += len(contacts)
    assert found_rows > 100
