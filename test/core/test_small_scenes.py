# SPDX-License-Identifier: Apache-2.0
"""Excluded pairs stay excluded if the whole hierarchy is one block of triangles, or hardly more."""

import functools

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

WAYS = [("default", "all"), ("default", "first"), ("default", "any")] + [
    (method, report) for method in ("published", "naive", "front") for report in ("all", "first")
]


def rows(array):
    return {tuple(row) for row in array.tolist()}


def small_scene(rng):
    """One to three meshes of 20 triangles together at most, some with vertices in no face or edges beside, and rules
    for them."""
    n_meshes = rng.integers(1, 4)
    meshes = []
    for n_faces in rng.multinomial(rng.integers(1, 21), np.full(n_meshes, 1 / n_meshes)):
        n_vertices = rng.integers(3, 4 + n_faces)
        start, end = rng.integers(-2, 3, (2, n_vertices, 3))
        edges = rng.integers(0, n_vertices, (rng.choice([0, 0, 8]), 2))
        meshes.append((rng.integers(0, n_vertices, (n_faces, 3)), start, end, edges))
    rules = {
        "no_self_collision": [m for m in range(n_meshes) if rng.random() < 0.4],
        "static": [m for m in range(n_meshes) if rng.random() < 0.3],
        "ignored_pairs": [(a, b) for a in range(n_meshes) for b in range(a + 1) if rng.random() < 0.3],
    }
    for mesh in rules["static"]:
        meshes[mesh] = (meshes[mesh][0], meshes[mesh][1], meshes[mesh][1], meshes[mesh][3])
    return random_scenes.combine(*meshes), rules


@functools.cache
def many_small_scenes():
    rng = np.random.default_rng(7)
    scenes = [small_scene(rng) for _ in range(60)]
    return [(meshes, rules, meshes.truth(threads=1, **rules)) for meshes, rules in scenes]


@pytest.mark.parametrize(("method", "report"), WAYS)
@pytest.mark.parametrize("threads", [1, 3])
def test_rules_of_small_scenes(method, report, threads):
    n_found = 0
    for meshes, rules, truth in many_small_scenes():
        detector = hc.Detector(meshes.scene(**rules), method=method, report=report, threads=threads, backend="cpu")
        for _ in range(2):  # on a hierarchy that is built, and on the same one refitted
            found = detector.detect(meshes.vertices_t0, meshes.vertices_t1)
            assert rows(found.vf) <= rows(truth.vf) and rows(found.ee) <= rows(truth.ee), rules
            n_true = len(truth.vf) + len(truth.ee)
            if report == "all":
                assert len(found) == n_true
            else:
                assert bool(len(found)) == bool(n_true)
        if report == "first" and n_true:
            assert found.first_toc == pytest.approx(min([*truth.vf_toc, *truth.ee_toc]), abs=1e-12)
        n_found += len(found)
    assert n_found > 0


@pytest.mark.parametrize("rule", [{"no_self_collision": [0]}, {"static": [0]}, {"ignored_pairs": [(0, 0)]}])
@pytest.mark.parametrize("n_faces", [2, 8, 9])
@pytest.mark.parametrize(("method", "report"), WAYS)
def test_an_only_mesh_that_shall_not_touch_itself(rule, n_faces, method, report):
    # In one plane, each triangle over all the others, with corners of its own.
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]]) + np.arange(n_faces)[:, None, None] * [0.125, 0.125, 0]
    vertices = corners.reshape(-1, 3)
    meshes = random_scenes.combine((np.arange(len(vertices)).reshape(-1, 3), vertices, vertices))
    options = {"method": method, "report": report, "backend": "cpu"}
    free = hc.Detector(meshes.scene(), **options).detect(meshes.vertices_t0, meshes.vertices_t1)
    ruled_out = hc.Detector(meshes.scene(**rule), **options).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert len(free) > 0 and len(ruled_out) == 0
