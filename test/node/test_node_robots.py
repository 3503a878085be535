# SPDX-License-Identifier: Apache-2.0
"""Robots beside a cloth: described by a file or on a topic, moved by joint states or transforms, recorded and computed
again."""

import itertools
import subprocess
import sys

import crane
import holding_node
import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from hpccd.msg import PairSummaryArray
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter
from node_process import PATIENCE
from sensor_msgs.msg import JointState
from sources import SUPPORT
from std_msgs.msg import String
from waving_sheet import sheet_faces, sheet_positions

from hpccd_core.rigid.transform import Rigid
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


def assert_result(message, k, by_joints=True):
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
    robot = {"description": "robot_description"} | robot
    return {
        "meshes": ["cloth"],
        "robots": ["crane"],
        "frame_id": "world",
        "rigid_tolerance": TOLERANCE,
        **{f"robot.crane.{key}": value for key, value in robot.items()},
    }


POSE = [*BASE.shift.tolist(), *BASE.quaternion.tolist()]
JOINTS = {"joint_states": "joint_states", "pose": POSE}


def cloth(node, k):
    node.peer.vertices("cloth", sheet_positions(N, k), stamp=k, frame_id="world")


def first_step(node):
    """Frames 1 and 2; the publisher of joint states."""
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states")
    for k in (1, 2):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
        node.frames_status(processed=4 * k)
    return joints


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
    latin = crane.URDF.replace('"1.0"?>', '"1.0" encoding="ISO-8859-1"?><!-- für Köln -->')
    file.write_bytes(latin.encode("iso-8859-1"))  # read so by node and replay
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
        node.frames_status(processed=4 * k)
        if k > 1:
            total += assert_result(node.contacts(k - 1)[-1], k, by == "joints")
    assert total > 30
    assert node.stop() == 0
    file.unlink()  # a replay needs it no more
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 5


def test_played_over_dds_with_its_description(start_node, tmp_path):
    path, steps = tmp_path / "run.mcap", 4
    node = start_node({**parameters(**JOINTS), "record": str(path)})
    describe(node)
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states", qos.TRANSFORMS)
    for k in range(1, steps + 1):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
        node.frames_status(processed=4 * k)
    assert node.stop() == 0
    names = ("robot_description", "joint_states", "meshes/cloth/topology", "meshes/cloth/vertices")
    again = start_node(
        {**parameters(**JOINTS), "frame_queue": 100}, remaps=[f"{name}:={node.namespace}/{name}" for name in names]
    )
    player = [sys.executable, "-m", "hpccd_ros.cli", "replay", str(path), "--publish", "--wait", str(PATIENCE)]
    done = subprocess.run(player, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert done.returncode == 0, done.stderr
    assert [m.hash for m in again.contacts(steps - 1)] == [m.hash for m in node.contacts(steps - 1)]


def test_a_robot_alone_moves_at_the_times_of_its_joint_states(start_node):
    node = start_node({**parameters(**JOINTS), "meshes": [""], "ignored_pairs": [""]})
    describe(node, crane.URDF.replace('"reach" type="prismatic"', '"reach" type="continuous"'))
    publisher = node.peer.publisher(JointState, "joint_states")
    for k in range(1, 4):
        publisher.publish(crane.joint_state(k, k))
        node.frames_status(processed=3 * k, received=3 * k)
    assert [message.header.stamp.nanosec for message in node.contacts(2)] == [2, 3]
    far = crane.joint_state(4, 4)
    far.position[0] = 1e10
    publisher.publish(far)
    values = node.frames_status(dropped__out_of_range=3)
    assert "positions: not finite, or beyond 1e+09, for turn" in values["last_rejection"]


def test_a_base_that_moves_by_transforms(start_node):
    node = start_node(parameters(joint_states="joint_states", frame_prefix="left_"))
    describe(node)
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states")
    tree = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
    for k, awaited in ((1, "crane waits: no transform connects 'left_mast'"), (2, "crane waits: the last one from")):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
        node.wait_until(lambda awaited=awaited: awaited in node.peer.statuses["frames"][1], "a word of it")
        tree.publish(next(transforms(k, "left_")))  # of the root
        node.frames_status(processed=4 * k)
    assert_result(node.contacts(1)[-1], 2)


def test_frames_wait_for_joint_states_and_take_what_lies_between_two(start_node):
    node = start_node(parameters(**JOINTS))
    describe(node)
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states")
    cloth(node, 10)
    values = node.frames_status(waiting=4)
    node.wait_until(
        lambda: "crane waits: no joint state so far names turn, reach" in node.peer.statuses["frames"][1],
        "a word of it",
    )
    half = crane.joint_state(0, 5)
    half.name, half.position = half.name[:1], half.position[:1]
    joints.publish(half)
    joints.publish(crane.joint_state(0, 5))
    joints.publish(crane.joint_state(2, 15))
    values = node.frames_status(processed=4, waiting=0)
    cloth(node, 12)
    assert node.contacts(1)[0].start.nanosec == 10
    wrong = crane.joint_state(1, 20)
    wrong.position = wrong.position[:1]
    joints.publish(wrong)
    node.frames_status(joint_states_rejected=1)
    not_finite = crane.joint_state(1, 20)
    not_finite.position[1] = float("nan")
    joints.publish(not_finite)
    node.frames_status(joint_states_rejected=2)
    cloth(node, 20)  # waits for `reach`; `turn` of that message is known
    awaited = (
        "the last position of reach is from 15 ns, before the stamp 20 ns; 'reach' is nan in the joint state of 20"
    )
    node.wait_until(lambda: awaited in node.peer.statuses["frames"][1], "joint and message")
    assert values["restarts"] == "0" and node.process.poll() is None


def test_the_clock_is_set_back(start_node):
    second = 1_000_000_000
    node = start_node({**parameters(**JOINTS), "restart_after": 2})
    describe(node)
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states")
    for k in (50, 51):
        joints.publish(crane.joint_state(k, k * second))
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k * second, frame_id="world")
        node.frames_status(processed=4 * (k - 49))
    for k in (1, 2, 3):
        joints.publish(crane.joint_state(k, k * second))
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k * second, frame_id="world")
    node.frames_status(restarts=1)
    result = node.contacts(2)[-1]
    assert (result.start.sec, result.header.stamp.sec) == (2, 3)
    options = Options(backend="cpu", rigid=RigidOptions(TOLERANCE, 64))
    assert result.hash == StepDetector(BUILDER, options).detect(frame(2), frame(3)).contacts.hash


def test_another_description_makes_another_scene(start_node):
    node = start_node({**parameters(**JOINTS), "stop_distance": 0.01, "stop_timeout": 10.0})
    node.wait_until(lambda: "robot crane waits for its description on" in node.peer.statuses["frames"][1], "who waits")
    publisher = describe(node, "<robot><link name='a'/></robot>")
    node.wait_until(
        lambda: "robot crane: geometry: no link has <collision>" in node.peer.statuses["frames"][1], "what is wrong"
    )
    assert node.peer.statuses["stop"][2]["stop"] == "True"
    publisher.publish(String(data=crane.URDF))
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the second description")
    joints = first_step(node)
    assert_result(node.contacts(1)[-1], 2)
    longer = crane.URDF.replace('"0.6 0.06 0.04"', '"0.9 0.06 0.04"')
    publisher.publish(String(data="<robot"))
    node.wait_until(
        lambda: "the previous one stays in use" in node.peer.statuses["frames"][1], "what is wrong with the second"
    )
    publisher.publish(String(data=longer))
    node.wait_until(lambda: "stays in use" not in node.peer.statuses["frames"][1], "the third description")
    robot = crane.robot(longer)
    for k in (3, 4):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
    result = node.contacts(2)[-1]
    placements = [robot.placements(robot.kinematics.state(crane.values(k), BASE)) for k in (3, 4)]
    frames = [
        SceneFrame(
            k,
            k,
            "world",
            (SHEET, *(mesh.topology for mesh in robot.meshes)),
            (sheet_positions(N, k), *(p.vertices for p in at)),
            NAMES,
            0.0,
            (None, *at),
        )
        for k, at in zip((3, 4), placements, strict=True)
    ]
    options = Options(backend="cpu", rigid=RigidOptions(TOLERANCE, 64))
    assert result.hash == StepDetector(BUILDER, options).detect(*frames).contacts.hash


def test_a_file_that_cannot_be_used_ends_the_start(start_node, tmp_path):
    file = tmp_path / "crane.urdf"
    for text, why in ((None, "no such file; correct the path"), ("<robot/>", "has no <link>")):
        if text is not None:
            file.write_text(text)
        node = start_node({**parameters(**{**JOINTS, "description": str(file)}), "autostart": False}, wait=False)
        assert not change_state(node, Transition.TRANSITION_CONFIGURE)
        assert "cannot configure: robot.crane.description: " in node.output() and why in node.output()
        for parameter, value, reason in (
            ("joint_states", "contacts", "contacts and robot.crane.joint_states: both use the topic"),
            ("joint_states", "a b", "this name cannot be used"),
            ("srdf", "~nosuchuser/crane.srdf", "no such home folder"),
        ):
            rejected = set_parameter(node, f"robot.crane.{parameter}", value)
            assert not rejected.successful and reason in rejected.reason, rejected.reason
        file.write_text(crane.URDF)  # fixed while the node runs
        for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
            assert change_state(node, transition)
        assert node.stop() == 0


def test_of_a_srdf_that_cannot_be_used_its_own_parameter_is_named(start_node, tmp_path):
    description, semantics = tmp_path / "crane.urdf", tmp_path / "crane.srdf"
    description.write_text(crane.URDF)
    semantics.write_text('<robot name="crane"><disable_collisions link1="mast"/></robot>')
    robot = {**JOINTS, "description": str(description), "srdf": str(semantics)}
    node = start_node({**parameters(**robot), "autostart": False}, wait=False)
    assert not change_state(node, Transition.TRANSITION_CONFIGURE)
    assert "robot.crane.srdf: SRDF, line 1: <disable_collisions> has no attribute link2; add it" in node.output()


def test_what_is_ignored_or_renamed_of_a_robot_is_logged_once(start_node, tmp_path):
    semantics = tmp_path / "crane.srdf"
    semantics.write_text('<robot name="crane"><disable_collisions link1="mast" link2="hok"/></robot>')
    node = start_node(parameters(**JOINTS, srdf=str(semantics)))
    renamed = crane.URDF.replace('"hook"', '"left/hook"')
    publisher = describe(node, renamed)
    first_step(node)
    assert node.contacts(1)[0].mesh_names == ["cloth", "crane/mast", "crane/boom", "crane/left_hook"]
    publisher.publish(String(data=renamed.replace('"0.6 0.06 0.04"', '"0.9 0.06 0.04"')))
    for k in (3, 4):
        cloth(node, k)
    node.wait_until(lambda: node.output().count("[WARN]") >= 2, "both warnings")
    for text in (
        "robot crane: SRDF: entries about links that are not in the URDF are ignored: <disable_collisions> in "
        "line 1 names 'hok'",
        "robot crane: URDF: in names of meshes / and : become _: link 'left/hook' is crane/left_hook",
    ):
        assert node.output().count(text) == 1


def test_pairs_name_robots_and_links(start_node):
    node = start_node(
        {
            **parameters(**JOINTS),
            "pair_separation": ["crane:cloth:0.01", "crane/hook:cloth:0.02"],
            "ignored_pairs": ["crane:crane"],
        }
    )
    describe(node)
    first_step(node)
    result = node.contacts(1)[-1]  # the description is in use
    rejected = set_parameter(node, "pair_separation", ["crane/hoek:cloth:0.02"])
    assert not rejected.successful and "'crane' has no link of this name" in rejected.reason, rejected.reason
    assert not set_parameter(node, "pair_separation", ["crane/:cloth:0.02"]).successful
    names = list(result.mesh_names)
    told = {
        (names[a], names[b]): distance
        for a, b, distance in zip(result.separation_mesh_a, result.separation_mesh_b, result.separations, strict=True)
    }
    assert {frozenset(pair): value for pair, value in told.items()} == {
        frozenset(("cloth", "crane/mast")): 0.01,
        frozenset(("cloth", "crane/boom")): 0.01,
        frozenset(("cloth", "crane/hook")): 0.02,
    }
    assert not {(names[a], names[b]) for a, b in zip(result.mesh_a, result.mesh_b, strict=True)} & {
        ("crane/mast", "crane/hook"),
        ("crane/hook", "crane/mast"),
    }


def test_frames_that_came_before_the_description_are_processed(start_node):
    node = start_node({**parameters(**JOINTS), "frame_queue": 5})
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states")
    for k in (1, 2, 3):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
    node.frames_status(waiting=3, dropped=0)
    describe(node)
    for k, result in enumerate(node.contacts(2), 2):
        assert_result(result, k)
    node.frames_status(processed=12, waiting=0, dropped=0)


def test_a_pair_that_names_no_link_is_mended_by_its_parameter(start_node):
    node = start_node({**parameters(**JOINTS), "pair_separation": ["crane/hoek:cloth:0.02"]})
    describe(node)
    node.wait_until(
        lambda: "'crane' has no link of this name" in node.peer.statuses["frames"][1], "what is wrong with the pair"
    )
    assert set_parameter(node, "pair_separation", ["crane/hook:cloth:0.02"]).successful
    node.wait_until(lambda: "no link of this name" not in node.peer.statuses["frames"][1], "the scene")
    first_step(node)
    assert node.contacts(1)[0].separations.tolist() == [0.02]


def test_the_description_in_use_that_comes_again_ends_the_complaint_about_another(start_node):
    node = start_node(parameters(**JOINTS))
    publisher = describe(node)
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the description")
    publisher.publish(String(data="<robot"))
    node.wait_until(lambda: "stays in use" in node.peer.statuses["frames"][1], "what is wrong with the second")
    publisher.publish(String(data=crane.URDF))
    node.wait_until(lambda: "stays in use" not in node.peer.statuses["frames"][1], "the first one again")


def test_a_recording_with_a_description_that_was_rejected_is_verified(start_node, tmp_path):
    path = tmp_path / "run.mcap"
    node = start_node({**parameters(**JOINTS), "record": str(path), "frame_queue": 5})
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states")
    for k in (1, 2, 3):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
    publisher = describe(node, "<robot")
    node.wait_until(lambda: "robot crane: URDF" in node.peer.statuses["frames"][1], "what is wrong")
    publisher.publish(String(data=crane.URDF))
    node.contacts(2)
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 2


def test_joint_states_that_cannot_be_used_are_told_of_before_the_robot_is_known(start_node):
    node = start_node(parameters(**JOINTS))
    joints = node.peer.publisher(JointState, "joint_states")
    short, endless = crane.joint_state(1, 1), crane.joint_state(1, 1)
    short.position = short.position[:1]
    joints.publish(short)
    values = node.frames_status(joint_states_rejected=1)
    assert (
        values["last_rejection"] == "joint_states: malformed: joint states: 2 names and 1 position; give one "
        "position for each name"
    )
    joints.publish(JointState(name=[f"j{k}" for k in range(1001)], position=[0.0] * 1001))
    values = node.frames_status(joint_states_rejected=2)
    assert "is not kept until the description of its robot comes" in values["last_rejection"]
    endless.position[1] = float("inf")  # the robot is not known yet
    joints.publish(endless)
    joints.publish(crane.joint_state(1, 1))
    publisher = describe(node)
    values = node.frames_status(joint_states_rejected=3)
    assert "'reach' is inf in the joint state of 1 ns; positions must be finite" in values["last_rejection"]
    publisher.publish(String(data=crane.URDF.replace('"0.6 0.06 0.04"', '"0.9 0.06 0.04"')))
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    cloth(node, 1)
    assert node.frames_status(processed=4)["joint_states_rejected"] == "3"


def test_a_joint_state_stamped_far_ahead_is_left_out_and_told_of(start_node, tmp_path):
    path = tmp_path / "run.mcap"
    node = start_node({**parameters(**JOINTS), "frame_queue": 5, "record": str(path)})
    describe(node)
    joints = first_step(node)
    joints.publish(crane.joint_state(20, 3_600_000_000_000))
    cloth(node, 3)
    node.frames_status(waiting=4)
    joints.publish(crane.joint_state(4, 4))
    joints.publish(crane.joint_state(5, 5))
    cloth(node, 5)
    values = node.frames_status(processed=16, dropped=0, joint_states_rejected=1)
    assert "one of stamp 3600000000000 ns came more than 10 s ahead" in values["last_rejection"]
    assert values["last_rejection"].startswith("joint_states: stamp_ahead: ") and values["restarts"] == "0"
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 3


def test_a_robot_alone_is_recorded(start_node, tmp_path):
    path = tmp_path / "run.mcap"
    node = start_node({**parameters(**JOINTS), "meshes": [""], "ignored_pairs": [""], "record": str(path)})
    describe(node)
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the description")
    publisher = node.peer.publisher(JointState, "joint_states", qos.TRANSFORMS)
    for k in range(1, 5):
        publisher.publish(crane.joint_state(k, k))
        node.frames_status(processed=3 * k)
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 3


def test_a_robot_alone_goes_on_after_its_clock_was_set_back_by_less_than_a_second(start_node, tmp_path):
    path, ms = tmp_path / "run.mcap", 1_000_000
    given = {**parameters(**JOINTS), "meshes": [""], "ignored_pairs": [""], "record": str(path), "frame_queue": 20}
    node = start_node(given)
    describe(node)
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the description")
    publisher = node.peer.publisher(JointState, "joint_states", qos.TRANSFORMS)
    for run in range(2):
        for k in range(1, 9):
            publisher.publish(crane.joint_state(k + 10 * run, (100 * k + 7 * run) * ms))
    stamps = [message.header.stamp.nanosec // ms for message in node.contacts(10)]
    assert stamps == [*range(200, 900, 100), 607, 707, 807]
    node.frames_status(processed=3 * 12, restarts=1, dropped=0, waiting=0)
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 10


@pytest.mark.parametrize("second", ["first", "second"])
def test_mesh_files_of_a_rejected_description_do_not_take_the_place_of_those_in_use(start_node, tmp_path, second):
    path = tmp_path / "run.mcap"

    def described(folder, text):
        file = tmp_path / folder / "boom.obj"
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        return crane.URDF.replace('<box size="0.6 0.06 0.04"/>', f'<mesh filename="{file}"/>')

    node = start_node({**parameters(**JOINTS), "record": str(path), "frame_queue": 5})
    publisher = describe(node, described("first", "no mesh"))
    node.wait_until(lambda: "boom.obj" in node.peer.statuses["frames"][1], "what is wrong with the first")
    boom = "v 0 0 0\nv .4 0 0\nv 0 .4 0\nv 0 0 .4\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    publisher.publish(String(data=described(second, boom) + "<!-- fixed -->"))
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the second")
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states", qos.TRANSFORMS)
    for k in (1, 2, 3):
        joints.publish(crane.joint_state(k, k))
        cloth(node, k)
        node.frames_status(processed=4 * k)
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps) == 2


@pytest.mark.parametrize(
    "robot, text",
    [
        (
            {},
            "robot.crane.joint_states: not given, so that transforms move the links; give the topic of its joint "
            "states and robot.crane.pose, where its root link stands, or set parameter frame_id",
        ),
        (
            {"joint_states": "joint_states"},
            "robot.crane.pose: not given, so that transforms place the root link; give it, or set parameter frame_id",
        ),
    ],
    ids=["nothing", "joint states"],
)
def test_a_robot_of_which_nothing_says_where_it_is_ends_the_start_with_what_it_lacks(start_node, robot, text):
    given = {"robots": ["crane"], **{f"robot.crane.{key}": value for key, value in robot.items()}}
    node = start_node(given, wait=False)
    assert node.process.wait(timeout=PATIENCE) != 0
    assert text in node.output()


def test_a_wrong_frame_prefix_is_one_line_in_the_log(start_node):
    node = start_node({**parameters(frame_prefix="left_"), "pending_frames": 2})
    describe(node)
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the description")
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    tree = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
    for k in range(1, 7):
        for message in transforms(k, "right_"):
            tree.publish(message)
        cloth(node, k)
    node.frames_status(received=24, waiting=8)
    (line,) = [line for line in node.output().splitlines() if "no_transform" in line]
    assert "crane/mast: no_transform: no transform connects 'left_mast' and 'world'" in line
    assert line.endswith("; as well crane/boom, crane/hook")


def test_a_summary_that_is_told_after_the_scene_changed_has_the_links_of_its_result(start_node):
    node = start_node({**parameters(**JOINTS), "pair_summaries": True}, program=[str(SUPPORT / "holding_node.py")])
    publisher, heard = describe(node), []
    node.peer.node.create_subscription(PairSummaryArray, client.PAIRS_TOPIC, heard.append, client.PAIRS_QOS)
    node.wait_until(lambda: node.peer.node.count_publishers(client.PAIRS_TOPIC), "publisher of pairs")
    node.wait_until(lambda: "robot crane" not in node.peer.statuses["frames"][1], "the description")
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    joints = node.peer.publisher(JointState, "joint_states", qos.TRANSFORMS)
    for k, stamp in ((1, holding_node.HANGS // 2), (2, holding_node.HANGS)):
        joints.publish(crane.joint_state(k, stamp))
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=stamp, frame_id="world")
        node.frames_status(received=4 * k)
    publisher.publish(String(data=crane.URDF.replace('"boom"', '"jib"')))
    node.wait_until(lambda: heard, "a summary")
    assert ("cloth", "crane/boom") in {(pair.mesh_a, pair.mesh_b) for pair in heard[0].pairs}
    assert node.contacts(1)[0].mesh_names == ["cloth", *crane.LINKS]
    assert node.peer.statuses["errors"][2]["errors"] == "0"


@pytest.mark.parametrize("alone", [True, False])
def test_joint_states_of_another_robot_are_one_warning(start_node, alone):
    scene = {"meshes": [""], "ignored_pairs": [""]} if alone else {}
    node = start_node({**parameters(**JOINTS), **scene})
    describe(node)
    joints = node.peer.publisher(JointState, "joint_states")
    if not alone:
        node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    stamps = itertools.count(1)

    def told():
        message = crane.joint_state(0, stamp := next(stamps))
        message.name = [f"left_{name}" for name in message.name]
        joints.publish(message)
        if not alone:
            cloth(node, stamp)
        return "no message names a joint of the robot" in node.peer.statuses["frames"][1]

    node.wait_until(told, "the warning")
    text = node.peer.statuses["frames"][1]
    assert "crane waits" not in text and "no frame yet" not in text


@pytest.mark.parametrize("by", ["tf", "joints"])
def test_a_robot_alone_says_what_it_waits_for(start_node, by):
    robot = {"frame_prefix": "left_"} if by == "tf" else JOINTS
    node = start_node({**parameters(**robot), "meshes": [""], "ignored_pairs": [""]})
    describe(node)
    if by == "tf":
        tree = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
        for message in transforms(1, "right_"):
            tree.publish(message)
        awaited = "no frame yet: no transform connects 'left_mast' and 'world'; received: "
    else:
        joints = node.peer.publisher(JointState, "joint_states")
        joints.publish(JointState(name=["turn"], position=[0.0]))
        awaited = "no frame yet: crane: no joint state so far names reach; the last one names turn"
    node.wait_until(lambda: awaited in node.peer.statuses["frames"][1], "a word of it")
    for k in (1, 2):
        for message in [crane.joint_state(k, k)] if by == "joints" else transforms(k, "left_"):
            (joints if by == "joints" else tree).publish(message)
        node.frames_status(processed=3 * k)
    node.wait_until(lambda: "no frame yet" not in node.peer.statuses["frames"][1], "no more of it")
