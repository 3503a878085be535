# SPDX-License-Identifier: Apache-2.0
"""Publishers that offer less than the node requests: DDS does not connect them, and the node says what to set."""

import time

import pytest
from geometry_msgs.msg import TransformStamped
from hpccd.msg import MeshTopology, MeshVertices
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from hpccd_ros.middleware import qos

LATCHED = (
    "let the publisher offer transient_local (latched): otherwise messages sent before the node listened would "
    "be missing"
)
# Topic -> its type, what a publisher offers (reliable, latched), and the expected warning.
LESS = {
    "meshes/cloth/topology": (
        MeshTopology,
        (True, False),
        f"offers volatile but the node requests transient_local, so none of its messages are received; {LATCHED}",
    ),
    "meshes/cloth/vertices": (
        MeshVertices,
        (False, False),
        "offers best_effort but the node requests reliable, so "
        "none of its messages are received; set input_reliability: best_effort, or let the "
        "publisher offer reliable",
    ),
    "transforms": (
        TransformStamped,
        (False, False),
        "set qos_overrides.NAMESPACE/transforms.subscription.reliability: "
        "best_effort, or let the publisher offer reliable",
    ),
    "transforms_static": (TransformStamped, (True, False), LATCHED),
    "joint_states": (
        JointState,
        (False, False),
        "set input_reliability: best_effort, or let the publisher offer reliable",
    ),
    "left/joint_states": (
        JointState,
        (False, False),
        "set qos_overrides.NAMESPACE/left/joint_states.subscription.reliability: best_effort, or let",
    ),
    "robot_description": (
        String,
        (False, False),
        "offers best_effort and volatile but the node requests reliable and "
        "transient_local, so none of its messages are received; let the publisher offer reliable "
        "and transient_local",
    ),
}
ROBOTS = {
    "robots": ["arm", "left"],
    "robot.arm.description": "robot_description",
    "robot.left.description": "robot_description",
    "robot.arm.joint_states": "joint_states",
    "robot.left.joint_states": "left/joint_states",
}


@pytest.fixture
def node(start_node):
    return start_node(
        {
            "meshes": ["cloth"],
            "mesh.cloth.transform": "tf",
            "frame_id": "world",
            **ROBOTS,
            "qos_overrides.NAMESPACE/left/joint_states.subscription.reliability": "reliable",
        }
    )


def _message(node):
    return node.peer.statuses["frames"][1]


def test_each_input_names_topic_offer_request_and_remedy(node):
    publishers = []
    for topic, (kind, (reliable, latched), _) in LESS.items():
        profile = qos.keep_last(1, reliable=reliable, latched=latched)
        publishers.append(node.peer.node.create_publisher(kind, topic, profile))
    name = f"a publisher of node {node.namespace}/peer offers "
    for topic, (_, _, words) in LESS.items():
        said = f"{node.namespace}/{topic}: {name}"
        words = words.replace("NAMESPACE", node.namespace)
        node.wait_until(lambda s=said, w=words: s in _message(node) and w in _message(node), f"{said}... {words}")
        values = node.peer.statuses["frames"][2]
        assert values.get(f"qos_incompatible.{topic}") == "1" or topic == "robot_description", values
        node.wait_until(
            lambda s=said, w=words: any(s in line and w in line for line in node.output().splitlines()), "the log"
        )
    assert _message(node).count("robot_description: a publisher") == 1, "of two robots, the same"
    time.sleep(2.5)
    for topic in LESS:
        assert node.output().count(f"{node.namespace}/{topic}: {name}") == 1, "once, not at each look"
    for publisher in publishers:
        node.peer.node.destroy_publisher(publisher)
    node.wait_until(lambda: name not in _message(node), "the end of the warnings")


def test_a_node_whose_name_begins_with_an_underscore_is_named(node):
    """As those of `ros2 topic pub` do."""
    hidden = Node("_hidden", namespace=node.namespace, context=node.peer.context)
    hidden.create_publisher(MeshVertices, "meshes/cloth/vertices", qos.keep_last(1, reliable=False))
    said = f"a publisher of node {node.namespace}/_hidden offers best_effort"
    node.wait_until(lambda: said in _message(node), said)
    hidden.destroy_node()


def test_a_publisher_that_offers_more_is_heard(node):
    for topic, (kind, _, _) in LESS.items():
        node.peer.publisher(kind, topic, qos.keep_last(1, latched=True))
    node.frames_status()
    assert ": a publisher " not in _message(node) and "qos_incompatible" not in str(node.peer.statuses["frames"])
