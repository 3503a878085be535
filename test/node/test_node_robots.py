# SPDX-License-Identifier: Apache-2.0
"""Robots beside a cloth: described by a file or on a topic, moved by joint states or transforms, recorded and computed
again."""

import crane
import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros import client
from hpccd_ros.bag.reader import Recording
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.rigid_step import RigidOptions
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, Placement, SceneFrame, Topology
from hpccd_ros.middleware import contact_messages, fields, qos
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay
from hpccd_ros.rigid.transform import Rigid

N = 8
SHEET = Topology(0, N * N, sheet_faces(N))
ROBOT = crane.robot()
NAMES = ("cloth", *crane.LINKS)
TOPOLOGIES = (SHEET, *(mesh.topology for mesh in ROBOT.meshes))
BASE = Rigid.of((0.2, 0.5, 0.03), (0.0, 0.0, 0.0, 1.0))
TOLERANCE = 0.002
BUILDER = SceneBuilder((MeshSettings("cloth"), *ROBOT.settings()), ROBOT.ignored_pairs)


def frame(k, by_joints=True):
    placements = ROBOT.placements(ROBOT.kinematics.state(crane.values(k), BASE))
    if not by_joints:
        placements = tuple(
            Placement(mesh.body, Rigid.of(p.pose.shift, p.pose.quaternion))
            for mesh, p in zip(ROBOT.meshes, placements, strict=True)
        )
    vertices = (sheet_positions(N, k), *(p.vertices for p in placements))
    return SceneFrame(k, k, "world", TOPOLOGIES, vertices, NAMES, 0.0, (None, *placements))


def assert_answer(message, k, by_joints=True):
    """That of the step from frame k - 1 to k; how many contacts."""
    options = Options(backend="cpu", rigid=RigidOptions(TOLERANCE, 64))
    expected = StepDetector(BUILDER, options).detect(frame(k - 1, by_joints), frame(k, by_joints))
    got = contact_messages.read_contacts(message, Layout.of(NAMES, TOPOLOGIES))
    for name in ("vf", "ee", "vf_toc", "ee_toc"):
        assert np.array_equal(getattr(got, name), getattr(expected.contacts, name)), name
    assert message.hash == expected.contacts.hash
    assert list(message.mesh_names) == list(NAMES)
    arrays = client.contacts_from_message(message)
    assert arrays.parts == expected.bounds.parts
    assert tuple(arrays.motion_bounds.tolist()) == expected.bounds.of_meshes
    return message.total


def parameters(**robot):
    robot = {"description": "robot_description", **robot}
    return {
        "meshes": ["cloth"], "robots": ["crane"], "frame_id": "world", "rigid_tolerance": TOLERANCE,
        **{f"robot.crane.{key}": value for key, value in robot.items()},
    }  # fmt: skip


POSE = [*BASE.shift.tolist(), *BASE.quaternion.tolist()]
JOINTS = {"joint_states": "joint_states", "pose": POSE}


def cloth(node, k):
    node.peer.vertices("cloth", sheet_positions(N, k), stamp=k, frame_id="world")


def describe(node, text=crane.URDF):
    publisher = node.peer.publisher(String, "robot_description", qos.DESCRIPTION)
    publisher.publish(String(data=text))
    return publisher


def transforms(k, prefix=""):
    poses = ROBOT.kinematics.state(crane.values(k), BASE).poses
    for link, at in poses.items():
        message = TransformStamped(child_frame_id=prefix + link)
        message.header.stamp, message.header.frame_id = fields.ns_to_stamp(k), "world"
        place, turn = message.transform.translation, message.transform.rotation
        place.x, place.y, place.z = at.shift.tolist()
        turn.x, turn.y, turn.z, turn.w = at.quaternion.tolist()
        yield message


@pytest.mark.parametrize("given", ["file", "topic"])
@pytest.mark.parametrize("by", ["joints", "tf"])
def test_streamed_recorded_and_verified(start_node, tmp_path, by, given):
    path, file = tmp_path / "run.mcap", tmp_path / "crane.urdf"
    file.write_text(crane.URDF)
    robot = JOINTS if by == "joints" else {"frame_prefix": "left_"}
    if given == "file":
        robot = {**robot, "description": str(file)}
    node = start_node({**parameters(**robot), "record": str(path)})
    if given == "topic":
        describe(node)
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    kind, topic = (JointState, "joint_states") if by == "joints" else (TransformStamped, "transforms")
    publisher = node.peer.publisher(kind, topic, qos.TRANSFORMS)
    total = 0
    for k in range(1, 7):
        for message in [crane.joint_state(k, k)] if by == "joints" else transforms(k, "left_"):
            publisher.publish(message)
        cloth(node, k)
        node.frames_status(answered=4 * k)
        if k > 1:
            total += assert_answer(node.contacts(k - 1)[-1], k, by == "joints")
    assert total > 30
    assert node.stop() == 0
    file.unlink()  # a replay needs it no more
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 5
