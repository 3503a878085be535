# SPDX-License-Identifier: Apache-2.0
"""Parameters qos_overrides.*: in force on every topic of the node and in its recording; nonsense is rejected, told."""

import re
import subprocess
import sys
import time

import pytest
from hpccd.msg import ContactArray, MeshVertices
from lifecycle_msgs.msg import Transition
from node_calls import call, change_state, set_parameter
from node_process import PATIENCE
from rcl_interfaces.srv import GetParameters
from rclpy.qos import ReliabilityPolicy
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import qos

N = 8
BEST_EFFORT = {"reliability": "best_effort"}
TOPICS = {
    "contacts": "publisher",
    "markers": "publisher",
    "surface": "publisher",
    "meshes/cloth/topology": "subscription",
    "meshes/cloth/vertices": "subscription",
    "transforms": "subscription",
    "transforms_static": "subscription",
}


def endpoint(node, topic):
    """The node's own publisher or subscription on a topic, as the graph shows it; None while it does not."""
    peer, name = node.peer.node, f"{node.namespace}/{topic}"
    infos = peer.get_publishers_info_by_topic(name) + peer.get_subscriptions_info_by_topic(name)
    return next((info for info in infos if info.node_name == "hpccd"), None)


def overrides(topics):
    return {f"NAMESPACE/{topic}": {entity: dict(BEST_EFFORT)} for topic, entity in topics.items()}


def test_overrides_are_in_force_on_every_topic(start_node, tmp_path):
    bag = tmp_path / "run.mcap"
    node = start_node(
        {
            "meshes": ["cloth"],
            "mesh": {"cloth": {"transform": "tf"}},
            "frame_id": "world",
            "record": str(bag),
            "qos_overrides": {
                **overrides(TOPICS),
                "NAMESPACE/diagnostics": {"publisher": dict(BEST_EFFORT)},
                "NAMESPACE/contacts ": {"publisher": dict(BEST_EFFORT)},
                "NAMESPACE/nothing": {"subscription": {"depth": 5}},
            },
        },
        wait=False,
    )
    for topic in (*TOPICS, "diagnostics"):
        info = node.wait_until(lambda topic=topic: endpoint(node, topic), f"endpoint on {topic}")
        assert info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT, topic
    output = node.output()
    assert output.count(" is unknown and has no effect") == 2
    assert f"parameter qos_overrides.{node.namespace}/nothing.subscription.depth is unknown" in output
    name = f"qos_overrides.{node.namespace}/contacts.publisher.reliability"
    response = call(node, GetParameters, "get_parameters", GetParameters.Request(names=[name]))
    assert response.values[0].string_value == "best_effort"
    assert not set_parameter(node, name, "reliable").successful, "read at the start"


def frames_received(node):
    """As its last diagnostics say."""
    return int(node.peer.statuses.get("frames", (b"", "", {}))[2].get("received.cloth", 0))


def test_the_recording_hears_what_the_node_hears(start_node, tmp_path):
    topics = {topic: TOPICS[topic] for topic in ("contacts", "meshes/cloth/vertices")}
    bag = tmp_path / "run.mcap"
    node = start_node({"meshes": ["cloth"], "record": str(bag), "qos_overrides": overrides(topics)}, wait=False)
    contacts = f"{node.namespace}/contacts"
    best_effort = qos.vertices("best_effort", 100)
    heard = []
    node.peer.node.create_subscription(ContactArray, contacts, heard.append, best_effort)
    node.peer.topology("cloth", sheet_faces(N), N * N)
    node.peer.publisher(MeshVertices, "meshes/cloth/vertices", best_effort)
    # Messages sent at best effort before the node has found their publisher are lost without notice.
    while not frames_received(node):
        node.peer.vertices("cloth", sheet_positions(N, 0), 0)
        again = time.monotonic() + 2.0
        node.wait_until(lambda again=again: frames_received(node) or time.monotonic() > again, "the first frame")
    for k in range(1, 4):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
        node.wait_until(lambda k=k: len(heard) >= k, f"response {k}")
    assert node.stop() == 0
    recorded = int(re.search(r"recorded ([\d,]+) messages", node.output())[1].replace(",", ""))
    assert recorded >= 8, "a topology, four frames, three responses"
    done = subprocess.run(
        [sys.executable, "-m", "hpccd_ros.cli", "replay", str(bag)], capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_after_a_clean_up_what_is_not_overridden_follows_its_parameter(start_node):
    topics = {"meshes/cloth/topology": "subscription"}
    node = start_node({"meshes": ["cloth"], "qos_overrides": overrides(topics)})
    assert change_state(node, Transition.TRANSITION_DEACTIVATE) and change_state(node, Transition.TRANSITION_CLEANUP)
    assert set_parameter(node, "input_reliability", "best_effort").successful
    assert change_state(node, Transition.TRANSITION_CONFIGURE) and change_state(node, Transition.TRANSITION_ACTIVATE)
    for topic in ("meshes/cloth/topology", "meshes/cloth/vertices"):
        info = node.wait_until(lambda topic=topic: endpoint(node, topic), f"endpoint on {topic}")
        assert info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT, topic


@pytest.mark.parametrize(
    "policy, value, text",
    [
        ("depth", 0, "0 is not valid; use a whole number of 1 .. 100,000"),
        ("depth", 2**40, "is not valid; use a whole number"),
        ("depth", "deep", "deep is not valid; use a whole number"),
        ("depth", True, "True is not valid; use a whole number"),
        ("reliability", "unknown", "'unknown' is not valid; use one of reliable, best_effort"),
        ("reliability", 5, "5 is not valid; use one of reliable"),
        ("history", "keep_some", "'keep_some' is not valid; use one of keep_last, keep_all"),
    ],
)
def test_nonsense_is_rejected(start_node, policy, value, text):
    node = start_node({"qos_overrides": {"/contacts": {"publisher": {policy: value}}}}, wait=False)
    assert node.process.wait(timeout=PATIENCE) == 2
    assert f"hpccd: qos_overrides./contacts.publisher.{policy}: " in node.output() and text in node.output()
