# SPDX-License-Identifier: Apache-2.0
"""Points lie on both features at the time of contact; normals stand on them."""

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc


@pytest.fixture
def meshes():
    return random_scenes.single_mesh(np.random.default_rng(1))


def _at(meshes, vertices, toc):
    t = toc.reshape(-1, *[1] * vertices.ndim)
    return (1 - t) * meshes.vertices_t0[vertices] + t * meshes.vertices_t1[vertices]


def _contacts(meshes, outputs):
    return hc.Detector(meshes.scene(), outputs=outputs).detect(meshes.vertices_t0, meshes.vertices_t1)


def test_only_what_is_asked_for(meshes):
    n = len(_contacts(meshes, ()))
    for outputs in ((), ("points",), ("normals",), ("points", "normals")):
        contacts = _contacts(meshes, outputs)
        assert {name: rows.shape for name, rows in contacts.outputs.items()} == dict.fromkeys(outputs, (n, 3))
        assert [name for name in ("points", "normals", "closest") if hasattr(contacts, name)] == list(outputs)


def test_points_lie_on_both_features(meshes):
    c = _contacts(meshes, ("points",))
    vf_points, ee_points = np.split(c.points, [len(c.vf)])
    np.testing.assert_allclose(vf_points, _at(meshes, c.vf[:, 0], c.vf_toc), atol=1e-9)
    for first in (0, 2):
        ends = _at(meshes, c.ee[:, first : first + 2], c.ee_toc)
        detour = np.linalg.norm(ee_points[:, None] - ends, axis=2).sum(axis=1)
        np.testing.assert_allclose(detour, np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), atol=1e-6)


def test_normals_have_length_one_and_stand_on_the_features(meshes):
    c = _contacts(meshes, ("normals",))
    np.testing.assert_allclose(np.linalg.norm(c.normals, axis=1), 1, atol=1e-9)
    vf_normals, ee_normals = np.split(c.normals, [len(c.vf)])
    corners = _at(meshes, meshes.faces[0][c.vf[:, 1]], c.vf_toc)
    ends = _at(meshes, c.ee, c.ee_toc)
    for normals, sides in (
        (vf_normals, (corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])),
        (ee_normals, (ends[:, 1] - ends[:, 0], ends[:, 3] - ends[:, 2])),
    ):
        for side in sides:
            assert np.abs((normals * side).sum(axis=1)).max() < 1e-6


def test_normal_points_to_the_side_that_the_other_comes_from():
    scene = hc.Scene()
    scene.add_mesh("floor", [[0, 1, 2]], static=True)
    scene.add_mesh("particle", np.empty((0, 3), int), n_vertices=1)
    floor = np.array([[-1, -1, 0], [2, -1, 0], [-1, 2, 0]])
    for height in (1.0, -1.0):
        start, end = (np.concatenate([floor, [[0, 0, z]]]) for z in (height, -3 * height))
        contacts = hc.Detector(scene, outputs=("points", "normals")).detect(start, end)
        assert contacts.vf.tolist() == [[3, 0]] and contacts.vf_toc[0] == 0.25
        np.testing.assert_allclose(contacts.points, [[0, 0, 0]], atol=1e-15)
        np.testing.assert_allclose(contacts.normals, [[0, 0, height]], atol=1e-15)


def test_degenerate_features_give_no_nan():
    for make in random_scenes.ALL:
        c = _contacts(make(np.random.default_rng(2)), ("points", "normals"))
        assert np.isfinite(c.points).all() and np.isfinite(c.normals).all()
        length = np.linalg.norm(c.normals, axis=1)
        assert (np.isclose(length, 1, atol=1e-9) | (length == 0)).all()


def test_signs_of_zeros_do_not_outlast_their_frame():
    """A static mesh that came with -0 at one end and 0 at the other is not the one that has -0 at both."""
    scene = hc.Scene()
    scene.add_mesh("falls", np.array([[0, 1, 2]]))
    scene.add_mesh("rests", np.array([[0, 1, 2]]), static=True)
    falls = np.array([[-5.0, -5, 2], [5, -5, 2], [0, 5, 2]])
    rests = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    minus = rests.copy()
    minus[0, :2] = -0.0
    options = {"backend": "cpu", "threads": 1, "outputs": ("closest", "points")}
    end = falls - [0, 0, 1.5]
    detector = hc.Detector(scene, **options)
    detector.detect(np.vstack([falls, minus]), np.vstack([end, rests]))
    again = np.vstack([falls, minus]), np.vstack([end, minus])
    found, alone = detector.detect(*again), hc.Detector(scene, **options).detect(*again)
    assert found.points.tobytes() == alone.points.tobytes() and found.closest.tobytes() == alone.closest.tobytes()
