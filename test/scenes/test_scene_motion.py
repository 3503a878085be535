# SPDX-License-Identifier: Apache-2.0
"""Motions are what the titles say: nothing stands still, tears, sinks or flies away."""

import numpy as np
import pytest

from hpccd_ros import scenes
from hpccd_ros.scenes import rigid


@pytest.fixture(scope="module")
def drop():
    return scenes.make("cloth-drop")


def edge_lengths(faces, vertices):
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return np.linalg.norm(vertices[edges[:, 0]].astype(float) - vertices[edges[:, 1]], axis=1)


def test_cloth_does_not_tear(drop):
    rest = edge_lengths(drop.meshes[0].faces, drop.frame(0)[0])
    for index in range(0, len(drop), 10):
        stretch = edge_lengths(drop.meshes[0].faces, drop.frame(index)[0]) / rest
        assert np.quantile(stretch, 0.99) < 1.2 and stretch.mean() == pytest.approx(1.0, abs=0.1)


def test_cloth_wraps_the_ball_and_the_ball_spins(drop):
    flat, wrapped = drop.frame(0)[0], drop.frame(len(drop) - 1)[0]
    assert np.ptp(flat[:, 2]) < 0.01 and np.ptp(wrapped[:, 2]) > 0.9
    # From a square of 2.4 m to within reach of the ball.
    assert np.abs(wrapped[:, :2]).max() < 1.1
    radius = np.linalg.norm(drop.frame(0)[1][0])
    distance = np.linalg.norm(wrapped.astype(float), axis=1)
    assert distance.min() > 0.99 * radius
    assert wrapped[:, 2].min() > -0.51
    before, after = drop.frame(len(drop) - 2)[1], drop.frame(len(drop) - 1)[1]
    turn = np.linalg.norm(after - before, axis=1).max() / radius
    assert 0.1 < turn < 0.4, "radians a frame"


def test_cloth_folds_over_itself(drop):
    """Seen from above, a place is covered 1.7 times on average at the end, once at the start."""

    def layers(vertices):
        corners = vertices[drop.meshes[0].faces][:, :, :2].astype(float)
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
        cells = {tuple(c) for c in np.floor(corners.mean(axis=1) / 0.04).astype(int)}
        return area / (len(cells) * 0.04**2)

    assert layers(drop.frame(0)[0]) < 1.2
    assert layers(drop.frame(len(drop) - 1)[0]) > 1.5


@pytest.mark.parametrize("name", ["n-body-like-lr", "n-body-like-hr"])
def test_bodies_fall_into_a_pile_and_stay_in_the_dish(name):
    scene = scenes.make(name, size=0.25)
    first, last = scene.frame(0), scene.frame(len(scene) - 1)
    for mesh in (0, 1):
        assert last[mesh][:, 2].mean() < first[mesh][:, 2].mean() - 0.3
        assert np.abs(last[mesh][:, :2]).max() < 2.2
        x, y, z = last[mesh].astype(float).T
        assert (z - 0.12 * (x * x + y * y)).min() > -0.15, "at most a wobble below the dish"


def test_rigid_bodies_keep_their_shape_and_deforming_ones_do_not():
    scene = scenes.make("n-body-like-lr")
    a, b = scene.frame(10), scene.frame(25)
    changes = []
    for mesh in (0, 1):
        faces = scene.meshes[mesh].faces
        changes.append(np.abs(edge_lengths(faces, b[mesh]) / edge_lengths(faces, a[mesh]) - 1))
    assert changes[0].max() < 1e-3
    assert changes[1].mean() > 0.02


def test_every_frame_moves():
    for name in ("cloth-drop", "n-body-like-lr", "folding-strip", "two-triangles"):
        scene = scenes.make(name)
        before = scene.frame(0).stacked()
        for index in range(1, len(scene)):
            now = scene.frame(index).stacked()
            assert np.abs(now - before).max() > 1e-3, (name, index)
            before = now


def test_spheres_rebound_and_come_to_rest_without_overlap():
    """Two balls dropped on a plane, one above the other, end up apart and on it."""
    bodies = rigid.Bodies(
        position=np.array([[0.0, 0.0, 0.3], [0.02, 0.0, 0.8]]),
        velocity=np.zeros((2, 3)),
        spin=np.zeros((2, 3)),
        mass=np.array([1.0, 2.0]),
        radius=np.array([0.2, 0.2]),
        sphere_centre=np.zeros((2, 3)),
        sphere_radius=np.array([0.2, 0.2]),
        sphere_body=np.array([0, 1]),
    )
    motion = rigid.simulate(bodies, rigid.flat_ground(0.0), 90, 1 / 30, rigid.Material(), False)
    end = motion["positions"][-1]
    assert end[:, 2] == pytest.approx(0.2, abs=0.01)
    assert np.linalg.norm(end[0] - end[1]) > 0.39
    lowest_pair_gap = np.linalg.norm(motion["positions"][:, 0] - motion["positions"][:, 1], axis=1).min()
    assert lowest_pair_gap > 0.35
