# SPDX-License-Identifier: Apache-2.0
"""When the messages of a frame of the scene were sent: the oldest one of each mesh counts."""

import numpy as np
import pytest
from pipelines import retried

from hpccd_core.rigid.transform import IDENTITY
from hpccd_ros.frames import transform_buffer
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import (
    ALWAYS,
    OUTDATED,
    POSE,
    TF,
    AssemblyRules,
    MeshFrame,
    MeshSettings,
    PoseFrame,
    Topology,
)

FACES = np.array([[0, 1, 2]], np.uint32)
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def pipeline(*meshes, **rules):
    made = FramePipeline(meshes, AssemblyRules(**{"frame_id": "world", **rules}))
    for mesh in meshes:
        made.push(mesh.name, Topology(0, 3, FACES, sent=1))
    return made


def frame(stamp, sent, received=0.0, **fields):
    return MeshFrame(stamp, TRIANGLE, 0, frame_id="world", sent=sent, received=received, **fields)


def places(outcome):
    return [tuple(origin.place for origin in scene.origins) for scene in outcome.frames]


def test_a_frame_that_is_used_again_grows_old():
    made = pipeline(MeshSettings("fast"), MeshSettings("slow"), tolerance=100)
    made.push("slow", frame(10, 1000))
    made.push("slow", frame(100, 1100))
    assert places(made.push("fast", frame(11, 1010))) == [(1010, 1000)]
    assert places(made.push("fast", frame(12, 1020))) == [(1020, 1000)]


def test_transforms_count_and_static_ones_have_no_age():
    made = pipeline(MeshSettings("cloth", transform="tf"), MeshSettings("tool", input=TF, frame="tool"))
    made.push("tool", frame(0, 5))
    transforms = made.transforms
    transforms.add("world", "camera", IDENTITY, None, sent=3)
    transforms.add("world", "tool", IDENTITY, 100, sent=900)
    transforms.add("world", "tool", IDENTITY, 300, sent=950)
    outcome = made.push("cloth", MeshFrame(200, TRIANGLE, 0, frame_id="camera", sent=1000))
    assert places(outcome) == [(1000, 900)], "between two, the older one"
    assert outcome.frames[0].origins[1].shape == 5
    assert transforms.rejected("camera", static=True) and not transforms.rejected("other", static=True)
    outcome = made.push("cloth", MeshFrame(300, TRIANGLE, 0, frame_id="camera", sent=1010))
    assert places(outcome) == [(OUTDATED, 950)], "where the camera is, a newer transform said that was rejected"
    transforms.add("world", "camera", IDENTITY, None, sent=1015)
    assert transforms.rejected(None, static=False), "a message that cannot be read"
    transforms.add("world", "tool", IDENTITY, 400, sent=1016)
    assert places(made.push("cloth", MeshFrame(350, TRIANGLE, 0, frame_id="camera", sent=1020))) == [(1020, 950)]
    transforms.add("world", "tool", IDENTITY, None, sent=1030)
    assert places(made.push("cloth", MeshFrame(500, TRIANGLE, 0, frame_id="camera", sent=1040))) == [(1040, ALWAYS)]
    assert not retried(made).frames


@pytest.mark.parametrize("child", ["camera", None])
def test_an_older_static_transform_that_comes_after_a_rejected_one(child, monkeypatch):
    """Messages of two publishers are not ordered; whether the frame was known or not."""
    monkeypatch.setattr(transform_buffer, "MOST_FRAMES", 2)
    for known in (False, True):
        made = pipeline(MeshSettings("cloth", transform="tf"))
        if known:
            made.transforms.add("world", "camera", IDENTITY, None, sent=1)
        for other in ("a", "b")[: 0 if child is None else 2]:  # more than are kept
            made.transforms.rejected(other, static=True, sent=1)
        assert made.transforms.rejected(child, static=True, sent=100) == known
        for stamp, sent in ((1, 99), (2, 100), (3, 101)):
            made.transforms.add("world", "camera", IDENTITY, None, sent=sent)
            outcome = made.push("cloth", MeshFrame(stamp, TRIANGLE, 0, frame_id="camera", sent=1000))
            assert places(outcome) == [(1000 if sent > 100 else OUTDATED,)]


def test_a_new_topology_that_is_not_in_use_yet():
    """For a mesh that moves, or moves by poses: its frames continue with the previous topology."""
    made = pipeline(MeshSettings("cloth"), MeshSettings("tool", input=POSE))
    made.push("tool", frame(0, 10))
    made.push("tool", Topology(1, 3, FACES[:, ::-1], sent=20))
    made.push("cloth", frame(1, 30))
    assert places(made.push("tool", PoseFrame(1, IDENTITY, "world", sent=30))) == [(30, OUTDATED)]
    made.push("tool", MeshFrame(0, TRIANGLE, 1, frame_id="world", sent=40))
    made.push("cloth", Topology(1, 3, FACES[:, ::-1], sent=40))
    made.push("cloth", frame(2, 50))
    assert places(made.push("tool", PoseFrame(2, IDENTITY, "world", sent=50))) == [(OUTDATED, 50)]


def test_a_static_mesh_whose_newest_message_is_not_in_use_is_outdated():
    made = pipeline(MeshSettings("hand"), MeshSettings("table", static=True), frame_id="")
    made.push("table", frame(0, 10, received=1.0))
    assert places(made.push("hand", frame(1, 20))) == [(20, 10)]
    made.push("table", frame(0, 30, received=2.0))
    assert places(made.push("hand", frame(2, 40))) == [(40, 30)], "the same again"
    for newer in (
        MeshFrame(0, TRIANGLE[:2], 0, frame_id="world", sent=50, received=3.0),
        MeshFrame(0, TRIANGLE, 7, frame_id="world", sent=50, received=5.0),  # its topology has not come
        MeshFrame(0, TRIANGLE, 0, frame_id="map", sent=50, received=7.0),
    ):
        made.push("table", newer)
        stamp = 10 * round(newer.received)
        assert places(made.push("hand", frame(stamp, 60))) == [(60, OUTDATED)]
        made.push("table", frame(0, 70, received=newer.received + 1))
        assert places(made.push("hand", frame(stamp + 1, 80))) == [(80, 70)]


def test_positions_that_a_new_topology_makes_void():
    made = pipeline(MeshSettings("hand"), MeshSettings("table", static=True))
    assert made.push("table", Topology(1, 3, FACES, sent=5)).unplaced == (), "there were none"
    made.push("table", frame(0, 10))
    made.push("table", MeshFrame(0, TRIANGLE, 1, frame_id="world", sent=20))
    assert made.push("table", Topology(2, 3, FACES, sent=30)).unplaced == (("table", 20),)
    made.push("table", MeshFrame(0, TRIANGLE, 3, frame_id="world", sent=40))
    assert made.push("table", Topology(3, 3, FACES, sent=50)).unplaced == (), "they waited for it"


def test_a_shape_and_a_topology_that_are_sent_again():
    made = pipeline(MeshSettings("tool", input=POSE), MeshSettings("table", static=True))
    made.push("table", frame(0, 1))
    made.push("tool", frame(0, 10))
    (first,) = made.push("tool", PoseFrame(1, IDENTITY, "world", sent=20)).frames
    made.push("tool", frame(0, 30))
    made.push("tool", Topology(0, 3, FACES, sent=40))
    (second,) = made.push("tool", PoseFrame(2, IDENTITY, "world", sent=50)).frames
    assert [tuple(scene.origins[0]) for scene in (first, second)] == [(20, 10, 1), (50, 30, 40)]
