# SPDX-License-Identifier: Apache-2.0
"""Edges that intersect or touch faces, in one snapshot: against the exact oracle, and by what must hold anyway."""

import numpy as np
import oracle
import pytest
import random_scenes
from fuzz.snapshots import EDGE_FACE_POINTS
from scene_pairs import renamed, rows
from test_small_scenes import small_scene

import hpccd_core as hc

ACCURACIES = pytest.mark.parametrize("accuracy", ["exact", "conservative"])
SCENES = pytest.mark.parametrize("generate", random_scenes.ALL)


def detector_of(meshes, rules=None, **options):
    return hc.Detector(meshes.scene(**(rules or {})), backend="cpu", **options)


def truth_of(meshes, **rules):
    return oracle.intersections(meshes.vertices_t1, meshes.faces, **meshes.beside_faces, **rules)


def assert_edges(found, truth):
    pairs = rows(found.ef)
    assert pairs == sorted(set(pairs)), "in order, each once"
    assert not set(rows(truth)) - set(pairs), "missed"
    assert not set(pairs) - set(rows(truth)), "invented"


@SCENES
@ACCURACIES
def test_scenes(generate, accuracy):
    meshes = generate(np.random.default_rng(71))
    truth = truth_of(meshes)
    assert len(truth)
    hashes = set()
    for threads, simd in ((1, "auto"), (3, "auto"), (2, "scalar")):
        detector = detector_of(meshes, accuracy=accuracy, threads=threads, simd=simd)
        for _ in range(2):
            found = detector.intersections(meshes.vertices_t1)
            assert_edges(found, truth)
            hashes.add(found.hash)
    assert len(hashes) == 1


@pytest.mark.parametrize("name", EDGE_FACE_POINTS)
def test_single_pairs_as_scenes(name):
    """An edge and a face, each a mesh, at all scales; what the fuzzer makes many more of."""
    points = EDGE_FACE_POINTS[name](np.random.default_rng(72), 150)
    truth = oracle.edge_face_intersect(points)
    assert truth.any()
    scene = hc.Scene()
    scene.add_mesh("edge", [[0, 1, 1]])
    scene.add_mesh("face", [[0, 1, 2]])
    detector = hc.Detector(scene, backend="cpu", threads=1)
    found = [(0, 1, 1) in rows(detector.intersections(p).ef) for p in points]
    assert found == truth.tolist()


@pytest.mark.parametrize("scale", [2.0**490, 2.0**-498, 2.0**-1060])
def test_powers_of_two(scale):
    meshes = random_scenes.lattice(np.random.default_rng(73))
    detector = detector_of(meshes)
    found = [detector.intersections(meshes.vertices_t1 * s) for s in (1.0, scale)]
    assert rows(found[0].ef) == rows(found[1].ef) and len(found[0].ef) and found[0].hash == found[1].hash


@SCENES
def test_other_names_for_vertices_and_faces(generate):
    rng = np.random.default_rng(74)
    meshes = generate(rng)
    other = renamed(rng, meshes)
    found, same = (detector_of(m).intersections(m.vertices_t1) for m in (meshes, other.meshes))
    assert other.ef(same.ef) == rows(found.ef)


@SCENES
def test_they_are_what_touches(generate):
    """An end of an edge in a face, or its crossing of another edge, is contact at rest: then the edge intersects."""
    meshes = generate(np.random.default_rng(75))
    detector = detector_of(meshes)
    near = detector.proximity(meshes.vertices_t1, 0.0)
    ef = set(rows(detector.intersections(meshes.vertices_t1).ef))
    offsets = np.concatenate([[0], np.cumsum(meshes.n_vertices)])
    faces = np.concatenate([f + o for f, o in zip(meshes.faces, offsets, strict=False)]).tolist()
    edges = {tuple(sorted(e)) for f in faces for e in (f[:2], f[1:], f[::2]) if e[0] != e[1]}
    n_checked = 0
    for v, f in rows(near.vf):
        for e in edges:
            if v in e and not set(e) & set(faces[f]):
                assert (*e, f) in ef
                n_checked += 1
    for a0, a1, b0, b1 in rows(near.ee):
        for i, face in enumerate(faces):
            if {b0, b1} <= set(face) and not {a0, a1} & set(face):
                assert (a0, a1, i) in ef
                n_checked += 1
    assert n_checked > 0 or not (len(near.vf) + len(near.ee))


def test_rules_of_scenes():
    rng = np.random.default_rng(76)
    n_found = 0
    for _ in range(60):
        meshes, rules = small_scene(rng)
        truth = truth_of(meshes, **rules)
        assert_edges(detector_of(meshes, rules).intersections(meshes.vertices_t1), truth)
        n_found += len(truth)
    assert n_found > 100


@pytest.mark.parametrize("method", ["published", "naive", "front"])
def test_other_methods_find_the_same(method):
    meshes = random_scenes.many_meshes(np.random.default_rng(77))
    found = [detector_of(meshes, method=m).intersections(meshes.vertices_t1) for m in ("default", method)]
    assert found[0].hash == found[1].hash and rows(found[0].ef) == rows(found[1].ef)


def test_a_body_that_is_pierced_at_rest_is_seen():
    """Detection of a step that goes nowhere sees no crossing without contact of borders; this question does."""
    faces, needle = [[0, 1, 2]], [[0, 1, 1]]
    scene = hc.Scene()
    scene.add_mesh("face", faces)
    scene.add_mesh("needle", needle)
    at_rest = np.array([[-1, -1, 0], [2, -1, 0], [-1, 2, 0], [0, 0, -1], [0, 0, 1]], float)
    detector = hc.Detector(scene, backend="cpu")
    assert len(detector.detect(at_rest, at_rest)) == 0
    assert rows(detector.intersections(at_rest).ef) == [(3, 4, 0)]


def test_nothing_there():
    assert hc.Detector(hc.Scene(), backend="cpu").intersections(np.empty((0, 3))).ef.shape == (0, 3)


def test_bad_positions_are_rejected():
    detector = detector_of(random_scenes.single_mesh(np.random.default_rng(78)))
    for bad in (np.zeros((3, 3)), np.full((detector.n_vertices, 3), np.inf)):
        with pytest.raises(ValueError, match="vertices"):
            detector.intersections(bad)
