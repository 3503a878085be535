# SPDX-License-Identifier: Apache-2.0
"""A normal points to the side that the other feature is on just before toc, by whatever names the features go."""

import exact_geometry
import numpy as np
import pytest
import random_scenes
import single_pairs
from fuzz.generators import EDGE_EDGE, VERTEX_FACE
from single_pairs import DEGENERATE, KINDS, REGULAR, TEST, contacts, small_steps

import hpccd_core as hc

FLOOR = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


def assert_on_the_right_side(kind, query, toc, normal):
    side = exact_geometry.side(kind, query, toc)
    if side == 0:
        assert not normal.any(), "coplanar throughout"
        return
    length = np.linalg.norm(normal)
    expected, sine = exact_geometry.normal(kind, query, toc)
    if sine < 1e-9 or side is None:
        assert length == 0 or np.isclose(length, 1)
    else:
        np.testing.assert_allclose(normal, side * expected, atol=1e-6)


def single(start, end):
    query = np.array([*start, *end], float)
    return single_pairs.contact(single_pairs.detector(VERTEX_FACE), VERTEX_FACE, query)


@KINDS
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_small_random_steps(kind, accuracy):
    detector = single_pairs.detector(kind, accuracy=accuracy)
    queries = contacts(kind, small_steps, 100, accuracy)
    assert len(queries) == 100
    for query in queries:
        # The exact time where the tier promises none: a side does not depend on it.
        exact = TEST[kind](query[None], "exact")[1][0]
        toc, _, normal = single_pairs.contact(detector, kind, query)
        if np.isfinite(exact):
            assert abs(toc - exact) < 1e-3
            side, (direction, _) = exact_geometry.side(kind, query, exact), exact_geometry.normal(kind, query, exact)
            assert side * np.dot(direction, normal) > 0.99


@KINDS
@pytest.mark.parametrize("generate", REGULAR + DEGENERATE, ids=lambda g: g.__name__)
def test_the_side_is_that_just_before_toc(kind, generate):
    detector = single_pairs.detector(kind)
    queries = contacts(kind, generate, 60)
    assert len(queries) > 20
    for query in queries:
        toc, _, normal = single_pairs.contact(detector, kind, query)
        assert_on_the_right_side(kind, query, toc, normal)


@KINDS
@pytest.mark.parametrize("generate", REGULAR + DEGENERATE, ids=lambda g: g.__name__)
def test_other_names_for_corners_ends_and_sides(kind, generate):
    detector = single_pairs.detector(kind)
    for query in contacts(kind, generate, 40):
        normal = single_pairs.contact(detector, kind, query)[2]
        for order, turn in single_pairs.names(kind):
            other = single_pairs.contact(detector, kind, single_pairs.renamed(query, order))[2]
            np.testing.assert_allclose(turn * other, normal, atol=1e-6)


@KINDS
def test_coordinates_of_all_magnitudes(kind):
    detector, seen = single_pairs.detector(kind), 0
    for query in contacts(kind, single_pairs.all_magnitudes, 80):
        toc, _, normal = single_pairs.contact(detector, kind, query)
        expected = exact_geometry.normal_before_contact(kind, query, toc)
        if expected is not None:
            seen += 1
            np.testing.assert_allclose(normal, expected, atol=1e-6)
    assert seen > 40


def test_vertex_above_a_face_that_rises():
    # The normal at toc stands at an angle to that at t = 0: a sign taken from both at once depends on the corner.
    start, end = [(0.3, 0.4, 0.1), *FLOOR], [(0.3, 0.4, 0.1), (0, 0, -0.1), (1, 0, 0.5), (0, 1, 0.5)]
    for order, _ in single_pairs.VERTEX_FACE_NAMES:
        toc, _, normal = single([start[i] for i in order], [end[i] for i in order])
        assert abs(toc - 0.3125) < 1e-12
        np.testing.assert_allclose(normal, [-0.18123663, -0.18123663, 0.96659535], atol=1e-8)


def test_pinned_corner():
    # The vertex rests and so does a corner: what joins them lies in the face's plane at toc.
    for x in np.linspace(0.05, 0.55, 51):
        start, end = [(x, 0.4, 0.1), *FLOOR], [(x, 0.4, 0.1), (0, 0, 0), (1, 0, 0.5), (0, 1, 0.5)]
        for order, _ in single_pairs.VERTEX_FACE_NAMES:
            assert single([start[i] for i in order], [end[i] for i in order])[2][2] > 0.8


@KINDS
def test_planes_crossed_before_the_contact(kind):
    # The features pass through each other's plane beside one another first: the side at t = 0 is the wrong one.
    def large_steps(rng, n):
        return rng.uniform(-1, 1, (n, 8, 3))

    detector, crossed = single_pairs.detector(kind), 0
    for query in contacts(kind, large_steps, 200):
        toc, _, normal = single_pairs.contact(detector, kind, query)
        side = exact_geometry.side(kind, query, toc)
        if side != exact_geometry.side_at_start(kind, query):
            crossed += 1
            assert_on_the_right_side(kind, query, toc, normal)
    assert crossed > 10


def test_contact_at_the_start():
    # Just before the start is where the motion would have come from, whichever way it goes.
    for fall, side in ((0.5, 1), (-0.5, -1)):
        toc, _, normal = single([(0.3, 0.3, 0), *FLOOR], [(0.3, 0.3, -fall), *FLOOR])
        assert toc == 0
        np.testing.assert_array_equal(normal, [0, 0, side])


def test_motion_that_is_coplanar_throughout_has_no_side():
    for step in ((0, 0, 0), (0.1, 0, 0), (0, 0, 1)):
        start = np.array([(0.3, 0.3, 0), *FLOOR])
        assert not single(start, start + step)[2].any()
    in_plane = [(-1, 0.25, 0.5), *[(x, y, 0.5) for x, y, _ in FLOOR]]
    toc, point, normal = single(in_plane, [(1, 0.25, 0.5), *in_plane[1:]])
    assert toc == 0.5 and not normal.any()
    np.testing.assert_allclose(point, [0, 0.25, 0.5])


@pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)
def test_random_scenes(make):
    meshes = make(np.random.default_rng(4))
    check_scene(meshes.scene(), np.concatenate(_scene_wide_faces(meshes)), meshes.vertices_t0, meshes.vertices_t1, 60)


def _scene_wide_faces(meshes):
    first = np.cumsum([0, *meshes.n_vertices])
    return [np.asarray(faces, int).reshape(-1, 3) + first[i] for i, faces in enumerate(meshes.faces)]


def check_scene(scene, faces, start, end, number, **options):
    found = hc.Detector(scene, outputs=("normals",), **options).detect(start, end)
    rows = np.concatenate([np.column_stack([found.vf[:, 0], faces[found.vf[:, 1]]]), found.ee])
    tocs = np.concatenate([found.vf_toc, found.ee_toc])
    assert len(rows) > 0
    for i in np.random.default_rng(0).permutation(len(rows))[:number]:
        query = np.concatenate([start[rows[i]], end[rows[i]]])
        kind = VERTEX_FACE if i < len(found.vf) else EDGE_EDGE
        assert_on_the_right_side(kind, query, tocs[i], found.normals[i])


@pytest.mark.parametrize("name", ["cloth-ball", "n-body", "cloth-funnel"])
def test_published_scenes(data_folder, name):
    with np.load(data_folder / f"{name}.npz") as truth:
        scene = hc.Scene()
        scene.add_mesh("scene", truth["faces"], n_vertices=len(truth["vertices_t0"]))
        check_scene(scene, truth["faces"], truth["vertices_t0"], truth["vertices_t1"], 400, backend="cpu")


def test_with_a_separation_it_is_the_direction_between_the_nearest_points():
    # Beyond the face the vertex rises through its plane; then it approaches, from above.
    path = [(5, 0.2, -1), *FLOOR], [(0.2, 0.2, 0.2), *FLOOR]
    detector = single_pairs.detector(VERTEX_FACE, minimum_separation=0.5)
    toc, point, normal = single_pairs.contact(detector, VERTEX_FACE, np.array([*path[0], *path[1]], float))
    vertex = np.array(path[0][0]) * (1 - toc) + np.array(path[1][0]) * toc
    np.testing.assert_allclose(np.linalg.norm(normal), 1, atol=1e-15)
    np.testing.assert_allclose(point, vertex - 0.25 * normal, atol=1e-12)
    np.testing.assert_allclose((vertex - 0.5 * normal) @ (1, 1, 0), 1, atol=1e-12)  # on the border x + y = 1
    assert abs((vertex - 0.5 * normal)[2]) < 1e-12
