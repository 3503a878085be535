# SPDX-License-Identifier: Apache-2.0
"""Meshes in frames of their own, brought into the scene's frame by the node where it is told to."""

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from lifecycle_msgs.msg import Transition
from mesh_in_a_hand import FACES, HAND, SCENE, SECOND, parts, topologies, transform
from node_calls import change_state, set_parameter
from node_process import assert_same_contacts
from waving_sheet import scene_of

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.middleware import qos, transform_topics


def send(node, k, frame_id):
    cloth, _, local = parts(k)
    node.peer.vertices("cloth", cloth, k * SECOND, frame_id="world")
    node.peer.vertices("net", local, k * SECOND, frame_id=frame_id)


def check(message, k, rigid=HAND):
    placed = [np.concatenate([parts(s)[0], rigid.apply(parts(s)[2])]) for s in (k - 1, k)]
    assert message.header.frame_id == "world"
    assert assert_same_contacts(message, *placed, scene_of(cloth=FACES, net=FACES)) > 0


def test_pose_of_a_stream(start_node):
    pose = [*HAND.shift.tolist(), *HAND.quaternion.tolist()]
    net = {"transform": "pose", "pose": pose, "frame": "hand"}
    node = start_node({**SCENE, "mesh": {"net": net}})
    topologies(node)
    for k in range(2):
        send(node, k, "hand")
        node.frames_status(processed=2 * k + 2)
    check(node.contacts(1)[0], 1)
    node.peer.vertices("net", parts(2)[2], 2 * SECOND, frame_id="foot")
    values = node.frames_status(dropped__net__frame_id=1)
    assert "mesh.net.frame requires 'hand'" in values["last_rejection"]


def test_pose_of_integers(start_node):
    """As YAML gives numbers without a point, at the start and at run time."""
    net = {"transform": "pose", "pose": [0, 0, 1, 0, 0, 0, 1], "frame": "hand"}
    node = start_node({**SCENE, "mesh": {"net": net}, "minimum_separation": 0, "autostart": False}, wait=False)
    assert set_parameter(node, "mesh.net.pose", [1, 0, 0, 0, 0, 0, 1]).successful
    assert set_parameter(node, "minimum_separation", 1).successful
    assert set_parameter(node, "minimum_separation", 0).successful
    rejected = set_parameter(node, "minimum_separation", -1)
    assert not rejected.successful and "range" in rejected.reason
    rejected = set_parameter(node, "mesh.net.pose", [1, 0, 0, 0, 0, 0, 0])
    assert not rejected.successful and "mesh.net.pose: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]" in rejected.reason
    rejected = set_parameter(node, "threads", 1.0)
    assert not rejected.successful and "threads: expected int, got float" in rejected.reason
    assert change_state(node, Transition.TRANSITION_CONFIGURE) and change_state(node, Transition.TRANSITION_ACTIVATE)
    topologies(node)
    for k in range(2):
        send(node, k, "hand")
        node.frames_status(processed=2 * k + 2)
    check(node.contacts(1)[0], 1, Rigid.of((1, 0, 0), (0, 0, 0, 1)))


def through_topics(node, publish, publish_static, k):
    """Frame k and its transform, in an order that must not matter."""
    if k == 0:
        publish_static(transform("world", "arm", Rigid.of((0, 0, 0), (0, 0, 0, 1))))
    if k % 2:
        publish(transform("arm", "hand", HAND, k * SECOND))
        send(node, k, "hand")
    else:
        send(node, k, "hand")
        publish(transform("arm", "hand", HAND, k * SECOND))
    node.frames_status(processed=2 * k + 2, waiting=0)


def test_transforms_of_geometry_msgs(start_node):
    node = start_node({**SCENE, "pending_frames": 2, "mesh": {"net": {"transform": "tf"}}})
    topologies(node)
    publisher = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
    static = node.peer.publisher(TransformStamped, "transforms_static", qos.TRANSFORMS_STATIC)
    for k in range(4):
        through_topics(node, publisher.publish, static.publish, k)
    for k, message in enumerate(node.contacts(3), start=1):
        check(message, k)
    # A frame without its transform waits, says so, and gives way where too many wait.
    for k in (4, 5, 6):
        node.peer.vertices("net", parts(k)[2], k * SECOND, frame_id="hand")
    values = node.frames_status(dropped__net__no_transform=1, waiting=2)
    assert "before the stamp 4000000000 ns" in values["last_rejection"]
    node.wait_until(lambda: "net waits for a transform" in node.peer.statuses["frames"][1], "warning")
    node.peer.vertices("net", parts(7)[2], 7 * SECOND)
    values = node.frames_status(dropped__net__frame_id=1)
    assert "frame_id is empty" in values["last_rejection"]
    publisher.publish(transform("arm", "hand", Rigid(HAND.quaternion * 2, HAND.shift), 9 * SECOND))
    node.frames_status(transforms_rejected=1)
    assert "it must be 1" in node.output()


def test_who_waits_for_a_transform_is_told_what_came(start_node):
    """Here nobody publishes at first, and then without the prefix that the mesh's frame has."""
    node = start_node({**SCENE, "pending_frames": 1, "mesh": {"net": {"transform": "tf", "frame": "left/hand"}}})
    topologies(node)

    def told(*texts):
        node.wait_until(lambda: all(text in node.peer.statuses["frames"][1] for text in texts), str(texts))

    send(node, 0, "left/hand")
    without_tf2 = (
        "not understood (tf2_msgs is not installed; geometry_msgs/TransformStamped on "
        f"{node.namespace}/transforms works without it)"
    )
    told(
        "net waits for a transform: no transform connects 'left/hand' and 'world'; received: ",
        "/transforms no messages",
        "/transforms_static no messages",
        f"/tf {'no messages' if len(transform_topics.understood()) == 4 else without_tf2}",
        "/tf_static ",
        "; frames known: none",
    )
    publisher = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
    for parent, child in (("world", "base"), ("base", "hand")):
        publisher.publish(transform(parent, child, HAND, SECOND))
    told("/transforms 2 messages", "/transforms_static no messages", "; frames known: hand, base, world")
    send(node, 1, "left/hand")
    values = node.frames_status(dropped__net__no_transform=1)
    assert "/transforms 2 messages" in values["last_rejection"]


def test_transforms_of_tf2(start_node):
    """As robot_state_publisher sends them; the package tf2_msgs is no wheel."""
    tf2 = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not installed: /tf is not understood")
    node = start_node({**SCENE, "mesh": {"net": {"transform": "tf", "frame": "hand"}}})
    topologies(node)
    publisher = node.peer.publisher(tf2.TFMessage, "/tf", qos.TRANSFORMS)
    static = node.peer.publisher(tf2.TFMessage, "/tf_static", qos.TRANSFORMS_STATIC)
    for k in range(4):
        through_topics(
            node,
            lambda message: publisher.publish(tf2.TFMessage(transforms=[message])),
            lambda message: static.publish(tf2.TFMessage(transforms=[message])),
            k,
        )
    for k, message in enumerate(node.contacts(3), start=1):
        check(message, k)
