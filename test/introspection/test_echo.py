# SPDX-License-Identifier: Apache-2.0
"""`hpccd echo`: what it prints is YAML of the message, whatever the publishers offer."""

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hpccd.msg import MeshVertices
from sources import SOURCES
from std_msgs.msg import Bool
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.introspection import message_text
from hpccd_ros.middleware import mesh_messages, qos

N = 8


def printed(message, full=False):
    return yaml.safe_load("\n".join(message_text.lines(message, full)))


def test_every_kind_of_field():
    status = DiagnosticStatus(level=b"\x02", name="node: frames", message="no", values=[KeyValue(key="a", value="1.5")])
    array = DiagnosticArray(status=[status, DiagnosticStatus()])
    array.header.stamp.sec = 7
    found = printed(array)
    assert found["header"] == {"stamp": {"sec": 7, "nanosec": 0}, "frame_id": ""}
    first, second = found["status"]
    assert first == {
        "level": 2,
        "name": "node: frames",
        "message": "no",
        "hardware_id": "",
        "values": [{"key": "a", "value": "1.5"}],
    }
    assert second["level"] == 0 and second["values"] == []


def test_long_arrays_and_texts_are_cut():
    message = mesh_messages.vertices_message(np.arange(30, dtype=np.float32).reshape(10, 3), 5, frame_id="x" * 300)
    assert printed(message)["vertices_f32"] == list(range(16))
    text = "\n".join(message_text.lines(message))
    assert "# 16 of 30 entries; --full shows all" in text and "200 of 300 characters" in text
    whole = printed(message, full=True)
    assert whole["vertices_f32"] == list(range(30)) and whole["header"]["frame_id"] == "x" * 300


@pytest.mark.parametrize("word", ["yes", "null", "1.5", "a: b", "'", "- x", "#", "a\nb", "wörld", "end:"])
def test_a_text_stays_a_text(word):
    message = DiagnosticStatus(message=word)
    assert printed(message)["message"] == word


def test_a_latched_topic(start_node, hpccd):
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", sheet_faces(N), N * N, version=3)
    done = hpccd("echo", f"{node.namespace}/meshes/cloth/topology", "--once", "--full")
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("\n---\n")
    found = yaml.safe_load(done.stdout.removesuffix("---\n"))
    assert found["version"] == 3 and found["faces"] == sheet_faces(N).ravel().tolist()


def test_a_best_effort_publisher_is_heard_and_n_messages_end_it(start_node, hpccd):
    node = start_node({"meshes": ["cloth"], "input_reliability": "best_effort"})
    publisher = node.peer.node.create_publisher(MeshVertices, "meshes/cloth/vertices", qos.vertices("best_effort", 10))
    timer = node.peer.node.create_timer(
        0.05, lambda: publisher.publish(mesh_messages.vertices_message(sheet_positions(N, 0), 4))
    )
    ended = threading.Event()
    spinner = threading.Thread(target=lambda: [node.peer.executor.spin_once(0.05) for _ in iter(ended.is_set, True)])
    spinner.start()
    try:
        done = hpccd("echo", f"{node.namespace}/meshes/cloth/vertices", "-n", "2")
    finally:
        ended.set()
        spinner.join()
        node.peer.node.destroy_timer(timer)
    assert done.returncode == 0 and done.stdout.count("\n---\n") == 2
    assert "vertices_f32: [" in done.stdout and "# 16 of 192 entries" in done.stdout


def test_a_topic_that_is_not_there(start_node, hpccd):
    node = start_node({"meshes": ["cloth"]})
    done = hpccd("echo", f"{node.namespace}/contact", "--wait", "10")
    assert done.returncode == 2 and f"{node.namespace}/contact: no such topic on ROS_DOMAIN_ID" in done.stderr
    assert f"did you mean {node.namespace}/contacts?" in done.stderr
    done = hpccd("echo", "1contacts")
    assert done.returncode == 2 and "'1contacts': not a topic name; write it as /contacts" in done.stderr


def test_a_topic_with_subscribers_only(start_node):
    """A subscription keeps the topic in the graph, so that it is not found missing."""
    peer = start_node({"meshes": ["cloth"]}).peer.node
    peer.create_publisher(Bool, "stop", qos.stop(0.5))
    topic = peer.create_subscription(Bool, "cell1/stop", lambda message: None, qos.stop(0.5)).topic_name
    command = [sys.executable, "-m", "hpccd_ros.cli", "echo", topic, "--wait", "60"]
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as echo:
        says = next(line for line in echo.stderr if "no message yet" in line)
        echo.send_signal(signal.SIGINT)
    near = f"{peer.get_namespace()}/stop"
    assert says == f"{topic}: no message yet; it has 0 publishers; Ctrl-C ends; did you mean {near}?\n"


def test_topics_are_listed(start_node, hpccd):
    node = start_node({"meshes": ["cloth"]})
    vertices = [f"{node.namespace}/meshes/cloth/vertices", "hpccd/msg/MeshVertices"]
    for _ in range(10):  # the command may have discovered only some of the topics yet
        done = hpccd("echo")
        lines = [line.split() for line in done.stdout.splitlines()]
        if vertices in lines:
            break
    assert done.returncode == 0 and [f"{node.namespace}/contacts", "hpccd/msg/ContactArray"] in lines
    assert vertices in lines and lines == sorted(lines)


def test_an_output_that_is_off_names_its_parameter(start_node, children, hpccd):
    node = start_node({"meshes": ["cloth"]})
    name = f"{node.namespace}/hpccd"
    echo = children.start("echo", "hpccd_ros.cli", "echo", f"{node.namespace}/pairs", "--once")
    remedy = f"hpccd param set pair_summaries true --node {name}"
    text = f"{node.namespace}/pairs: no message yet; it has 1 publisher; parameter pair_summaries is false: {remedy}; "
    children.wait(lambda: echo.has_printed(text), "echo did not name the parameter", 60)
    done = hpccd(*remedy.split()[1:])
    assert done.returncode == 0, done.stderr
    node.peer.topology("cloth", sheet_faces(N), N * N)
    for stamp in range(2):
        node.peer.vertices("cloth", sheet_positions(N, stamp), stamp=stamp)
        node.frames_status(processed=stamp + 1)
    children.wait(lambda: not echo.running, "echo did not print the message", 60)
    assert echo.process.returncode == 0 and echo.has_printed("\npairs:")
    silent = children.start("silent", "hpccd_ros.cli", "echo", f"{node.namespace}/contacts")
    children.wait(lambda: silent.has_printed("1 publisher; Ctrl-C ends"), "echo is not silent", 60)
