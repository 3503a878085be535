# SPDX-License-Identifier: Apache-2.0
"""Start the node as a process and communicate with it over DDS from this one."""

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from hpccd.srv import Detect
from node_server import ForkedNode
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile

import hpccd_core as hc
import hpccd_ros
from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware import contact_messages, environment, fields, mesh_messages, qos

# Long enough for an overloaded machine; only failing tests reach it.
PATIENCE = 240.0
# Seconds for a node to exit at the end of a test.
ORDERLY = 20.0
MODULE = ("-m", "hpccd_ros.node")

_numbers = itertools.count()


class NodeProcess:
    """``python -m hpccd_ros.node`` in a namespace of its own, and a peer in this process.

    parameters: nested as in YAML, including meshes; NAMESPACE in them is replaced by that of the node. profiles:
    parameter files, read after the parameters. remaps: additional ``from:=to`` rules. program: arguments of a new
    Python process, MODULE for the node itself; by default the node is a fork of node_server.py.
    """

    def __init__(
        self,
        folder: Path,
        parameters: dict[str, Any],
        *,
        profiles: tuple[Path, ...] = (),
        remaps: tuple[str, ...] = (),
        wait: bool = True,
        program: tuple[str, ...] | list[str] | None = None,
    ):
        self.namespace = f"/t{os.getpid()}_{next(_numbers)}"
        values = {"diagnostics_period": 0.1, **parameters}
        file = folder / f"parameters{self.namespace[1:]}.yaml"
        text = yaml.safe_dump({"/**": {"ros__parameters": values}})
        file.write_text(text.replace("NAMESPACE", self.namespace))
        rules = (f"__ns:={self.namespace}", f"/diagnostics:={self.namespace}/diagnostics", *remaps)
        arguments = ["--ros-args", "--params-file", str(file)]
        for profile in profiles:
            arguments += ["--params-file", str(profile)]
        for rule in rules:
            arguments += ["-r", rule]
        self._output = (folder / f"output{self.namespace[1:]}.txt").open("w+")
        self.process: subprocess.Popen | ForkedNode
        if program is None:
            self.process = ForkedNode(arguments, Path(self._output.name))
        else:
            # The module is found from the current folder: the node under test is the one that is imported here.
            root = Path(hpccd_ros.__file__).resolve().parents[1]
            command = [sys.executable, *program, *arguments]
            self.process = subprocess.Popen(command, cwd=root, stdout=self._output, stderr=subprocess.STDOUT)
        self.peer = Peer(self.namespace)
        if parameters.get("record"):
            self.peer.readers = 2  # the recording of the node has subscriptions of its own
        if wait:
            try:
                self.wait_until(lambda: self.peer.statuses, "diagnostics of the node")
            except BaseException:
                self.close()
                raise

    def output(self) -> str:
        self._output.flush()
        return Path(self._output.name).read_text()

    def wait_until(self, condition: Callable[[], Any], what: str) -> Any:
        """Spin until ``condition()`` is true; its value. Fails with the output of the node."""
        deadline = time.monotonic() + PATIENCE
        while not (value := condition()):
            if self.process.poll() is not None:
                raise AssertionError(f"node ended with {self.process.returncode}, waiting for {what}\n{self.output()}")
            if time.monotonic() > deadline:
                raise AssertionError(f"no {what} within {PATIENCE} s\n{self.peer.statuses}\n{self.output()}")
            self.peer.executor.spin_once(timeout_sec=0.05)
        return value

    def contacts(self, count: int) -> list[ContactArray]:
        """Wait until ``count`` messages have arrived."""
        self.wait_until(lambda: len(self.peer.received) >= count, f"{count} contact messages")
        return self.peer.received

    def frames_status(self, **expected: Any) -> dict[str, str]:
        """Wait until the status `frames` holds these values ("__" stands for a dot in a name)."""
        wanted = {key.replace("__", "."): str(value) for key, value in expected.items()}

        def matches():
            values = self.peer.statuses.get("frames", (None, "", {}))[2]
            return values if wanted.items() <= values.items() else None

        return self.wait_until(matches, f"frames status with {wanted}")

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal and wait for the end; the exit status."""
        self.process.send_signal(number)
        return self.process.wait(timeout=PATIENCE)

    def close(self) -> None:
        if self.process.poll() is None:
            # A killed process leaves its part of the shared memory to its peers as it happens to be.
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(timeout=ORDERLY)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.peer.close()
        self._output.close()


class Peer:
    """A node in this process with its own context: publishes meshes, receives contacts and diagnostics."""

    def __init__(self, namespace: str):
        environment.prepare()
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node("peer", namespace=namespace, context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.received: list[ContactArray] = []
        self.statuses: dict[str, tuple[bytes, str, dict[str, str]]] = {}
        self.reported_at: int | None = None  # ns, in the time of the node
        self.readers = 1  # that a publisher of this peer waits for
        deep = QoSProfile(depth=1000, history=HistoryPolicy.KEEP_LAST)
        self.node.create_subscription(ContactArray, "contacts", self.received.append, deep)
        self.node.create_subscription(DiagnosticArray, "diagnostics", self._on_diagnostics, 10)
        self._publishers: dict[str, Any] = {}

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.reported_at = fields.stamp_to_ns(message.header.stamp)
        for status in message.status:
            values = {v.key: v.value for v in status.values}
            self.statuses[status.name.rpartition(": ")[2]] = (status.level, status.message, values)

    def publisher(self, kind: type, topic: str, profile: QoSProfile | None = None) -> Any:
        """A publisher that the node and other subscribers (``readers`` in total) are matched with."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(kind, topic, profile or qos.vertices("reliable", 100))
            self.await_readers(topic)
        return self._publishers[topic]

    def await_readers(self, topic: str) -> None:
        """Wait until the publisher of ``topic`` has its ``readers``."""
        deadline = time.monotonic() + PATIENCE
        while (there := self._publishers[topic].get_subscription_count()) < self.readers:
            assert time.monotonic() < deadline, f"{there} listen to {topic}, {self.readers} were to"
            self.executor.spin_once(timeout_sec=0.02)

    def forget_publisher(self, topic: str) -> None:
        self.node.destroy_publisher(self._publishers.pop(topic))

    def topology(self, mesh: str, faces: np.ndarray, n_vertices: int, version: int = 0, **edges: np.ndarray) -> None:
        publisher = self.publisher(MeshTopology, f"meshes/{mesh}/topology", qos.TOPOLOGY)
        publisher.publish(mesh_messages.topology_message(faces, n_vertices, version=version, **edges))
        # Topics are not ordered: vertices sent next must not overtake it.
        if not publisher.wait_for_all_acked(Duration(seconds=PATIENCE)):
            readers = publisher.get_subscription_count()
            raise AssertionError(f"{publisher.topic_name}: not acknowledged by {readers} readers within {PATIENCE} s")

    def vertices(self, mesh: str, vertices: np.ndarray, stamp: int, **fields: Any) -> None:
        publisher = self.publisher(MeshVertices, f"meshes/{mesh}/vertices")
        publisher.publish(mesh_messages.vertices_message(vertices, stamp, **fields))

    def client(self, depth: int = 10) -> Any:
        """A connected client of ~/detect. depth: of its queues of requests and responses."""
        profile = QoSProfile(depth=depth, history=HistoryPolicy.KEEP_LAST)
        client = self.node.create_client(Detect, "hpccd/detect", qos_profile=profile)
        assert client.wait_for_service(timeout_sec=PATIENCE)
        return client

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def assert_same_contacts(message: ContactArray, t0: np.ndarray, t1: np.ndarray, scene: hc.Scene, **options: Any) -> int:
    """Assert that contacts, and outputs in ``options``, equal the core's on these positions; returns their number."""
    expected = hc.Detector(scene, **options).detect(t0, t1)
    names = tuple(message.mesh_names)
    vertex_offsets = [scene.vertex_offset(name) for name in names] + [scene.n_vertices]
    face_offsets = [scene.face_offset(name) for name in names] + [scene.n_faces]
    layout = Layout(names, np.array(vertex_offsets), np.array(face_offsets))
    got = contact_messages.read_contacts(message, layout)
    for name in ("vf", "ee", "vf_toc", "ee_toc", *expected.outputs):
        assert np.array_equal(getattr(got, name), getattr(expected, name)), name
    assert message.hash == expected.hash
    assert message.first_toc == expected.first_toc
    assert message.total == len(expected.vf) + len(expected.ee)
    assert not message.truncated
    return message.total
