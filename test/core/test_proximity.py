# SPDX-License-Identifier: Apache-2.0
"""Proximity in one snapshot against the exact oracle, and against what it must be whatever the scene."""

import dataclasses

import numpy as np
import oracle
import pytest
import random_scenes
from fuzz.generators import EDGE_EDGE, VERTEX_FACE
from fuzz.near_generators import DISTANCE as DISTANCE_OF
from fuzz.near_generators import NEAR_GENERATORS
from scene_pairs import assert_pairs, renamed, rows, size_of
from test_small_scenes import small_scene

import hpccd_core as hc

ACCURACIES = pytest.mark.parametrize("accuracy", ["exact", "conservative"])
SCENES = pytest.mark.parametrize("generate", random_scenes.ALL)
DISTANCE = 0.5


def detector_of(meshes, rules=None, **options):
    return hc.Detector(meshes.scene(**(rules or {})), backend="cpu", **options)


def truth_of(meshes, distance, **rules):
    return oracle.proximity(meshes.vertices_t1, distance, meshes.faces, **meshes.beside_faces, **rules)


@SCENES
@ACCURACIES
def test_scenes(generate, accuracy):
    meshes = generate(np.random.default_rng(51))
    truth, size = truth_of(meshes, DISTANCE), size_of(meshes.vertices_t1)
    assert len(truth.vf) and len(truth.ee)
    hashes = set()
    for threads, simd in ((1, "auto"), (3, "auto"), (2, "scalar")):
        detector = detector_of(meshes, accuracy=accuracy, threads=threads, simd=simd)
        for _ in range(2):
            found = detector.proximity(meshes.vertices_t1, DISTANCE)
            assert_pairs(found, truth, "distance", accuracy, size)
            hashes.add(found.hash)
    assert len(hashes) == 1


def test_detection_and_snapshots_in_turn():
    """One detector for all questions: none leaves anything behind."""
    meshes = random_scenes.many_meshes(np.random.default_rng(52))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    detector = detector_of(meshes, minimum_separation=0.125)
    alone = [detector_of(meshes, minimum_separation=0.125).detect(v0, v1).hash]
    alone += [detector_of(meshes).proximity(v, d).hash for v, d in ((v1, 0.5), (v0, 0.0), (v0, 3.0))]
    for _ in range(2):
        in_turn = [detector.detect(v0, v1).hash]
        in_turn += [detector.proximity(v, d).hash for v, d in ((v1, 0.5), (v0, 0.0), (v0, 3.0))]
        assert in_turn == alone
    assert len(set(alone)) == len(alone)


@pytest.mark.parametrize("method", ["published", "naive", "front"])
def test_other_methods_find_the_same(method):
    meshes = random_scenes.many_meshes(np.random.default_rng(53))
    found = [detector_of(meshes, method=m).proximity(meshes.vertices_t1, DISTANCE) for m in ("default", method)]
    assert found[0].hash == found[1].hash and len(found[0].vf) == len(found[1].vf) > 0


@SCENES
def test_no_distance_is_touching(generate):
    """What is in contact at the end of a step that goes nowhere."""
    meshes = generate(np.random.default_rng(54))
    detector = detector_of(meshes)
    touching = detector.detect(meshes.vertices_t1, meshes.vertices_t1)
    near = detector.proximity(meshes.vertices_t1, 0.0)
    assert rows(near.vf) == rows(touching.vf) and rows(near.ee) == rows(touching.ee)
    assert not near.vf_distance.any() and not near.ee_distance.any()


@SCENES
def test_a_larger_distance_keeps_what_a_smaller_one_has(generate):
    meshes = generate(np.random.default_rng(55))
    detector, last = detector_of(meshes), {}
    for distance in (0.0, 1e-9, 0.25, np.nextafter(0.25, 1), 1.0):
        near = detector.proximity(meshes.vertices_t1, distance)
        now = dict(zip(rows(near.vf) + rows(near.ee), [*near.vf_distance, *near.ee_distance], strict=True))
        assert last.items() <= now.items()
        assert all(d <= distance * (1 + 1e-15) for d in now.values())
        last = now


@ACCURACIES
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0), (2.0**490, 0), (2.0**-498, 0), (2.0**-1060, 0), (1.0, 2**40)])
def test_distances_by_construction(accuracy, scale, offset):
    """Pairs that are exactly the distance apart, and those beside it."""
    for kind, name in ((VERTEX_FACE, "over_a_face"), (EDGE_EDGE, "crossing_planes")):
        queries, distances = NEAR_GENERATORS[kind][name](np.random.default_rng(56), 2000)
        rows_exactly = np.flatnonzero(DISTANCE_OF[kind](queries[:, :4]) == distances)[:40]
        chosen = np.concatenate([np.arange(40), rows_exactly])
        queries, distances = queries[chosen], distances[chosen]
        faces = [[1, 2, 3]] if kind == VERTEX_FACE else [[0, 1, 1], [2, 3, 3]]
        meshes = random_scenes.combine((np.array(faces), queries[0, :4], queries[0, :4]))
        detector, n_exactly = detector_of(meshes, accuracy=accuracy, threads=1), 0
        for points, distance in zip((queries[:, :4] + offset) * scale, distances * scale, strict=True):
            meshes.vertices_t1 = points
            for d in (distance, np.nextafter(distance, 0), np.nextafter(distance, np.inf)):
                truth = truth_of(meshes, d)
                assert_pairs(detector.proximity(points, d), truth, "distance", accuracy, size_of(points))
                n_exactly += (truth.vf_distance == d).any() or (truth.ee_distance == d).any()
        assert n_exactly >= 40


@SCENES
def test_other_names_for_vertices_and_faces(generate):
    rng = np.random.default_rng(57)
    meshes = generate(rng)
    other = renamed(rng, meshes)
    found, same = (detector_of(m).proximity(m.vertices_t1, DISTANCE) for m in (meshes, other.meshes))
    for kind in ("vf", "ee"):
        mapped = getattr(other, kind)(getattr(same, kind), getattr(same, f"{kind}_distance"))
        assert [pair for pair, _ in mapped] == rows(getattr(found, kind))
        size = size_of(meshes.vertices_t1)
        np.testing.assert_allclose(
            [d for _, d in mapped], getattr(found, f"{kind}_distance"), rtol=0, atol=2e-12 * size
        )


def test_meshes_the_other_way_round():
    """Symmetric in what is called first."""
    rng = np.random.default_rng(58)
    sheet, body = random_scenes.crumpled_sheet(rng, 5), random_scenes.tetrahedron(rng)
    one, other = random_scenes.combine(sheet, body), random_scenes.combine(body, sheet)
    found, same = (detector_of(m).proximity(m.vertices_t1, DISTANCE) for m in (one, other))
    vertex = np.concatenate([np.arange(25, 29), np.arange(25)])
    n_sheet = len(sheet[0])
    face = np.concatenate([np.arange(n_sheet, n_sheet + 4), np.arange(n_sheet)])
    assert sorted((int(vertex[v]), int(face[f])) for v, f in same.vf.tolist()) == rows(found.vf)
    assert sorted(same.vf_distance.tolist()) == sorted(found.vf_distance.tolist())
    assert len(same.ee) == len(found.ee) > 0


@pytest.mark.parametrize("scale", [2.0**-40, 2.0**200, 2.0**-300])
def test_powers_of_two(scale):
    meshes = random_scenes.many_meshes(np.random.default_rng(59))
    detector = detector_of(meshes)
    found, same = (detector.proximity(meshes.vertices_t1 * s, DISTANCE * s) for s in (1.0, scale))
    for kind in ("vf", "ee"):
        assert rows(getattr(found, kind)) == rows(getattr(same, kind))
        distance = getattr(found, f"{kind}_distance") * scale
        np.testing.assert_allclose(getattr(same, f"{kind}_distance"), distance, rtol=0, atol=2e-12 * 10 * scale)


def test_single_precision_is_taken_as_it_is():
    meshes = random_scenes.many_meshes(np.random.default_rng(60))
    single = meshes.vertices_t1.astype(np.float32)
    detector = detector_of(meshes)
    assert detector.proximity(single, DISTANCE).hash == detector.proximity(single.astype(float), DISTANCE).hash


def test_rules_of_scenes():
    rng = np.random.default_rng(61)
    n_found = 0
    for _ in range(40):
        meshes, rules = small_scene(rng)
        meshes = dataclasses.replace(
            meshes, vertices_t1=meshes.vertices_t1 + rng.normal(0, 0.1, meshes.vertices_t1.shape)
        )
        truth = truth_of(meshes, DISTANCE, **rules)
        found = detector_of(meshes, rules).proximity(meshes.vertices_t1, DISTANCE)
        assert_pairs(found, truth, "distance", size=size_of(meshes.vertices_t1))
        n_found += len(truth.vf) + len(truth.ee)
    assert n_found > 100


@SCENES
def test_nearest_points_lie_on_their_features_and_are_as_near_as_told(generate):
    meshes = generate(np.random.default_rng(62))
    v1, size = meshes.vertices_t1, size_of(meshes.vertices_t1)
    detector = detector_of(meshes, outputs=("closest",))
    near = detector.proximity(v1, DISTANCE)
    n = len(near.vf)
    assert near.closest.shape == (n + len(near.ee), 2, 3)
    assert near.hash == detector_of(meshes).proximity(v1, DISTANCE).hash
    offsets = np.concatenate([[0], np.cumsum(meshes.n_vertices)])
    faces = np.concatenate([f + o for f, o in zip(meshes.faces, offsets, strict=False)])
    told = np.concatenate([near.vf_distance, near.ee_distance])
    apart = np.linalg.norm(near.closest[:, 0] - near.closest[:, 1], axis=1)
    np.testing.assert_allclose(apart, told, rtol=0, atol=1e-12 * size)
    corners_first = np.concatenate([v1[near.vf[:, [0, 0, 0]]], v1[near.ee[:, [0, 1, 1]]]])
    corners_second = np.concatenate([v1[faces[near.vf[:, 1]]], v1[near.ee[:, [2, 3, 3]]]])
    for side, corners in ((0, corners_first), (1, corners_second)):
        points = np.concatenate([near.closest[:, side, None], corners], axis=1)
        assert oracle.distance_vertex_face(points).max() <= 1e-12 * size
    assert np.array_equal(near.closest[:n, 0], v1[near.vf[:, 0]]), "the vertex itself"


def test_without_being_asked_for_there_are_no_nearest_points():
    meshes = random_scenes.single_mesh(np.random.default_rng(63))
    with pytest.raises(hc.OutputNotComputed, match=r"closest: not computed; .*outputs=\('closest',\)"):
        _ = detector_of(meshes).proximity(meshes.vertices_t1, DISTANCE).closest


def test_nothing_there():
    scene = hc.Scene()
    near = hc.Detector(scene, backend="cpu").proximity(np.empty((0, 3)), 1.0)
    assert near.vf.shape == (0, 2) and near.ee.shape == (0, 4)
    scene.add_mesh("triangle", [[0, 1, 2]])
    near = hc.Detector(scene, backend="cpu").proximity(np.eye(3), 10.0)
    assert len(near.vf) == len(near.ee) == 0, "all its features share a vertex"


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf])
def test_bad_distances_are_rejected(bad):
    detector = detector_of(random_scenes.single_mesh(np.random.default_rng(64)))
    with pytest.raises(ValueError, match="distance"):
        detector.proximity(np.zeros((detector.n_vertices, 3)), bad)


def test_bad_positions_are_rejected():
    detector = detector_of(random_scenes.single_mesh(np.random.default_rng(65)))
    for bad, error in (
        (np.zeros((3, 3)), ValueError),
        (np.full((detector.n_vertices, 3), np.nan), ValueError),
        (np.full((detector.n_vertices, 3), 1e301), ValueError),
        (np.zeros((detector.n_vertices, 3), int), TypeError),
    ):
        with pytest.raises(error, match="vertices"):
            detector.proximity(bad, 1.0)
    with pytest.raises(TypeError, match="distance"):
        detector.proximity(np.zeros((detector.n_vertices, 3)), "1")


@pytest.mark.parametrize(
    "ends",
    [  # their sine is 1e-6 and 1e-5
        [
            (-1, -0.96218562573116317, 0.32371781429920021),
            (-0.79999688281033798, -0.76975068144014014, 0.25897470573039311),
            (0.90000107262872064, 0.8659663285821696, -0.29134259457809203),
        ],
        [
            (-1, -0.70318786564103752, -0.98020985512058156),
            (-0.79999325414364797, -0.56255246588041485, -0.7841669782573405),
            (0.89999420271630803, 0.63287091026921427, 0.88218813133834206),
        ],
    ],
)
def test_nearest_points_of_nearly_parallel_edges_are_as_near_as_the_edges(ends):
    start, *other = np.array(ends)
    scene = hc.Scene()
    for name in ("one", "other"):
        scene.add_mesh(name, np.array([[0, 1, 1]]))
    detector = hc.Detector(scene, outputs="closest")
    near = detector.proximity(np.array([start, -start, *other]), 1e-4)
    apart = np.linalg.norm(near.closest[:, 0] - near.closest[:, 1], axis=1)
    assert [0, 1, 2, 3] in near.ee.tolist()
    np.testing.assert_allclose(apart, [*near.vf_distance, *near.ee_distance], rtol=0, atol=1e-15)
