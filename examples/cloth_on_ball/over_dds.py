# SPDX-License-Identifier: Apache-2.0
"""The solver's questions to an hpccd node over DDS: its service ~/detect, and each frame on its topics."""

import contextlib
import os
import tempfile
import time
from pathlib import Path

import numpy as np
import rclpy
from cloth_solver.queries import Queries
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from hpccd.srv import Detect
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from hpccd_ros import client
from hpccd_ros.base.errors import UserError
from hpccd_ros.demo.children import Children
from hpccd_ros.middleware.fields import stamp_to_ns
from hpccd_ros.scenes import files

# s for the node to be there, or to respond.
PATIENCE = 60.0
# QoS of every response.
ACCURACY = "exact"
# Outputs that the solver needs besides the contacts; no limit on their number.
PARAMETERS = {"outputs": ["normals", "weights"], "max_contacts": 0}


def write_parameters(scene, path: Path) -> None:
    """Write parameters of a node that knows the meshes and handles these queries."""
    files.write_parameters(scene, path)
    with open(path, "a", encoding="utf-8") as file:
        for name, value in PARAMETERS.items():
            file.write(f"    {name}: {value}\n")


@contextlib.contextmanager
def started_node(scene, threads: int, recording: Path | None):
    """Start a node for these meshes in a DDS domain of its own, and end it; its name."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    with tempfile.TemporaryDirectory(prefix="cloth_on_ball") as folder, Children(Path(folder)) as children:
        parameters = Path(folder) / "node.yaml"
        write_parameters(scene, parameters)
        record = ["-p", f"record:={recording.resolve()}"] if recording else []
        child = children.start(
            "node",
            "hpccd_ros.node",
            "--ros-args",
            "--params-file",
            str(parameters),
            "-p",
            f"threads:={threads}",
            *record,
        )
        yield "hpccd"
        children.check()
        if children.end(child) != 0:
            children.check()


class OverDds(Queries):
    """Asks the node of this name. Each frame that is made is streamed to it, and its response awaited."""

    def __init__(self, setup, meshes, name: str):
        super().__init__()
        self._setup, self._meshes, self._name = setup, meshes, name
        self._ends = np.cumsum([mesh.n_vertices for mesh in meshes])[:-1]
        topologies = tuple(client.Topology(0, mesh.n_vertices, mesh.faces) for mesh in meshes)
        self._layout = client.Layout.of(tuple(mesh.name for mesh in meshes), topologies)
        client.prepare_environment()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node("cloth_on_ball", start_parameter_services=False)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._service = self._node.create_client(Detect, f"{name}/detect")
        self._last_result = -1
        self._node.create_subscription(ContactArray, client.CONTACTS_TOPIC, self._take, QoSProfile(depth=10))
        self._vertices = [
            self._node.create_publisher(MeshVertices, client.vertices_topic(mesh.name), client.VERTICES_QOS)
            for mesh in meshes
        ]
        self._topologies = [
            self._node.create_publisher(MeshTopology, client.topology_topic(mesh.name), client.TOPOLOGY_QOS)
            for mesh in meshes
        ]
        for publisher, mesh in zip(self._topologies, meshes, strict=True):
            publisher.publish(client.topology_message(mesh.faces, mesh.n_vertices))
        self._frames, self._begin = 0, self._node.get_clock().now().nanoseconds

    def __enter__(self):
        self._await(self._service.service_is_ready, f"no node {self._name} responds: start one, or name another")
        self._await(
            lambda: all(p.get_subscription_count() for p in (*self._topologies, *self._vertices)),
            f"node {self._name} does not listen to these meshes: start it with the file that --params writes",
        )
        return self

    def __exit__(self, *_):
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def near(self, start, end):
        with self._timed():
            question = {"query": "contacts", "minimum_separation": [self._setup.reach]}
            response = self._ask(self._request(start, end, **question)).contacts
            found = client.scene_contacts(response, self._layout)
            if not response.total == len(found.normals) == len(found.weights):
                raise UserError(
                    f"node {self._name} leaves out pairs, normals or weights: start it with the file that "
                    "--params writes"
                )
            return found

    def free_part(self, start, end):
        with self._timed():
            request = client.collision_free_step_request(
                self._by_mesh(start), self._by_mesh(end), accuracy=ACCURACY, minimum_separation=self._setup.clearance
            )
            return client.collision_free_step_from_response(self._ask(request))

    def intersections(self, positions):
        with self._timed():
            return self._ask(self._request(positions, positions, query="intersections")).contacts.total

    def made(self, positions):
        """Stream the frame, and wait for the node's response to the step that it ends: nothing is dropped."""
        stamp = self._begin + round(self._frames * self._setup.period * 1e9)
        for publisher, message in zip(self._vertices, self._messages(positions, stamp), strict=True):
            publisher.publish(message)
        if self._frames:  # the first frame only begins a step
            self._await(
                lambda: self._last_result >= stamp, f"node {self._name} returned no result for frame {self._frames}"
            )
        self._frames += 1

    def _by_mesh(self, positions):
        return dict(zip((mesh.name for mesh in self._meshes), np.split(positions, self._ends), strict=True))

    def _messages(self, positions, stamp):
        return [client.vertices_message(x, stamp, step=self._frames) for x in self._by_mesh(positions).values()]

    def _request(self, start, end, **question):
        names = [mesh.name for mesh in self._meshes]
        return Detect.Request(
            mesh_names=names, start=self._messages(start, 0), end=self._messages(end, 1), accuracy=ACCURACY, **question
        )

    def _ask(self, request):
        deadline = time.monotonic() + PATIENCE
        while True:
            future = self._service.call_async(request)
            self._executor.spin_until_future_complete(future, timeout_sec=PATIENCE)
            response = future.result() if future.done() else None
            if response is not None and response.success:
                return response
            # At first it may not have the topologies yet.
            if response is None or self._frames or time.monotonic() > deadline:
                raise UserError(
                    f"node {self._name}: {response.message if response else f'no response in {PATIENCE:.0f} s'}"
                )
            time.sleep(0.1)

    def _await(self, ready, otherwise):
        deadline = time.monotonic() + PATIENCE
        while not ready():
            if time.monotonic() > deadline:
                raise UserError(otherwise)
            self._executor.spin_once(timeout_sec=0.05)

    def _take(self, message):
        self._last_result = max(self._last_result, stamp_to_ns(message.header.stamp))
