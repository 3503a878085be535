# SPDX-License-Identifier: Apache-2.0
"""Detector.set_separation between and during queries: nothing is rebuilt, and the next detection is that of a detector
made with the new separation."""

import threading

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

METHODS = pytest.mark.parametrize("method", ["default", "published", "naive", "front"])
CHANGES = [(0, 1, 0.3), (1, 1, 0.125), (2, 0, 0.0), (0, 1, 0.0), (4, 2, 1.5), (4, 2, 0.01)]


def fresh(meshes, changes, method="default"):
    scene = meshes.scene()
    for a, b, separation in changes:
        scene.set_separation(a, b, separation)
    return hc.Detector(scene, minimum_separation=0.0625, method=method, backend="cpu")


@METHODS
def test_nothing_is_rebuilt(method):
    meshes = random_scenes.many_meshes(np.random.default_rng(61))
    # Hardly any motion: boxes that a larger separation blows up would wear a tree out, motion alone does not.
    start, end = meshes.vertices_t0, meshes.vertices_t0 + 0.01
    detector = fresh(meshes, [], method)
    detector.detect(start, end)
    assert "build" in detector.profile
    for i, change in enumerate(CHANGES[:4]):
        detector.set_separation(*change)
        found = detector.detect(start, end)
        assert "build" not in detector.profile and "refit" in detector.profile
        assert found.hash == fresh(meshes, CHANGES[: i + 1], method).detect(start, end).hash


def test_between_queries_of_all_sorts():
    """Queries of one snapshot do not read the separations, and leave the tree in use."""
    meshes = random_scenes.many_meshes(np.random.default_rng(62))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    detector = fresh(meshes, [])
    near, hits = detector.proximity(v1, 0.25).hash, detector.intersections(v1).hash
    gaps = [(g.distance, g.kind, g.features) for g in detector.distances(v1)]
    hashes = set()
    for i, change in enumerate(CHANGES):
        detector.set_separation(*change)
        assert detector.proximity(v1, 0.25).hash == near
        assert detector.intersections(v1).hash == hits
        assert [(g.distance, g.kind, g.features) for g in detector.distances(v1)] == gaps
        found = detector.detect(v0, v1)
        assert found.hash == fresh(meshes, CHANGES[: i + 1]).detect(v0, v1).hash
        hashes.add(found.hash)
    assert len(hashes) > 3


def test_during_queries_each_result_is_of_one_state():
    """A call under way ends first: every result is that of one of the two separations, none of a mixture."""
    meshes = random_scenes.many_meshes(np.random.default_rng(63))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    states = [(0, 1, 0.0), (0, 1, 0.75)]
    allowed = {fresh(meshes, [state]).detect(v0, v1).hash for state in states}
    assert len(allowed) == 2
    detector = fresh(meshes, states[:1])
    near = detector.proximity(v1, 0.25).hash
    ended = threading.Event()

    def change():
        turn = 0
        while not ended.is_set():
            turn += 1
            detector.set_separation(*states[turn % 2])

    changing = threading.Thread(target=change)
    changing.start()
    try:
        seen = {detector.detect(v0, v1).hash for _ in range(200)}
        assert {detector.proximity(v1, 0.25).hash for _ in range(20)} == {near}
        assert len({len(detector.distances(v1)) for _ in range(20)}) == 1
    finally:
        ended.set()
        changing.join()
    assert seen <= allowed


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ((0, 1, np.inf), ValueError, "^separation: must be finite and not negative, got inf"),
        ((0, 1, np.nan), ValueError, "^separation: must be finite and not negative, got nan"),
        ((0, 1, -1e-300), ValueError, "^separation: must be finite and not negative, got -1e-300"),
        ((0, 1, 10**400), ValueError, "^separation: must lie within float64"),
        ((0, 1, True), TypeError, "^separation: expected a number, got bool"),
        ((0, 1, None), TypeError, "^separation: expected a number, got NoneType"),
        ((0, 1, np.array([0.1])), TypeError, "^separation: expected a number, got ndarray"),
        (("nobody", 1, 0.1), ValueError, "^mesh_a: no mesh is named 'nobody'; the scene has mesh0, mesh1"),
        ((0, 5, 0.1), ValueError, r"^mesh_b: must lie in \[0, 4\], got 5"),
        ((-1, 0, 0.1), ValueError, r"^mesh_a: must lie in \[0, 4\], got -1"),
        ((0, 1.0, 0.1), TypeError, "^mesh_b: expected the name or number of a mesh, got float"),
        ((True, 1, 0.1), TypeError, "^mesh_a: expected an integer, got bool"),
    ],
)
def test_what_is_rejected_changes_nothing(arguments, error, text):
    meshes = random_scenes.many_meshes(np.random.default_rng(64))
    scene = meshes.scene()
    detector = hc.Detector(scene, minimum_separation=0.0625, backend="cpu")
    plain = detector.detect(meshes.vertices_t0, meshes.vertices_t1).hash
    for owner in (detector, scene):
        with pytest.raises(error, match=text):
            owner.set_separation(*arguments)
    for same in (detector, hc.Detector(scene, minimum_separation=0.0625, backend="cpu")):
        assert same.detect(meshes.vertices_t0, meshes.vertices_t1).hash == plain
