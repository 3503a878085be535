# SPDX-License-Identifier: Apache-2.0
"""Meshes that keep their shape: a shape once, then poses, or transforms alone. No ROS."""

from itertools import pairwise

import numpy as np
import pytest
from pipelines import reasons, retried

from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import AssemblyRules, MeshFrame, MeshSettings, Outcome, PoseFrame, Topology

FACES = np.array([[0, 1, 2]], np.uint32)
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
QUARTER = Rigid.of((1, 2, 3), (0, 0, np.sqrt(0.5), np.sqrt(0.5)))  # about z, then to 1 2 3
TURNED = [[1, 2, 3], [1, 3, 3], [0, 2, 3]]
CLOTH, BOX = MeshSettings("cloth"), MeshSettings("box", self_collision=False, input="pose")
LINK, TOOL = (MeshSettings(name, frame=f"{name}_frame", input="tf") for name in ("link", "tool"))


MS = 10**6


def topology(version=0):
    return Topology(version, 3, FACES)


def shape(version=0, scale=1):
    return MeshFrame(5, scale * TRIANGLE, version)


def cloth(stamp):
    return MeshFrame(stamp, TRIANGLE, 0)


def pipeline_of(*meshes, shapes=True, **rules):
    made = FramePipeline(meshes, AssemblyRules(frame_id="world", **rules))
    for mesh in meshes:
        made.push(mesh.name, topology())
        if shapes and mesh.rigid:
            assert made.push(mesh.name, shape()).static_taken == 1
    return made


def test_a_pose_makes_a_frame():
    pipeline = pipeline_of(BOX)
    (frame,) = pipeline.push("box", PoseFrame(7, QUARTER, received=2.5)).frames
    assert (frame.stamp, frame.fresh, frame.received) == (7, ("box",), 2.5)
    np.testing.assert_allclose(frame.vertices[0], TURNED, atol=1e-15)
    assert frame.vertices[0].dtype == np.float64 and frame.placements[0].pose is QUARTER
    (later,) = pipeline.push("box", PoseFrame(8, IDENTITY)).frames
    assert later.placements[0].body is frame.placements[0].body and frame.same_scene(later)


def test_poses_of_the_same_stamp_as_frames_of_others():
    pipeline = pipeline_of(CLOTH, BOX)
    assert not pipeline.push("box", PoseFrame(7, QUARTER)).frames
    (frame,) = pipeline.push("cloth", cloth(7)).frames
    assert frame.placements[0] is None and frame.placements[1].pose is QUARTER


def test_without_a_shape_a_pose_is_rejected():
    pipeline = pipeline_of(BOX, shapes=False)
    outcome = pipeline.push("box", PoseFrame(7, QUARTER))
    assert reasons(outcome) == [("box", "no_shape")] and "mesh.box.file" in outcome.rejections[0].text
    pipeline.push("box", shape())
    assert pipeline.push("box", PoseFrame(8, QUARTER)).frames


def test_a_shape_of_another_size_is_rejected_with_each_pose():
    pipeline = pipeline_of(BOX, shapes=False)
    pipeline.push("box", MeshFrame(0, TRIANGLE[:2], 0))
    assert reasons(pipeline.push("box", PoseFrame(7, QUARTER))) == [("box", "wrong_vertex_count")]


def test_the_same_shape_again_is_the_same_body_and_another_one_is_not():
    pipeline = pipeline_of(BOX)
    bodies = []
    for stamp, scale in ((1, 1), (2, 1), (3, 2)):
        pipeline.push("box", shape(scale=scale))
        (frame,) = pipeline.push("box", PoseFrame(stamp, QUARTER)).frames
        bodies.append(frame.placements[0].body)
    assert bodies[0] is bodies[1] is not bodies[2]


def test_a_file_and_where_it_stands_in_the_body():
    stands = MeshSettings("box", pose=(1, 2, 3, 0, 0, np.sqrt(0.5), np.sqrt(0.5)), input="pose")
    pipeline = FramePipeline((stands,), AssemblyRules())
    pipeline.load("box", topology(), MeshFrame(0, TRIANGLE, 0))
    (frame,) = pipeline.push("box", PoseFrame(7, Rigid.of((0, 0, 10), (0, 0, 0, 1)))).frames
    np.testing.assert_allclose(frame.vertices[0], np.array(TURNED) + [0, 0, 10], atol=1e-15)


def test_poses_too_far_away():
    outcome = pipeline_of(BOX).push("box", PoseFrame(7, Rigid.of((2e150, 0, 0), (0, 0, 0, 1))))
    assert reasons(outcome) == [("box", "out_of_range")]


@pytest.mark.parametrize("far, taken", [(9e146, True), (1.1e147, False), (9e149, False)])
def test_poses_whose_arcs_would_leave_what_the_core_takes_are_rejected_at_once(far, taken):
    """Whichever two come, the step between them is processed: half a turn, with a separation and a mesh as far away."""
    half = Rigid.of((far, far, 0), (0, 0, 1, 0))
    poses = [Rigid.of((far, far, 0), (0, 0, 0, 1)), half, Rigid.of((-far, -far, far), (1, 0, 0, 0))]
    pipeline = pipeline_of(BOX, MeshSettings("tool", self_collision=False, input="pose"))
    frames = []
    for stamp, pose in enumerate(poses):
        outcome = pipeline.push("box", PoseFrame(stamp, pose))
        outcome += pipeline.push("tool", PoseFrame(stamp, Rigid.of(-pose.shift, pose.quaternion)))
        assert reasons(outcome)[:1] == ([] if taken else [("box", "out_of_range")])
        assert taken or "of a mesh that moves by poses must lie in [-1e+147, 1e+147]" in outcome.rejections[0].text
        frames += outcome.frames
    assert len(frames) == (3 if taken else 0)
    builder = SceneBuilder([BOX, MeshSettings("tool", self_collision=False, input="pose")])
    detector = StepDetector(builder, Options(backend="cpu", separation=Separation(1e149)))
    assert all(len(detector.detect(start, end).contacts) for start, end in pairwise(frames))


def test_a_shape_too_large_for_poses_is_rejected_and_the_one_before_stays():
    stands = MeshSettings("box", pose=(1e147, 0, 0, 0, 0, 0, 1), input="pose")
    pipeline = pipeline_of(stands, shapes=False)
    outcome = pipeline.push("box", MeshFrame(0, np.float64(1e147) * TRIANGLE, 0))
    assert reasons(outcome) == [("box", "out_of_range")] and "placed by mesh.box.pose" in outcome.rejections[0].text
    assert reasons(pipeline.push("box", PoseFrame(1, QUARTER))) == [("box", "no_shape")]
    pipeline = pipeline_of(BOX)
    assert reasons(pipeline.push("box", MeshFrame(0, np.float64(1e148) * TRIANGLE, 0))) == [("box", "out_of_range")]
    (frame,) = pipeline.push("box", PoseFrame(1, QUARTER)).frames
    np.testing.assert_allclose(frame.vertices[0], TURNED, atol=1e-15)


def test_poses_in_another_frame_wait_for_its_transform():
    pipeline = pipeline_of(MeshSettings("box", transform="tf", input="pose"))
    assert not pipeline.push("box", PoseFrame(7, QUARTER, "hand")).frames and pipeline.waiting == 1
    pipeline.transforms.add("world", "hand", Rigid.of((0, 0, 10), (0, 0, 0, 1)), None)
    (frame,) = retried(pipeline).frames
    np.testing.assert_allclose(frame.vertices[0], np.array(TURNED) + [0, 0, 10], atol=1e-15)
    np.testing.assert_allclose(frame.placements[0].pose.shift, [1, 2, 13])


def test_transforms_are_asked_at_the_stamps_of_the_others():
    pipeline = pipeline_of(CLOTH, LINK)
    outcome = pipeline.push("cloth", cloth(15))
    assert outcome.asked == ["link"] and not outcome.frames and pipeline.waiting == 2
    pipeline.transforms.add("world", "link_frame", IDENTITY, 10)
    assert not retried(pipeline).frames
    pipeline.transforms.add("world", "link_frame", Rigid.of((2, 0, 0), (0, 0, 0, 1)), 20)
    (frame,) = retried(pipeline).frames
    np.testing.assert_allclose(frame.placements[1].pose.shift, [1, 0, 0])
    assert frame.stamp == 15 and set(frame.fresh) == {"cloth", "link"} and pipeline.waiting == 0


def test_a_transform_that_does_not_come_is_told_and_gives_way(warned_at_once):
    pipeline = pipeline_of(CLOTH, LINK, max_pending=3)
    outcome = Outcome()
    for stamp in range(1, 8):
        outcome += pipeline.push("cloth", cloth(stamp))
    assert {("link", "no_transform"), ("cloth", "incomplete")} == set(reasons(outcome))
    assert outcome.asked == ["link"] * 7 and pipeline.waiting + len(outcome.rejections) == 14
    assert "no transform connects 'link_frame' and 'world'" in pipeline.awaited_transform("link")[0]


def test_transforms_alone_give_a_frame_for_each_time_that_all_have_reached():
    pipeline = pipeline_of(LINK, TOOL)
    stamps = []
    for stamp, child in ((10, "link"), (10, "tool"), (20, "tool"), (20, "link"), (30, "link"), (30, "tool")):
        pose = Rigid.of((stamp, 0, 0), (0, 0, 0, 1))
        parent = "world" if child == "link" else "link_frame"
        pipeline.transforms.add(parent, f"{child}_frame", pose, stamp)
        stamps += [
            (frame.stamp, *(placement.pose.shift[0] for placement in frame.placements))
            for frame in retried(pipeline).frames
        ]
    assert stamps == [(10, 10, 20), (20, 20, 40), (30, 30, 60)]


def test_transforms_that_hold_at_all_times_move_nothing():
    pipeline = pipeline_of(LINK)
    pipeline.transforms.add("world", "link_frame", QUARTER, None)
    outcome = retried(pipeline)
    assert not outcome.frames and not outcome.asked and pipeline.waiting == 0


@pytest.mark.parametrize("meshes", [(BOX,), (CLOTH, BOX), (CLOTH, LINK), (LINK,)])
def test_a_stream_that_begins_anew(meshes):
    """As with vertices: after a few frames of an earlier time; where transforms alone move, at once."""
    pipeline = pipeline_of(*meshes, restart_after=3)
    frames, restarts = [], 0
    for stamp in (5000, 5001, *range(10, 16)):
        outcome = Outcome()
        pipeline.transforms.add("world", "link_frame", Rigid.of((stamp, 0, 0), (0, 0, 0, 1)), stamp * MS)
        for mesh in meshes:
            if mesh.input != "tf":
                message = PoseFrame(stamp * MS, QUARTER) if mesh.rigid else cloth(stamp * MS)
                outcome += pipeline.push(mesh.name, message)
        outcome += retried(pipeline)
        for frame in outcome.frames:
            frames.append(frame.stamp // MS)
            if LINK in meshes:
                assert frame.placements[-1].pose.shift[0] == frames[-1]
        restarts += len(outcome.restarts)
    assert restarts == 1 and frames[:2] == [5000, 5001] and frames[-1] == 15
    assert frames[2] == (10 if meshes == (LINK,) else 12)


@pytest.mark.parametrize("restart_after, first", [(5, 130), (2, 130), (8, 160), (0, None)])
def test_transforms_alone_that_go_back_by_less_than_a_second_begin_anew_as_meshes_do(restart_after, first):
    pipeline = pipeline_of(LINK, TOOL, restart_after=restart_after)
    stamps, outcome = [], Outcome()
    for run, times in enumerate([range(0, 900, 10), range(100, 1000, 10)]):
        for stamp in times:
            for child, parent in (("link", "world"), ("tool", "link_frame")):
                pose = Rigid.of((100.0 * run, 0, 0), (0, 0, 0, 1))
                pipeline.transforms.add(parent, f"{child}_frame", pose, stamp * MS)
                part = retried(pipeline)
                stamps += [frame.stamp // MS for frame in part.frames]
                if first is not None:
                    assert all(frame.placements[1].pose.shift[0] == 200.0 * run for frame in part.frames)
                outcome += part
    assert stamps[:90] == list(range(0, 900, 10))
    assert stamps[90:] == list(range(900 if first is None else first, 1000, 10))
    assert len(outcome.restarts) == (first is not None) and not outcome.rejections


def test_transforms_alone_of_which_one_is_late_do_not_begin_anew():
    pipeline, stamps = pipeline_of(LINK), []
    for stamp in (0, 10, 20, 30, 15, 16, 17, 40, 18, 19, 21, 22, 50):
        pipeline.transforms.add("world", "link_frame", IDENTITY, stamp * MS)
        outcome = retried(pipeline)
        stamps += [frame.stamp // MS for frame in outcome.frames]
        assert not outcome.restarts
    assert stamps == [0, 10, 20, 30, 40, 50]


def test_a_transform_far_ahead_moves_a_scene_of_transforms_alone_there_and_back():
    pipeline, stamps, restarts = pipeline_of(LINK), [], []
    for stamp in (1000, 1010, 3_600_000, 1020, 1030):
        pipeline.transforms.add("world", "link_frame", IDENTITY, stamp * MS)
        outcome = retried(pipeline)
        stamps += [frame.stamp // MS for frame in outcome.frames]
        restarts += outcome.restarts
    assert stamps == [1000, 1010, 3_600_000, 1020, 1030] and len(restarts) == 1


@pytest.mark.parametrize("later", [1020, 0])
def test_what_is_left_out_far_ahead_takes_nothing_that_is_known_with_it(later):
    pipeline, seen = pipeline_of(LINK), []
    for stamp, x in ((1000, 0.0), (1010, 1.0), (3_600_000, 2.0), (990, 3.0), (later, 4.0)):
        pipeline.transforms.add("world", "link_frame", Rigid.of((x, 0, 0), (0, 0, 0, 1)), stamp * MS)
        outcome = retried(pipeline)
        assert not outcome.rejections
        seen += [(frame.stamp // MS, frame.placements[0].pose.shift[0]) for frame in outcome.frames]
    assert seen == [(1000, 0.0), (1010, 1.0), (3_600_000, 2.0), (1010, 1.0), (later, 4.0)]


def test_of_what_was_far_ahead_together_each_goes_on_by_itself():
    pipeline, stamps, rejections = pipeline_of(LINK, TOOL), [], []
    for stamp in (10_000, 3_600_000, 10_010, 10_020):
        for frame in ("tool", "link"):
            pipeline.transforms.add("world", f"{frame}_frame", IDENTITY, stamp * MS)
            outcome = retried(pipeline)
            stamps += [frame.stamp // MS for frame in outcome.frames]
            rejections += outcome.rejections
    assert stamps == [10_000, 3_600_000, 10_010, 10_020] and pipeline.waiting == 0 and not rejections


def test_after_the_clock_was_set_back_no_transform_from_before_is_used():
    pipeline, seen = pipeline_of(CLOTH, LINK), []

    def transform(stamp, x):
        pipeline.transforms.add("world", "link_frame", Rigid.of((x, 0, 0), (0, 0, 0, 1)), stamp * MS)
        return retried(pipeline)

    for stamp in range(0, 3000, 20):
        transform(stamp, 0.0)
        pipeline.push("cloth", cloth(stamp * MS))
    for stamp in range(10, 200, 20):
        outcome = pipeline.push("cloth", cloth(stamp * MS), stamp == 10)
        outcome += transform(stamp, 100.0)
        seen += [(frame.stamp // MS, frame.placements[1].pose.shift[0]) for frame in outcome.frames]
    assert seen and all(x == 100.0 for _, x in seen) and seen[-1][0] == 190


@pytest.mark.parametrize("restart_after", [0, 5])
def test_rejected_frames_of_the_leader_ask_nothing_of_transforms(restart_after):
    pipeline = pipeline_of(CLOTH, LINK, restart_after=restart_after)
    pipeline.transforms.add("world", "link_frame", QUARTER, None)
    stamps = []
    for stamp in (100, 200, 10**12, 300, 400, *range(210, 260, 10), 500):
        wrong = stamp == 10**12 or 200 < stamp < 300
        message = MeshFrame(stamp, np.zeros((4, 3)), 0) if wrong else cloth(stamp)
        outcome = pipeline.push("cloth", message)
        stamps += [frame.stamp for frame in outcome.frames]
        assert outcome.asked == ([] if wrong else ["link"]) and not outcome.restarts
        assert reasons(outcome) == ([("cloth", "wrong_vertex_count")] if wrong else [])
    assert stamps == [100, 200, 300, 400, 500] and pipeline.waiting == 0


def test_a_new_publisher_loses_no_frame_where_transforms_move_another_mesh():
    pipeline = pipeline_of(CLOTH, LINK)
    pipeline.transforms.add("world", "link_frame", QUARTER, None)
    stamps = []
    for stamp in (100_000, 200_000, 100, 200):
        outcome = pipeline.push("cloth", cloth(stamp), stamp == 100)
        stamps += [frame.stamp for frame in outcome.frames]
        assert len(outcome.restarts) == (stamp == 100) and not outcome.rejections
    assert stamps == [100_000, 200_000, 100, 200]


def test_transforms_alone_wait_for_those_that_are_not_there_yet():
    pipeline, stamps, rejected = pipeline_of(LINK, TOOL, max_pending=8), [], []
    for now in range(0, 300, 10):
        pipeline.transforms.add("world", "link_frame", IDENTITY, now * MS)
        if now >= 100:  # begins later, and comes late
            pipeline.transforms.add("world", "tool_frame", IDENTITY, (now - 80) * MS)
        outcome = retried(pipeline)
        stamps += [frame.stamp // MS for frame in outcome.frames]
        rejected += reasons(outcome) + outcome.restarts
    assert stamps == list(range(20, 220, 10)) and not rejected


def test_a_frame_of_the_leader_that_waited_for_its_topology_asks_too():
    pipeline = FramePipeline((CLOTH, LINK), AssemblyRules(frame_id="world"))
    pipeline.push("link", topology())
    pipeline.push("link", shape())
    pipeline.transforms.add("world", "link_frame", QUARTER, None)
    assert pipeline.push("cloth", cloth(7)).asked == []
    outcome = pipeline.push("cloth", topology())
    assert outcome.asked == ["link"] and [frame.stamp for frame in outcome.frames] == [7]
