# SPDX-License-Identifier: Apache-2.0
"""The simulator's side of the ROS benchmark: frames out, contacts in, each with its time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

import hpccd_core as hc
from bench.ros import echo
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.sources import Step
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware import contact_messages, fields, mesh_messages, qos, topic_names

MESH = "scene"
PATIENCE = 300.0  # s, for what takes less than one on a machine that is not busy


@dataclass
class Lane:
    """One way to an answer. sent, came: time of each step, s of CLOCK_MONOTONIC; position: which was sent."""

    name: str
    publisher: object
    step: int = 0
    position: dict[int, int] = field(default_factory=dict)
    sent: dict[int, float] = field(default_factory=dict)
    came: dict[int, float] = field(default_factory=dict)

    def latencies_ms(self) -> np.ndarray:
        """From before the call of publish() to the begin of the callback, of the steps that were answered."""
        return np.array([1e3 * (at - self.sent[step]) for step, at in self.came.items()])

    def clear(self) -> None:
        """Forget all but the last step, which the next one begins with."""
        self.sent.clear()
        self.came.clear()
        self.position = {self.step: self.position[self.step]}


class Link:
    """Publishes a motion there and back again, to the node and to the echo, in a node of this process.

    The vertices are sent in single precision, as one mesh. hold: frames that a position is sent for, one after the
    other: with 2, a node that takes every second frame still sees motion in each step. wrong: steps whose contacts were
    not those of the core.
    """

    def __init__(self, node: Node, step: Step, options: dict):
        whole = step.as_one_mesh()
        self._faces = whole.meshes[0].faces
        positions = self.positions = [np.asarray(v, np.float32) for v in (step.vertices_t0, step.vertices_t1)]
        self._frames = [mesh_messages.vertices_message(p, 0, frame_id="world") for p in positions]
        self.bytes_in = positions[0].nbytes
        self.triangles, self.n_vertices = len(self._faces), len(positions[0])
        self.detector = hc.Detector(whole.scene(), **options)
        found = [self.detector.detect(positions[1 - k], positions[k]) for k in (0, 1)]
        self._expected = [contacts.hash for contacts in found]
        self.contacts = len(found[1])
        self.answers = [self._answer(contacts, k) for k, contacts in enumerate(found)]
        self.hold = 1
        self.wrong: list[int] = []
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        reliable = qos.vertices("reliable", 10)
        self._topology = node.create_publisher(MeshTopology, topic_names.topology(MESH), qos.TOPOLOGY)
        self._templates = node.create_publisher(ContactArray, "echo/answers", echo.ANSWERS)
        self.node = Lane("node", node.create_publisher(MeshVertices, topic_names.vertices(MESH), reliable))
        self.echo = Lane("echo", node.create_publisher(MeshVertices, "echo/vertices", reliable))
        # A benchmark must hear every answer: deeper than the node's own QoS, which a late reader overruns.
        deep = qos.vertices("reliable", 100)
        node.create_subscription(ContactArray, topic_names.CONTACTS, self._from(self.node), deep)
        node.create_subscription(ContactArray, "echo/contacts", self._from(self.echo), deep)

    def _answer(self, contacts, parity: int) -> ContactArray:
        message = ContactArray(step=parity)
        layout = Layout.of((MESH,), (Topology(0, self.n_vertices, self._faces),))
        contact_messages.fill_contacts(message, contacts, layout)
        return message

    @property
    def bytes_out(self) -> int:
        """Of the arrays in an answer."""
        names = ("kind", "mesh_a", "mesh_b", "features_a", "features_b", "toc", "points", "normals")
        fields = [getattr(self.answers[1], name) for name in names]
        return sum(len(values) * values.itemsize for values in fields)

    def _from(self, lane: Lane) -> Callable[[ContactArray], None]:
        def take(message: ContactArray) -> None:
            lane.came[message.step] = time.monotonic()
            # Stamps are the steps' numbers. Where the position has not changed, there is nothing to compare with.
            start, end = lane.position.get(message.start.nanosec), lane.position.get(message.step)
            if lane is self.node and start is not None and start != end and message.hash != self._expected[end]:
                self.wrong.append(message.step)

        return take

    def close(self) -> None:
        self._executor.shutdown()

    def connect(self, alive: Callable[[], None]) -> None:
        """Wait for node and echo, give both what they need, and send the frame that the first step begins with."""
        publishers = (self._topology, self._templates, self.node.publisher, self.echo.publisher)
        self.spin_until(lambda: all(p.get_subscription_count() for p in publishers), "node and echo", alive)
        self._topology.publish(mesh_messages.topology_message(self._faces, self.n_vertices))
        for answer in self.answers:
            self._templates.publish(answer)
        deadline = time.monotonic() + PATIENCE
        # Nothing tells when a latched message has arrived, so ask until there is an answer.
        for lane in (self.node, self.echo):
            while not lane.came and time.monotonic() < deadline:
                alive()
                self.publish(lane)
                self.spin(0.2)
            if not lane.came:
                raise UserError(f"the {lane.name} did not answer within {PATIENCE:.0f} s")

    def publish(self, lane: Lane) -> int:
        """Send the next frame; its step."""
        lane.step += 1
        lane.position[lane.step] = at = lane.step // self.hold % 2
        message = self._frames[at]
        message.step = lane.step
        message.header.stamp = fields.ns_to_stamp(lane.step)
        lane.sent[lane.step] = time.monotonic()
        lane.publisher.publish(message)
        return lane.step

    def round(self, lane: Lane) -> None:
        """Send one frame and wait for its answer."""
        step = self.publish(lane)
        deadline = time.monotonic() + PATIENCE
        while step not in lane.came:
            if time.monotonic() > deadline:
                raise UserError(f"the {lane.name} did not answer step {step} within {PATIENCE:.0f} s")
            self._executor.spin_once(timeout_sec=1.0)

    def spin(self, seconds: float) -> None:
        """Take what comes within `seconds`."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def spin_until(self, ready: Callable[[], bool], what: str, alive: Callable[[], None]) -> None:
        """Take what comes until `ready()`; UserError where that lasts too long."""
        deadline = time.monotonic() + PATIENCE
        while not ready():
            alive()
            if time.monotonic() > deadline:
                raise UserError(f"no {what} within {PATIENCE:.0f} s")
            self._executor.spin_once(timeout_sec=0.02)
