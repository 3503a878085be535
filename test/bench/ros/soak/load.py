# SPDX-License-Identifier: Apache-2.0
"""What the soak does to the node: streams, changes of topology, wrong messages, requests; and what it checks."""

from __future__ import annotations

import time
from collections import Counter, OrderedDict
from typing import Any

import numpy as np
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from hpccd.srv import Detect
from rclpy.duration import Duration
from rclpy.node import Node

import hpccd_core as hc
from bench.ros.soak import restarted_publisher
from bench.ros.soak.wrong_messages import MOST_VERTICES, WrongMessages
from hpccd_ros import scenes
from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware import contact_messages, fields, mesh_messages, qos, topic_names
from hpccd_ros.scenes.messages import Player

SCENE, SIZE = "breaking-like", 0.02  # 5,036 triangles; sixteen changes of topology in each run of 60 frames
TIER = "balanced"
INPUT_DEPTH = 50  # frames that may wait for the node
HISTORY = 10_000  # frames that an answer may name: what a busy machine holds up comes late
WRONG_EVERY = 7  # frames
REQUEST_EVERY = 20  # frames
QUERIES = ("contacts", "collision_free_step")  # of requests, in turn
UNKNOWN_EVERY = 50  # frames
SEGMENT = 16 << 20  # bytes of shared memory that a publisher has (config/fastdds*.xml)


def node_parameters(scene: scenes.Scene) -> dict[str, Any]:
    """The scene's meshes and the strip of the publisher that is restarted; bounds near to what is sent."""
    meshes = {m.name: {"static": m.static, "self_collision": m.self_collision} for m in scene.meshes}
    return {
        "meshes": [*meshes, restarted_publisher.MESH],
        "mesh": meshes,
        "accuracy": TIER,
        "threads": 1,
        "max_vertices": MOST_VERTICES,
        "max_contacts": 5000,  # fewer than there are at times: truncation is exercised too
        "input_depth": INPUT_DEPTH,
        "diagnostics_period": 1.0,
    }


class SoakLoad:
    """Publishes every mesh but the strip, in a node of this process.

    sent: vertex messages by mesh, wrong ones included. victim: the mesh that wrong messages are sent for.
    answers, checked: contact messages heard, and of these computed again. wrong: texts of answers and replies that
    were not as they must be. check_every: every so many answers one is computed again, which costs a detection.
    """

    def __init__(self, node: Node, scene: scenes.Scene, rate: float, check_every: int):
        self._scene, self._rate, self._check_every = scene, rate, check_every
        self._player = Player(scene)
        self._strip = restarted_publisher.strip()
        self._publishers = {}
        for mesh in scene.mesh_names:
            self._publishers[topic_names.topology(mesh)] = node.create_publisher(
                MeshTopology, topic_names.topology(mesh), qos.TOPOLOGY
            )
            self._publishers[topic_names.vertices(mesh)] = node.create_publisher(
                MeshVertices, topic_names.vertices(mesh), qos.vertices("reliable", INPUT_DEPTH)
            )
        misspelt = topic_names.vertices("statute")
        self._misspelt = node.create_publisher(MeshVertices, misspelt, qos.vertices("reliable", 10))
        node.create_subscription(ContactArray, topic_names.CONTACTS, self._on_contacts, 100)
        self._client = node.create_client(Detect, "hpccd/detect")
        self._replies: list = []
        # By stamp: how often topologies had changed before, frame of the scene, frame of the strip.
        self._frames: OrderedDict[int, tuple[int, int, int]] = OrderedDict()
        self._count = 0
        self._generation = 0
        self.sent: Counter = Counter()
        self.misspelt_sent = self.answers = self.checked = self.requests = self.replies = self.topologies = 0
        self.truncated = 0
        self.wrong: list[str] = []
        self.victim = scene.mesh_names[0]
        self.wrong_messages = WrongMessages(
            lambda message: self._publish_vertices(self.victim, message),
            self._publishers[topic_names.topology(self.victim)].publish,
        )

    def heard(self) -> bool:
        """Whether the node listens to every mesh and its service is there."""
        return all(p.get_subscription_count() for p in self._publishers.values()) and (self._client.service_is_ready())

    def begin(self) -> None:
        """Send a first right frame: what came before the node knew of its publisher could not be accounted for."""
        self._send_frame(int(time.time() * self._rate))

    def acknowledged(self) -> bool:
        """Whether the node has all that was sent on its topics."""
        return all(p.wait_for_all_acked(Duration()) for p in self._publishers.values())

    def _publish_vertices(self, mesh: str, message: MeshVertices | bytes) -> None:
        self.sent[mesh] += 1
        self._publishers[topic_names.vertices(mesh)].publish(message)

    def tick(self, tick: int) -> None:
        """Send the frame that belongs to `tick`, and now and then what else there is."""
        frame, stamp = self._send_frame(tick)
        if self._count % WRONG_EVERY == 0:
            faces, version = self._scene.faces(frame.index)[0], self._player.version(self.victim)
            self.wrong_messages.send_one(frame[0], faces, version, stamp)
        if self._count % UNKNOWN_EVERY == 0:
            self.misspelt_sent += 1
            self._misspelt.publish(mesh_messages.vertices_message(frame[0][:9], stamp))
        if self._count % REQUEST_EVERY == 0:
            self._request(right=self._count % (3 * REQUEST_EVERY) != 0)

    def fill_segment(self) -> None:
        """Send, to a node that is held up, as much as the shared memory of this process holds: the pages that a reader
        has ever seen count as its own, and how many these are is else a matter of how long it is once held up."""
        large = mesh_messages.vertices_message(np.zeros((MOST_VERTICES, 3), np.float32), 1)
        for _ in range(SEGMENT // (12 * MOST_VERTICES) + 1):
            self.misspelt_sent += 1
            self._misspelt.publish(large)

    def end(self, tick: int) -> None:
        """Send one more right frame: a message cut off is seen as a gap only once another comes behind it."""
        self._send_frame(tick)

    def _send_frame(self, tick: int) -> tuple[scenes.Frame, int]:
        frame = self._scene.frame(self._count % self._scene.n_frames)
        stamp = restarted_publisher.stamp_of(tick, self._rate)
        changed = False
        for message in self._player.messages(frame, stamp):
            mesh, kind = message.topic.split("/")[1:]
            if kind == "vertices":
                self._publish_vertices(mesh, message.data)
            else:
                changed = True
                self.topologies += 1
                self._publishers[message.topic].publish(message.data)
        self._generation += changed
        self._frames[stamp] = (self._generation, frame.index, restarted_publisher.frame_of(tick, self._strip))
        if len(self._frames) > HISTORY:
            self._frames.popitem(last=False)
        self._count += 1
        return frame, stamp

    def _request(self, right: bool) -> None:
        number = self._count // REQUEST_EVERY
        k, query = number % (self._strip.n_frames - 1), QUERIES[number % len(QUERIES)]
        faces = self._strip.meshes[0].faces
        start, end = (self._strip.frame(i)[0] for i in (k, k + 1))
        request = Detect.Request(
            mesh_names=["strip"],
            topologies=[mesh_messages.topology_message(faces, len(start))],
            start=[mesh_messages.vertices_message(start, 1)],
            end=[mesh_messages.vertices_message(end if right else end[:-1], 2)],
            query=query,
        )
        self.requests += 1
        self._replies.append((self._client.call_async(request), k, query, right))

    def look_at_replies(self) -> None:
        """Check the replies that have come."""
        for future, k, query, right in [r for r in self._replies if r[0].done()]:
            reply = future.result()
            self.replies += 1
            if reply.success != right:
                self.wrong.append(f"request for frame {k}: success {reply.success}: {reply.message}")
            elif right:
                detector = hc.Detector(scenes.core_scene(self._strip), accuracy=TIER, threads=1)
                motion = [self._strip.frame(i)[0] for i in (k, k + 1)]
                if query == "contacts":
                    same = reply.contacts.hash == detector.detect(*motion).hash
                else:
                    same = reply.collision_free_step == detector.collision_free_step(*motion)
                if not same:
                    self.wrong.append(f"reply for frame {k} is not the core's, query {query}")
        self._replies = [r for r in self._replies if not r[0].done()]

    @property
    def open_requests(self) -> int:
        return len(self._replies)

    def _on_contacts(self, message: ContactArray) -> None:
        self.answers += 1
        self.truncated += message.truncated
        if self.answers % self._check_every:
            return
        start, end = (self._frames.get(fields.stamp_to_ns(s)) for s in (message.start, message.header.stamp))
        if start is None or end is None:
            self.wrong.append(f"an answer for step {message.step} names a time that was not sent, or long ago")
            return
        if start[0] != end[0]:
            self.wrong.append(f"the answer for step {message.step} spans a change of topology")
            return
        meshes = (*self._scene.meshes, *self._strip.meshes)
        faces = (*self._scene.faces(end[1]), *self._strip.faces())
        begin, positions = (
            [*self._scene.frame(index), self._strip.frame(of_strip)[0]] for _, index, of_strip in (start, end)
        )
        scene = hc.Scene()
        for mesh, triangles, xyz in zip(meshes, faces, positions, strict=True):
            scene.add_mesh(
                mesh.name, triangles, static=mesh.static, self_collision=mesh.self_collision, n_vertices=len(xyz)
            )
        detector = hc.Detector(scene, accuracy=TIER, threads=1)
        expected = detector.detect(np.concatenate(begin), np.concatenate(positions))
        self.checked += 1
        if message.hash != expected.hash or message.total != len(expected):
            self.wrong.append(
                f"the answer for step {message.step}, {message.start.sec}.{message.start.nanosec:09} to "
                f"{message.header.stamp.sec}.{message.header.stamp.nanosec:09}, has {message.total} contacts, the core "
                f"alone finds {len(expected)}; {self._differences(message, expected, meshes, faces, positions)}"
            )

    @staticmethod
    def _differences(message: ContactArray, expected, meshes, faces, vertices) -> str:
        """What an answer has otherwise than the core."""
        offsets = [np.cumsum([0, *(len(rows) for rows in part)]) for part in (vertices, faces)]
        layout = Layout(tuple(mesh.name for mesh in meshes), *offsets)
        if message.truncated:
            return "cut off, so not compared"
        found = contact_messages.read_contacts(message, layout)
        said = []
        for kind in ("ee", "vf"):
            here, there = getattr(found, kind), getattr(expected, kind)
            if here.shape != there.shape or not (here == there).all():
                said.append(f"other {kind} pairs")
                continue
            off = np.nonzero(getattr(found, kind + "_toc") != getattr(expected, kind + "_toc"))[0]
            if len(off):
                k = off[0]
                times = (getattr(c, kind + "_toc")[k] for c in (found, expected))
                said.append(f"{len(off)} {kind} times differ, first that of {here[k].tolist()}: {list(times)}")
        return "; ".join(said) or "the arrays are equal: only the hash differs"
