# SPDX-License-Identifier: Apache-2.0
"""Whether meshes come within the distance during a step, against brute force. No ROS."""

import numpy as np
import pytest
import stop_scene
from hand_and_table import FACES, MESHES, TABLE, hand

from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

OPTIONS = Options(backend="cpu", threads=1, accuracy="fast", report="first", features=("edge_edge",))


def scene(faces, *, names=MESHES, static=()):
    """(builder, function that makes frames of positions)."""
    builder = SceneBuilder(tuple(MeshSettings(name, name in static) for name in names))
    topologies = tuple(Topology(0, int(f.max()) + 1, f) for f in faces)

    def frame(*positions):
        return SceneFrame(0, 0, "", topologies, positions, names, 0.0)

    return builder, frame


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.long) for seed in (2, 3))])
def test_random_approaches(seed):
    """Streams: the end of a step is the start of the next."""
    random = np.random.default_rng(seed)
    builder, frame = scene(stop_scene.FACES, names=stop_scene.MESHES)
    nearness = Nearness(builder, OPTIONS, stop_scene.DISTANCE)
    frames = [f for _ in range(8) for f in stop_scene.trial(random)]
    made = [frame(*f) for f in frames]
    found = [nearness.within(*step)[0] is not None for step in zip(made, made[1:], strict=False)]
    truth = [stop_scene.near(*step) for step in zip(frames, frames[1:], strict=False)]
    assert found == truth and 8 < sum(truth) < len(truth) - 8


def test_exactly_the_distance_counts_and_may_change():
    builder, frame = scene((FACES, FACES))
    nearness = Nearness(builder, OPTIONS, 0.25)
    far, near = frame(hand(0.25 * (1 + 2**-52)), TABLE), frame(hand(0.25), TABLE)
    assert nearness.within(far, far) == (None, 0.25) and nearness.within(far, near) == (MESHES, 0.25)
    nearness.set(OPTIONS, 0.125)
    assert nearness.within(near, near) == (None, 0.125)


NEEDLE = np.array([[0, 0, -6.0], [0, 0, 6.0], [0.01, 0, 6.0]])


def test_what_pierces_far_from_all_borders():
    """As long as it does, and not when it was put apart."""
    builder, frame = scene((FACES, FACES))
    nearness = Nearness(builder, OPTIONS, 0.1)
    crossed, apart = frame(NEEDLE, TABLE), frame(NEEDLE + (0, 0, 7), TABLE)
    assert [nearness.within(*step)[0] for step in ((crossed, crossed),) * 2] == [MESHES, MESHES]
    assert [nearness.within(*step)[0] for step in ((crossed, apart), (apart, apart))] == [MESHES, None]
    assert nearness.within(apart, crossed)[0] and nearness.within(crossed, crossed)[0]


def test_the_meshes_that_are_near_are_named():
    """In the order of the scene, whichever of them has the vertex or the edge."""
    names = ("sheet", "hand", "table")
    builder, frame = scene((FACES, FACES, FACES), names=names)
    nearness = Nearness(builder, OPTIONS, 0.1)
    apart = hand(2.0), TABLE - (0, 0, 9), TABLE
    for near, pair in (
        (apart, None),
        ((hand(0.05), *apart[1:]), ("sheet", "table")),
        ((hand(2.0), hand(2.05), TABLE), ("sheet", "hand")),
        ((TABLE - (0, 0, 20), NEEDLE, TABLE), ("hand", "table")),  # intersects far from all borders
    ):
        assert nearness.within(frame(*near), frame(*near))[0] == pair


def test_a_static_mesh_that_is_put_elsewhere():
    builder, frame = scene((FACES, FACES), static=("table",))
    nearness = Nearness(builder, OPTIONS, 0.1)
    below, between = TABLE - (0, 0, 7), TABLE.copy()
    apart, crossed = frame(NEEDLE, below), frame(NEEDLE, between)
    assert not nearness.within(apart, apart)[0] and not nearness.within(apart, frame(NEEDLE.copy(), below))[0]
    assert not nearness.within(apart, apart)[0]
    assert nearness.within(apart, crossed)[0], "nothing moved there"


def test_meshes_that_are_not_tested_and_those_that_are():
    meshes = tuple(MeshSettings(name, static=name in "cd") for name in "abcd")
    assert SceneBuilder(meshes).pairs == [("a", "b"), ("a", "c"), ("a", "d"), ("b", "c"), ("b", "d")]
    assert SceneBuilder(meshes, (("d", "a"), ("b", "a"))).pairs == [("a", "c"), ("b", "c"), ("b", "d")]
    between = SceneBuilder(meshes, (("d", "a"),), (("a", "b", "fast"),), (("a", "b", ("edge_edge",)),)).between_meshes
    assert not any(mesh.self_collision for mesh in between.meshes) and between.ignored_pairs == (("d", "a"),)
    assert between.pair_accuracies == between.pair_features == ()
