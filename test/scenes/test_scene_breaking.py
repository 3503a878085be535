# SPDX-License-Identifier: Apache-2.0
"""The breaking scene: its topology changes, and each topology is sound."""

import numpy as np
import pytest

from hpccd_ros import scenes


@pytest.fixture(scope="module")
def scene():
    return scenes.make("breaking-like", size=0.1)


def half_edges(faces):
    return np.stack([faces, faces[:, [1, 2, 0]]], axis=2).reshape(-1, 2).astype(np.int64)


def parts(faces, n_vertices):
    """Label of the connected part of each vertex."""
    label = np.arange(n_vertices)
    edges = half_edges(faces)
    while True:
        low = np.minimum(label[edges[:, 0]], label[edges[:, 1]])
        new = label.copy()
        np.minimum.at(new, edges[:, 0], low)
        np.minimum.at(new, edges[:, 1], low)
        new = new[new]
        if np.array_equal(new, label):
            return label
        label = new


def test_versions_count_up_and_frames_carry_them(scene):
    versions = [frame.topologies["statue"].version for frame in scene.frames() if frame.topologies]
    assert len(versions) >= 5
    assert versions == list(range(1, len(versions) + 1))


def test_each_topology_fits_its_frame(scene):
    for frame in scene.frames():
        assert (frame.start is not None) == bool(frame.topologies)
        for name, change in frame.topologies.items():
            statue = scene.mesh_names.index(name)
            assert change.n_vertices == len(frame[statue]) == len(frame.start[statue])
            np.testing.assert_array_equal(change.faces, scene.faces(frame.index)[statue])
            assert np.array_equal(np.unique(change.faces), np.arange(change.n_vertices)), "no vertex unused"


def test_every_part_is_a_closed_surface_at_any_time(scene):
    """Each half-edge has its opposite: no holes and no flipped faces, before the break or after."""
    for faces in {scene.faces(k)[0].tobytes(): scene.faces(k)[0] for k in range(len(scene))}.values():
        edges = half_edges(faces)
        key = edges[:, 0] * (1 << 32) + edges[:, 1]
        back = edges[:, 1] * (1 << 32) + edges[:, 0]
        assert np.array_equal(np.sort(key), np.sort(back))
        # Where a crack meets itself in one point, the walls on both sides share their upright edge.
        assert len(key) - len(np.unique(key)) < 1e-3 * len(key)


def test_more_and_more_pieces_come_off(scene):
    changes = [frame.topologies["statue"] for frame in scene.frames() if frame.topologies]
    counts = [len(np.unique(parts(c.faces, c.n_vertices))) for c in changes]
    assert counts == sorted(counts)
    assert counts[-1] >= 100
    faces = [len(scene.meshes[0].faces)] + [len(c.faces) for c in changes]
    assert faces == sorted(faces)


def test_start_is_the_frame_before_in_the_new_topology(scene):
    """No vertex of `start` lies elsewhere than a vertex of the frame before: pieces are cut free, not moved."""
    for frame in scene.frames():
        if frame.topologies:
            before = {row.tobytes() for row in scene.frame(frame.index - 1)[0]}
            assert {row.tobytes() for row in frame.start[0]} == before
            for a, b in zip(frame.start[1:], scene.frame(frame.index - 1)[1:], strict=True):
                np.testing.assert_array_equal(a, b)


def test_pieces_move_rigidly_and_apart(scene):
    last = len(scene) - 1
    faces, a, b = scene.faces(last)[0], scene.frame(last - 1)[0], scene.frame(last)[0]
    edges = half_edges(faces)
    lengths = [np.linalg.norm(v[edges[:, 0]].astype(float) - v[edges[:, 1]], axis=1) for v in (a, b)]
    np.testing.assert_allclose(*lengths, atol=2e-6)
    whole = np.ptp(scene.frame(0)[0], axis=0)
    assert np.ptp(b, axis=0)[:2].max() > 1.3 * whole[:2].max(), "debris spreads over the ground"
    assert b[:, 2].mean() < scene.frame(0)[0][:, 2].mean() - 0.3, "and falls"
    assert b[:, 2].min() > scene.frame(0)[2][:, 2].max() - 0.3, "and stays on the ground"
