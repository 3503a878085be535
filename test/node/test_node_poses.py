# SPDX-License-Identifier: Apache-2.0
"""Meshes that move by poses beside a cloth: streamed as PoseStamped or by transforms, recorded and computed again."""

import time

import numpy as np
import pytest
from bag_tools import replayed
from geometry_msgs.msg import PoseStamped, TransformStamped
from node_calls import set_parameter
from waving_sheet import sheet_faces, sheet_positions

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.transform import Rigid
from hpccd_ros import client
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.rigid_step import RigidOptions
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, Placement, SceneFrame, Topology
from hpccd_ros.middleware import contact_messages, fields, qos
from hpccd_ros.params import scene_parameters, values
from hpccd_ros.params.values import ParameterError

N = 8
SHEET = Topology(0, N * N, sheet_faces(N))
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.4, 0.05, 0.02]
BLADE = Topology(
    0,
    8,
    np.array(
        [
            [0, 1, 3],
            [0, 3, 2],
            [4, 6, 7],
            [4, 7, 5],
            [0, 4, 5],
            [0, 5, 1],
            [2, 3, 7],
            [2, 7, 6],
            [0, 2, 6],
            [0, 6, 4],
            [1, 5, 7],
            [1, 7, 3],
        ],
        np.uint32,
    ),
)
BODY = Body.of(CORNERS.astype(np.float32))
NAMES = ("cloth", "blade")
TOLERANCE = 0.002


def pose(k):
    """A blade that turns about the middle of the cloth, by 0.8 from frame to frame, and rocks."""
    half = 0.4 * k
    turn = np.array([0.1 * np.sin(k), 0.1, np.sin(half), np.cos(half)])
    return Rigid.of((0.17, 0.5, 0.05 * np.cos(k)), turn / np.linalg.norm(turn))


def placed(message, k, place, turn):
    at = pose(k)
    message.header.stamp, message.header.frame_id = fields.ns_to_stamp(k), "world"
    place.x, place.y, place.z = at.shift.tolist()
    turn.x, turn.y, turn.z, turn.w = at.quaternion.tolist()
    return message


def stamped(k):
    message = PoseStamped()
    return placed(message, k, message.pose.position, message.pose.orientation)


def transform(k):
    message = TransformStamped(child_frame_id="blade_link")
    return placed(message, k, message.transform.translation, message.transform.rotation)


def frame(k):
    at = Rigid.of(pose(k).shift, pose(k).quaternion)  # normalised again, as what is received
    placement = Placement(BODY, at)
    vertices = (sheet_positions(N, k), placement.vertices)
    return SceneFrame(k, k, "world", (SHEET, BLADE), vertices, NAMES, 0.0, (None, placement))


def assert_result(message, k, tolerance=TOLERANCE, most=64):
    """The node's result to the step that ends with frame k is that of the parts it is made of; how many contacts."""
    meshes = (MeshSettings("cloth"), MeshSettings("blade", self_collision=False, input="pose"))
    options = Options(backend="cpu", outputs=("normals", "weights"), rigid=RigidOptions(tolerance, most))
    expected = StepDetector(SceneBuilder(meshes), options).detect(frame(k - 1), frame(k))
    got = contact_messages.read_contacts(message, Layout.of(NAMES, (SHEET, BLADE)))
    for name in ("vf", "ee", "vf_toc", "ee_toc", *expected.contacts.outputs):
        assert np.array_equal(getattr(got, name), getattr(expected.contacts, name)), name
    assert message.hash == expected.contacts.hash
    arrays = client.contacts_from_message(message)
    assert arrays.parts == expected.bounds.parts
    assert tuple(arrays.motion_bounds.tolist()) == expected.bounds.of_meshes
    return message.total


def give_shape(node):
    node.peer.topology("blade", BLADE.faces, BLADE.n_vertices)
    node.peer.vertices("blade", CORNERS.astype(np.float32), stamp=0)


def verified_steps(path):
    replay, steps = replayed(path)
    assert replay.diverged == replay.unverified == 0 and replay.verified == len(steps)
    return steps


@pytest.mark.parametrize("by", ["pose", "tf"])
def test_streamed_recorded_and_verified(start_node, tmp_path, by):
    path = tmp_path / "run.mcap"
    node = start_node(
        {
            "meshes": list(NAMES),
            "frame_id": "world",
            "mesh.blade.input": by,
            "record": str(path),
            "mesh.blade.frame": "blade_link" if by == "tf" else "",
            "rigid_tolerance": TOLERANCE,
            "outputs": ["normals", "weights"],
        }
    )
    node.peer.topology("cloth", SHEET.faces, SHEET.n_vertices)
    give_shape(node)
    node.frames_status(processed=1)  # the shape
    kind, topic = (PoseStamped, client.pose_topic("blade")) if by == "pose" else (TransformStamped, "transforms")
    publisher = node.peer.publisher(kind, topic, qos.vertices("reliable", 100) if by == "pose" else qos.TRANSFORMS)
    total, parts = 0, set()
    for k in range(1, 9):
        publisher.publish(stamped(k) if by == "pose" else transform(k))
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k, frame_id="world")
        node.frames_status(processed=1 + 2 * k)
        if k > 1:
            result = node.contacts(k - 1)[-1]
            total += assert_result(result, k)
            parts.add(result.parts)
    assert total > 100 and min(parts) > 1
    with pytest.raises(ValueError, match=f"toc_gradients: the step was computed in {result.parts} parts; with rigid_"):
        client.contacts_from_message(result).toc_gradients()
    assert set_parameter(node, "rigid_tolerance", 0.05).successful
    publisher.publish(stamped(9) if by == "pose" else transform(9))
    node.peer.vertices("cloth", sheet_positions(N, 9), stamp=9, frame_id="world")
    coarse = node.contacts(8)[-1]
    assert assert_result(coarse, 9, 0.05) > 0 and coarse.parts < min(parts)
    status = node.wait_until(lambda: node.peer.statuses["detection"][2].get("parts"), "parts in the status")
    assert int(status) >= 1
    assert set_parameter(node, "rigid_tolerance", 1e-9).successful
    publisher.publish(stamped(10) if by == "pose" else transform(10))
    node.peer.vertices("cloth", sheet_positions(N, 10), stamp=10, frame_id="world")
    assert assert_result(node.contacts(9)[-1], 10, 1e-9) > 0
    warned = "1 step with a motion beyond rigid_tolerance: blade was up to "
    node.wait_until(lambda: node.peer.statuses["detection"][1].startswith(warned), warned)
    assert node.peer.statuses["detection"][2]["coarse"] == "1"
    assert node.stop() == 0
    steps = verified_steps(path)
    assert [step.bounds.parts for step in steps][-2:] == [coarse.parts, 64] and len(steps) == 9


def test_what_is_wrong_with_poses_is_rejected_and_said(start_node):
    node = start_node({"meshes": ["blade"], "mesh.blade.input": "pose"})
    publisher = node.peer.publisher(PoseStamped, client.pose_topic("blade"))
    publisher.publish(stamped(1))
    node.frames_status(dropped__no_shape=1)
    give_shape(node)
    node.frames_status(processed=1)
    wrong = stamped(2)
    wrong.pose.orientation.w = 3.0
    not_finite = stamped(3)
    not_finite.pose.position.y = float("nan")
    far = stamped(4)
    far.pose.position.z = 1e200
    for message in (wrong, not_finite, far):
        publisher.publish(message)
    node.frames_status(dropped__malformed=2, dropped__out_of_range=1)
    for k in (5, 6):
        publisher.publish(stamped(k))
    assert node.contacts(1)[-1].parts >= 1
    assert node.process.poll() is None


def test_each_file_of_a_split_recording_has_the_shape(start_node, tmp_path):
    folder = tmp_path / "run"
    given = {"meshes": ["blade", "floor"], "mesh.blade.input": "pose", "mesh.floor.static": True}
    node = start_node({**given, "record": str(folder), "record_split_time": 0.1, "frame_queue": 8})
    give_shape(node)
    node.peer.topology("floor", np.array([[0, 1, 2]]), 3)
    node.peer.vertices("floor", np.array([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], np.float32), stamp=0)
    node.frames_status(processed=2)
    publisher = node.peer.publisher(PoseStamped, client.pose_topic("blade"))
    for k in range(1, 9):
        for part in (0, 1):  # a split falls between two frames here and there: never between all of them
            publisher.publish(stamped(2 * k + part))
        node.frames_status(processed=2 + 2 * k)
        time.sleep(0.1)
    assert node.stop() == 0
    files = sorted(folder.glob("*.mcap"))
    assert len(files) > 2 and len(verified_steps(folder)) == 15
    verified = 0
    for file in files:
        replay, _ = replayed(file)
        assert not replay.diverged and not any(counter.total for counter in replay.source.rejected.values())
        verified += replay.verified
    assert verified > 2


def test_transforms_alone(start_node):
    """A robot by itself: a frame for each time that all of its links have reached."""
    meshes = {"meshes": ["blade", "knife"], "frame_id": "world"}
    for name in meshes["meshes"]:
        meshes |= {f"mesh.{name}.input": "tf", f"mesh.{name}.frame": f"{name}_link"}
    node = start_node(meshes)
    for name in ("blade", "knife"):
        node.peer.topology(name, BLADE.faces, BLADE.n_vertices)
        node.peer.vertices(name, CORNERS.astype(np.float32), stamp=0)
    node.frames_status(processed=2)
    publisher = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
    for k in range(1, 4):
        for name, turned in (("blade", 1), ("knife", -1)):
            message = transform(k * turned)
            message.header.stamp, message.child_frame_id = fields.ns_to_stamp(k), f"{name}_link"
            publisher.publish(message)
        node.frames_status(processed=2 + 2 * k, received__blade=1 + k)
    assert node.contacts(2)[-1].total > 0


def checked(**given):
    settings, meshes = values.checked({"meshes": ["blade"], **given})
    scene_parameters.check(settings, meshes)


@pytest.mark.parametrize(
    "given, text",
    [
        ({"mesh.blade.input": "pose", "mesh.blade.static": True}, "leave one out"),
        ({"mesh.blade.input": "pose", "mesh.blade.transform": "pose"}, "mesh.blade.transform: pose is for vertices"),
        ({"mesh.blade.input": "tf", "mesh.blade.frame": "link"}, "set parameter frame_id"),
        ({"mesh.blade.input": "tf", "frame_id": "world"}, "set mesh.blade.frame"),
        ({"rigid_tolerance": 0.0}, "rigid_tolerance"),
        ({"rigid_parts": 0}, "rigid_parts"),
    ],
)
def test_parameters_that_contradict(given, text):
    with pytest.raises(ParameterError, match=text):
        checked(**given)
    checked(**{"mesh.blade.input": "tf", "mesh.blade.frame": "link", "frame_id": "world"})


def test_a_recording_that_missed_the_shape_says_what_to_do(start_node, tmp_path, hpccd):
    path = tmp_path / "run.mcap"
    node = start_node({"meshes": ["blade"], "mesh.blade.input": "pose"})
    give_shape(node)
    node.frames_status(processed=1)
    assert set_parameter(node, "record", str(path)).successful
    node.peer.readers = 2
    publisher = node.peer.publisher(PoseStamped, client.pose_topic("blade"))
    for k in range(1, 4):
        publisher.publish(stamped(k))
        node.frames_status(processed=1 + k)
    missing = "the shape of mesh blade is not in the recording (nothing came on meshes/blade/vertices), so no replay"
    node.wait_until(lambda: node.peer.statuses["recording"][1].startswith(missing), "the shape to be missed")
    assert node.stop() == 0
    assert f": {path}; {missing}" in node.output()
    done = hpccd("replay", str(path))
    assert done.returncode == 1 and "no_shape; the recording has no shape of it" in done.stdout, done.stdout
    done = hpccd("view", str(path))
    assert done.returncode == 2 and "no step to show: it has none of all meshes" in done.stderr, done.stderr
