# SPDX-License-Identifier: Apache-2.0
"""Scenes over DDS: `hpccd scene` as a process of its own, this one listens; then the node between the two."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import rclpy
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

import hpccd_ros
from hpccd_ros import scenes
from hpccd_ros.middleware import environment, topic_names
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.scenes import messages

# Reached only by tests that fail.
PATIENCE = 240.0
ROOT = Path(hpccd_ros.__file__).resolve().parents[1]


def start(*words):
    command = [sys.executable, "-m", *map(str, words)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


@pytest.fixture
def children():
    """Processes that a test starts; they are killed where it leaves them running."""
    started = []
    yield started
    for child in started:
        if child.poll() is None:
            child.kill()
            child.wait()
        child.stdout.close()


class Listener:
    """Subscribes raw to what a scene publishes: {topic: [bytes, ...]}."""

    def __init__(self, scene, namespace):
        environment.prepare()
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("listener", namespace=namespace, context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.received = {}
        latched = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for topic in messages.topics(scene):
            self.listen(
                message_class(topic.type_name), topic.name, latched if topic.latched else QoSProfile(depth=1000)
            )

    def listen(self, kind, topic, profile):
        self.received[topic] = []
        self.node.create_subscription(kind, topic, self.received[topic].append, profile, raw=True)

    def wait(self, condition, child):
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if child.poll() not in (None, 0) or time.monotonic() > deadline:
                child.kill()
                counts = {topic: len(data) for topic, data in self.received.items()}
                raise AssertionError(f"{counts}; the publisher said: {child.communicate()[0]}")
            self.executor.spin_once(timeout_sec=0.05)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def listen():
    open_listeners = []

    def start_listening(*arguments):
        open_listeners.append(Listener(*arguments))
        return open_listeners[-1]

    yield start_listening
    for listener in open_listeners:
        listener.close()


def publish_command(name, namespace, *options):
    return ["hpccd_ros.cli", "scene", name, *options, "--publish", "--ros-args", "-r", f"__ns:={namespace}"]


def test_every_frame_arrives_in_another_process(listen, children):
    scene = scenes.make("breaking-like", size=1 / 64, frames=12)
    listener = listen(scene, "/all_frames")
    options = ("--size", 1 / 64, "--frames", 12, "--rate", 50, "--wait", PATIENCE)
    command = publish_command(scene.name, "/all_frames", *options)
    children.append(start(*command))
    vertices = {mesh: listener.received[topic_names.vertices(mesh)] for mesh in scene.mesh_names}
    listener.wait(lambda: all(len(rows) == 12 for rows in vertices.values()), children[0])
    topologies = listener.received[topic_names.topology("statue")]
    changes = [frame for frame in scene.frames() if frame.topologies]
    listener.wait(lambda: len(topologies) == 1 + len(changes), children[0])
    assert children[0].wait(PATIENCE) == 0

    faces = {m.version: m for m in (deserialize_message(raw, MeshTopology) for raw in topologies)}
    assert sorted(faces) == list(range(1 + len(changes)))
    stamps = []
    for m, mesh in enumerate(scene.mesh_names):
        decoded = [deserialize_message(raw, MeshVertices) for raw in vertices[mesh]]
        stamps.append([d.header.stamp.sec * 10**9 + d.header.stamp.nanosec for d in decoded])
        for frame, message in zip(scene.frames(), decoded, strict=True):
            assert message.step == frame.index
            np.testing.assert_array_equal(np.asarray(message.vertices_f32).reshape(-1, 3), frame[m])
            if mesh == "statue":
                topology = faces[message.topology_version]
                assert topology.n_vertices == len(frame[m])
                np.testing.assert_array_equal(np.asarray(topology.faces).reshape(-1, 3), scene.faces(frame.index)[m])
    assert stamps[0] == stamps[1] == stamps[2], "meshes of a frame are joined by equal stamps"
    assert set(np.diff(stamps[0])) == {20_000_000}


def test_loop_counts_versions_on_and_sigterm_ends_it(listen, children):
    scene = scenes.make("two-triangles")
    listener = listen(scene, "/loop")
    children.append(start(*publish_command(scene.name, "/loop", "--rate", 200, "--loop", "--wait", PATIENCE)))
    rows = listener.received[topic_names.vertices("upper")]
    listener.wait(lambda: len(rows) >= 40, children[0])
    children[0].send_signal(signal.SIGTERM)
    assert children[0].wait(PATIENCE) == 0
    assert "published" in children[0].communicate()[0]

    decoded = [deserialize_message(raw, MeshVertices) for raw in rows[:40]]
    assert [d.step for d in decoded] == list(range(40))
    # Each round has its own topology: the jump back to the first frame is no motion.
    assert [d.topology_version for d in decoded] == [k // 11 for k in range(40)]


def test_late_listener_still_gets_the_topology(listen, children):
    scene = scenes.make("two-triangles")
    children.append(start(*publish_command(scene.name, "/late", "--rate", 100, "--loop", "--wait", 0)))
    line = ""
    while "published" not in line and "publishing" not in line:
        line = children[0].stdout.readline()
        assert line, "the publisher ended"
    listener = listen(scene, "/late")
    listener.wait(lambda: listener.received[topic_names.topology("lower")], children[0])
    children[0].send_signal(signal.SIGINT)
    assert children[0].wait(PATIENCE) == 0


@pytest.mark.parametrize(
    ("name", "size"), [pytest.param("folding-strip", 0.25, marks=pytest.mark.long), ("breaking-like", 1 / 64)]
)
def test_node_reports_the_contacts_of_a_scene(name, size, listen, children, tmp_path):
    """Parameter file, publisher and node as a user would start them; contacts equal those of the core.

    The node is held up for the length of several frames: topologies and vertices that came meanwhile lie in separate
    queues, and all of them count.
    """
    import hpccd_core

    frames = 61 if name == "folding-strip" else 40
    scene = scenes.make(name, size=size, frames=frames)
    parameters = tmp_path / "node.yaml"
    options = ["--size", size, "--frames", frames]
    made = start("hpccd_ros.cli", "scene", name, *options, "--params", parameters)
    assert made.wait(PATIENCE) == 0, made.communicate()[0]
    made.communicate()

    listener = listen(scene, "/whole")
    results = []
    listener.node.create_subscription(ContactArray, "contacts", results.append, QoSProfile(depth=1000))
    # Queues as long as the scene: no frame may be dropped here, however slow the machine.
    node = start(
        "hpccd_ros.node",
        "--ros-args",
        "-r",
        "__ns:=/whole",
        "--params-file",
        parameters,
        "-p",
        f"frame_queue:={frames}",
        "-p",
        f"input_depth:={frames}",
        "-p",
        "max_contacts:=0",
    )
    children.append(node)
    command = publish_command(name, "/whole", *options, "--rate", 20, "--wait", PATIENCE, "--subscribers", 2)
    publisher = start(*command)
    children.append(publisher)

    expected = {}
    for before, frame in zip(scene.frames(), list(scene.frames())[1:], strict=False):
        if not frame.topologies:  # the node begins again with a new topology
            detector = hpccd_core.Detector(scenes.core_scene(scene, frame.index))
            expected[frame.index] = detector.detect(before.stacked(), frame.stacked())
    assert sum(len(c) for c in expected.values()) > 100
    listener.wait(lambda: len(results) >= 2, publisher)
    node.send_signal(signal.SIGSTOP)
    time.sleep(0.2)  # four frames; while the statue breaks each has a topology, and the queue of these holds ten
    node.send_signal(signal.SIGCONT)
    listener.wait(lambda: len(results) >= len(expected), publisher)
    assert {a.step: a.hash for a in results} == {k: c.hash for k, c in expected.items()}
    assert {a.step: a.total for a in results} == {k: len(c) for k, c in expected.items()}
    node.send_signal(signal.SIGINT)
    assert node.wait(PATIENCE) == 0


def test_a_robot_comes_as_its_description_and_joint_states(listen, children):
    scene = scenes.make("arm-and-cloth", size=0.1, frames=21)
    (robot,) = scene.robots
    listener = listen(scene, "/arm")
    options = ("--size", 0.1, "--frames", 21, "--rate", 100, "--wait", PATIENCE)
    children.append(start(*publish_command(scene.name, "/arm", *options)))
    states, cloth = (listener.received[name] for name in ("joint_states", topic_names.vertices("cloth")))
    listener.wait(lambda: len(states) == len(cloth) == 21 and listener.received["robot_description"], children[0])

    names = {name for name, _ in listener.node.get_topic_names_and_types() if name.startswith("/arm/")}
    assert {name for name in names if "/meshes/" in name} == {
        f"/arm/meshes/{mesh}/{kind}" for mesh in ("table", "cloth") for kind in ("topology", "vertices")
    }
    offered = {}
    for name in ("robot_description", "joint_states"):
        (end,) = listener.node.get_publishers_info_by_topic(f"/arm/{name}")
        offered[name] = end.qos_profile
    assert offered["robot_description"].durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert {profile.reliability for profile in offered.values()} == {ReliabilityPolicy.RELIABLE}
    assert children[0].wait(PATIENCE) == 0

    (description,) = (deserialize_message(raw, String).data for raw in listener.received["robot_description"])
    assert description == robot.description
    stamps = [deserialize_message(raw, MeshVertices).header.stamp for raw in cloth]
    for frame, raw, stamp in zip(scene.frames(), states, stamps, strict=True):
        message = deserialize_message(raw, JointState)
        assert message.header.stamp == stamp
        assert dict(zip(message.name, message.position, strict=True)) == robot.joint_positions(frame.time)


def test_a_scene_of_one_mesh_is_tested_against_itself():
    """Its contacts are all of the mesh with itself."""
    parameters = messages.node_parameters(scenes.make("folding-strip", size=0.1))
    assert parameters == {"meshes": ["strip"], "mesh.strip.static": False, "mesh.strip.self_collision": True}
