# SPDX-License-Identifier: Apache-2.0
"""Both ends of a node that watches: frames out, and when stop rose and fell."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import stop_scene
from hpccd.msg import MeshTopology, MeshVertices
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from hpccd_ros import client
from hpccd_ros.base.errors import UserError

PATIENCE = 120.0  # s


class Sender:
    """Publishes frames of the scene through `node`."""

    def __init__(self, node: Node):
        topology, vertices = client.topology_topic, client.vertices_topic
        meshes = stop_scene.MESHES
        self._topologies = [node.create_publisher(MeshTopology, topology(m), client.TOPOLOGY_QOS) for m in meshes]
        self._vertices = [node.create_publisher(MeshVertices, vertices(m), client.VERTICES_QOS) for m in meshes]

    def heard(self) -> bool:
        """Whether each publisher has a reader."""
        return all(p.get_subscription_count() for p in (*self._topologies, *self._vertices))

    def topologies(self) -> None:
        for publisher, faces in zip(self._topologies, stop_scene.FACES, strict=True):
            publisher.publish(client.topology_message(faces, n_vertices=int(faces.max()) + 1))

    def frame(self, frame: stop_scene.Frame, stamp_ns: int) -> float:
        """When its last message was handed to DDS, s of time.monotonic()."""
        messages = [client.vertices_message(positions, stamp_ns=stamp_ns) for positions in frame]
        for publisher, message in zip(self._vertices, messages, strict=True):
            at = time.monotonic()
            publisher.publish(message)
        return at


class Ears:
    """A StopListener in `node`, spun by a thread of its own; what it said, and since when."""

    def __init__(self, node: Node, stop_timeout: float):
        self.changes: list[tuple[float, bool]] = [(time.monotonic(), True)]
        self.listener = client.StopListener(
            node,
            stop_timeout=stop_timeout,
            on_change=lambda listener: self.changes.append((time.monotonic(), listener.stop)),
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._spin, name="ears", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._executor.shutdown()

    def at(self, when: float) -> bool:
        """What was said then."""
        return next(said for since, said in reversed(self.changes) if since <= when)

    def rise(self, begin: float, end: float = float("inf")) -> float | None:
        """When it was first true within that time; None: never."""
        if self.at(begin):
            return begin
        return next((since for since, said in self.changes if begin < since <= end and said), None)

    def until(self, stop: bool, alive: Callable[[], None] = lambda: None) -> float:
        """Wait until it reads so; when that was. It is read each half of a millisecond. UserError where it does not."""
        deadline = time.monotonic() + PATIENCE
        while self.listener.stop != stop:
            if time.monotonic() > deadline:
                raise UserError(f"stop was not {stop} within {PATIENCE:.0f} s: {self.listener.reason}")
            alive()
            time.sleep(0.0005)
        return time.monotonic()
