# SPDX-License-Identifier: Apache-2.0
"""`hpccd status` of real nodes."""

import json
import os
import subprocess
import sys
import threading

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hpccd.srv import Detect
from rclpy.node import Node
from sensor_msgs.msg import JointState
from sources import SOURCES
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import fields

N = 8
# s, until a node is discovered, which takes seconds on a busy machine.
WAITS = (2, 10, 30)
URDF = """<robot name="arm"><link name="base"/>
<link name="upper"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/></joint></robot>"""


@pytest.fixture
def empty_domain(monkeypatch):
    """A ROS_DOMAIN_ID that the tests do not use otherwise."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "101")
    return 101


def of(done):
    """The one node in the JSON that was printed."""
    (found,) = json.loads(done.stdout)
    return found


def test_a_node_with_results(start_node, hpccd):
    node = start_node({"meshes": ["cloth", "floor"], "mesh.floor.static": True, "stop_distance": 0.0})
    for mesh in ("cloth", "floor"):
        node.peer.topology(mesh, sheet_faces(N), N * N)
    node.peer.vertices("floor", sheet_positions(N, 0) - [0, 0, 5], 0)
    node.frames_status(processed=1)
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), 1_500_000_000 + k)
        node.contacts(k)
    name = f"{node.namespace}/hpccd"
    shown = hpccd("status", name)
    lines = shown.stdout.splitlines()
    assert lines[0] == f"{name}: active"
    assert any(
        line.startswith("  cloth  ") and "last stamp 1.500000002 s, 3 messages received" in line for line in lines
    ), shown.stdout
    assert any(line.startswith("  floor  static, last stamp 0.000000000 s, 1 message received") for line in lines)
    assert any(line.startswith("  results: ") and " 2 in all; latency " in line for line in lines)
    assert any(line.startswith("  stop: ") for line in lines)
    found = of(hpccd("status", name, "--json"))
    assert (found["state"], found["results"], found["dropped"]) == ("active", 2, 0)
    assert found["meshes"]["cloth"]["last_stamp_ns"] == 1_500_000_002
    assert found["meshes"]["floor"]["static"] and found["stop"]["text"].startswith(("true: ", "false: "))


def test_what_is_wrong_is_said(start_node, hpccd):
    node = start_node({"meshes": ["cloth"], "pending_frames": 1})
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
    node.peer.vertices("clot", sheet_positions(N, 0), 0)
    node.wait_until(lambda: "clot/vertices" in node.peer.statuses["frames"][1], "the warning")
    done = hpccd("status", node.namespace.lstrip("/") + "/hpccd")
    assert done.returncode == 1, done.stdout
    assert "  dropped: " in done.stdout and "no_topology " in done.stdout
    assert "  last rejection: cloth: no_topology: topology" in done.stdout
    assert f"  wrong: {node.namespace}/meshes/clot/vertices belongs to no mesh" in done.stdout


def test_a_node_that_is_not_configured(start_node, hpccd):
    node = start_node({"meshes": ["cloth"], "autostart": False}, wait=False)
    done = hpccd("status", "--wait", "60", f"{node.namespace}/hpccd")
    assert done.returncode == 1 and f"{node.namespace}/hpccd: unconfigured\n" in done.stdout
    assert (
        "  wrong: the node is unconfigured, so it detects nothing; run hpccd lifecycle configure, then activate"
        in done.stdout
    )
    everywhere = hpccd("status", "--json")
    assert f"{node.namespace}/hpccd" in [one["node"] for one in json.loads(everywhere.stdout)]


def test_no_node(hpccd, empty_domain):
    done = hpccd("status", "--wait", "0.3")
    assert done.returncode == 2 and done.stdout == ""
    assert "no hpccd node found on ROS_DOMAIN_ID 101 (no other node is running); start one (hpccd_node" in done.stderr
    assert "set ROS_DOMAIN_ID to that of the node, and ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET" in done.stderr


ENDING = """
import rclpy
from hpccd.srv import Detect
from rclpy.node import Node
from hpccd_ros.introspection import peer
from hpccd_ros.middleware import environment, graph

environment.prepare()
context = rclpy.Context()
rclpy.init(context=context)
ending = rclpy.create_node("ending", context=context)
ending.create_service(Detect, "detect", lambda request, response: response)

class Signals(list):
    def __bool__(self):  # at each look
        if context.ok() and graph.detects(node, "ending", "/"):
            ending.destroy_node()
            context.shutdown()
            print("found")
        return False

with peer.peer("status") as (node, _):
    peer.hpccd_nodes(node, 1.0, Signals())
"""


def test_a_node_that_ends_while_it_is_looked_for(empty_domain):
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    done = subprocess.run([sys.executable, "-c", ENDING], capture_output=True, text=True, env=environment, timeout=60)
    assert done.stdout == "found\n" and "UserError: no hpccd node found on ROS_DOMAIN_ID 101" in done.stderr


def test_a_wrong_name_of_a_node(start_node, hpccd):
    node = start_node({"meshes": ["cloth"]})
    for wait in WAITS:
        done = hpccd("status", f"{node.namespace}/hpcd", "--wait", str(wait))
        if "did you mean" in done.stderr:
            break
    assert done.returncode == 2
    assert f"no node {node.namespace}/hpcd found on ROS_DOMAIN_ID {os.environ['ROS_DOMAIN_ID']}" in done.stderr
    assert f"did you mean {node.namespace}/hpccd?" in done.stderr


@pytest.mark.parametrize("command", [("status",), ("lifecycle", "get")])
def test_a_node_that_is_none_of_ours(start_node, hpccd, command):
    other = f"{start_node({'meshes': ['cloth']}).namespace}/peer"
    for wait in WAITS:
        done = hpccd(*command, "--node", other, "--wait", str(wait))
        if f"no node {other} found" not in done.stderr:
            break
    assert done.returncode == 2
    assert done.stderr.endswith(
        f": node {other}: it offers no services of an hpccd node; name another, or wait longer (--wait)\n"
    )


@pytest.mark.parametrize("values", [{}, {"rate_hz.cloth": "fast", "cause": ""}])
def test_diagnostics_of_another_version(start_node, hpccd, values):
    node = start_node({"meshes": ["cloth"], "diagnostics_period": 60.0}, wait=False)  # the only diagnostics are ours
    name = f"{node.namespace}/hpccd"
    node.wait_until(lambda: "active: " in node.output(), "its start")
    entries = [KeyValue(key=key, value=value) for key, value in values.items()]
    message = DiagnosticArray(
        status=[DiagnosticStatus(name=f"{name}: {part}", values=entries) for part in ("frames", "stop")]
    )
    publisher = node.peer.node.create_publisher(DiagnosticArray, "diagnostics", 10)
    ended = threading.Event()

    def publish():
        while not ended.wait(0.02):
            publisher.publish(message)

    thread = threading.Thread(target=publish)
    thread.start()
    done = hpccd("status", name)
    ended.set()
    thread.join()
    assert done.returncode == 2, done.stdout
    assert f"hpccd status: {name}: its /diagnostics are not those of hpccd " in done.stderr


def test_a_robot_without_a_frame(start_node, hpccd, tmp_path):
    """Joint states come and name no joint of the robot: they are not missing."""
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    node = start_node(
        {
            "robots": ["arm", "tool"],
            "frame_id": "world",
            "robot.arm.description": str(file),
            "robot.arm.joint_states": "joint_states",
            "robot.tool.description": str(file),
        }
    )
    name = f"{node.namespace}/hpccd"
    shown = hpccd("status", name).stdout
    assert "  arm   robot, no frame yet, no joint state received\n" in shown
    assert "  tool  robot moved by TF, no frame yet\n" in shown
    message = JointState(name=["left_shoulder"], position=[0.1])
    message.header.stamp = fields.ns_to_stamp(7 * 10**9)
    publisher = node.peer.node.create_publisher(JointState, "joint_states", 5)

    def received():
        publisher.publish(message)
        return "last_stamp.joint_states" in node.peer.statuses["frames"][2]

    node.wait_until(received, "the message")
    shown = hpccd("status", name).stdout
    assert "  arm   robot, no frame yet, last joint state 7.000000000 s\n" in shown


def test_all_messages_were_rejected_and_the_stream_has_ended(start_node, hpccd):
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", sheet_faces(N), N * N)
    for _ in range(4):
        node.peer.vertices("cloth", sheet_positions(N, 0), 0)
    node.frames_status(dropped=3)
    node.wait_until(lambda: "dropped (" not in node.peer.statuses["frames"][1], "a report without new drops")
    done = hpccd("status", f"{node.namespace}/hpccd")
    assert done.returncode == 1
    assert "  wrong: no result so far: 3 messages dropped (stamp_repeated 3); docs/troubleshooting.md" in done.stdout


def test_what_is_sent_once_was_rejected(start_node, hpccd):
    node = start_node({"meshes": ["cloth", "floor"], "mesh.floor.static": True, "pending_frames": 1})
    node.peer.topology("cloth", sheet_faces(N), 0)
    node.frames_status(topologies_rejected=1)
    for k in range(2):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
    node.peer.topology("floor", sheet_faces(N), N * N)
    node.peer.vertices("floor", sheet_positions(N, 0)[1:], 0)
    node.frames_status(dropped=2)
    why = "(index_range: face 97 names vertex 63, n_vertices is 0); publish a valid one"
    assert f"cloth: no_topology: no topology version 0, as the last one was rejected {why}" in node.output()
    wrong = [
        f"  wrong: {node.namespace}/meshes/cloth/topology: the last message was rejected {why}\n",
        f"  wrong: {node.namespace}/meshes/floor/vertices: the last message was rejected (wrong_vertex_count: 63 ",
    ]
    node.wait_until(lambda: "dropped (" not in node.peer.statuses["frames"][1], "a report without new drops")
    shown = hpccd("status", f"{node.namespace}/hpccd").stdout
    assert all(line in shown for line in wrong) and "/topology: no message" not in shown
    node.peer.topology("cloth", sheet_faces(N), N * N, version=1)
    node.peer.vertices("floor", sheet_positions(N, 0), 0)
    rejected = "the last message was rejected"
    node.wait_until(lambda: rejected not in str(node.peer.statuses["frames"][2]), "no more of it")


def test_two_nodes_of_one_name(start_node, hpccd):
    node = start_node({"meshes": ["cloth"]})
    name = f"{node.namespace}/hpccd"
    other = Node("hpccd", namespace=node.namespace, context=node.peer.context)
    try:
        says = f"2 nodes are named {name}, so they share topics and services; end one, or rename it (-r __node:=NAME)"
        node.wait_until(lambda: says in node.output(), "the warning")
        for _ in range(30):  # a command may have discovered only one of them yet
            done = hpccd("param", "get", "accuracy", "--node", name, "--wait", "30")
            if done.returncode:
                break
        assert done.returncode == 2 and says in done.stderr
    finally:
        other.destroy_node()


def test_one_of_two_nodes_does_not_respond(start_node, hpccd, empty_domain):
    """Another process with a service of our type, and without the services of a life cycle."""
    node = start_node({"meshes": ["cloth"]})
    service = node.peer.node.create_service(Detect, "detect", lambda request, response: response)
    try:
        for wait in WAITS:
            done = hpccd("status", "--wait", str(wait))
            if "/peer: " in done.stdout:
                break
    finally:
        node.peer.node.destroy_service(service)
    assert done.returncode == 1 and f"{node.namespace}/peer: unknown\n  wrong: " in done.stdout
    assert f"{node.namespace}/hpccd: active\n" in done.stdout
