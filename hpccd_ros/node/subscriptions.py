# SPDX-License-Identifier: Apache-2.0
"""All that comes in: mesh files, topologies, vertices, transforms; joined to frames of the scene."""

from collections import Counter
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

import hpccd_core as hc
from hpccd_ros.detect.detection import CORE_ERRORS
from hpccd_ros.frames.assembler import FrameAssembler
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.mesh_file import MeshFileError, load_mesh, place
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.transformer import Placement
from hpccd_ros.frames.types import MeshFrame, MeshSettings, SceneFrame, Topology
from hpccd_ros.node.mesh_subscriptions import MeshStream
from hpccd_ros.node.status_report import Metrics
from hpccd_ros.node.transform_subscriptions import TransformInput


class Inputs:
    """Made when the node is configured; subscribed between ``open`` and ``close``.

    rows: mesh name -> parameters mesh.NAME.*, in the order of ``meshes``, of which at least one is not static.
    links: counters of the middleware (name -> count).
    Raises MeshFileError, and ValueError for a scene that cannot move.
    """

    def __init__(
        self,
        node: Node,
        settings: dict[str, Any],
        rows: dict[str, dict[str, Any]],
        meshes: tuple[MeshSettings, ...],
        *,
        drops: DropCounter,
        refused: DropCounter,
        metrics: Metrics,
        links: Counter,
    ) -> None:
        self._node = node
        self._settings = settings
        self._rows = rows
        self._drops = drops
        self._refused = refused
        self._metrics = metrics
        self._links = links
        self._streams: dict[str, MeshStream] = {}
        self._transforms: TransformInput | None = None
        self.assembler = FrameAssembler(
            list(meshes),
            drops,
            refused,
            max_pending=settings["pending_frames"],
            restart_after=settings["restart_after"],
            tolerance=round(settings["stamp_tolerance"] * 1e9) if settings["stamp_match"] == "nearest" else None,
            frame_id=settings["frame_id"],
            on_restart=node.get_logger().warning,
            only_publisher=lambda mesh: self._streams[mesh].publishers <= 1,
        )
        for name, row in rows.items():
            if row["file"]:
                self._read_file(name, row)

    def open(self, on_frames: Callable[[list[SceneFrame]], None]) -> None:
        """Subscribe; ``on_frames`` takes the scene frames that a message completes."""
        settings = self._settings
        buffer = None
        if any(row["transform"] == "tf" for row in self._rows.values()):
            buffer = TransformBuffer()
            self._transforms = TransformInput(
                self._node, buffer, settings["max_rate"], self._retry_placement, self._warn_of_transforms
            )
        for name, row in self._rows.items():  # one by one: `close` must find those that are there, should one fail
            placement = Placement(name, row, settings["frame_id"], settings["pending_frames"], self._drops, buffer)
            stream = MeshStream(
                self._node,
                name,
                row["input"],
                settings,
                placement=placement,
                assembler=self.assembler,
                drops=self._drops,
                refused=self._refused,
                metrics=self._metrics,
                links=self._links,
                on_frames=on_frames,
                check_topology=core_refusal,
            )
            self._streams[name] = stream

    def close(self) -> None:
        """Unsubscribe; frames that waited for others are counted as dropped. Topologies and static positions stay."""
        for stream in self._streams.values():
            stream.close()
        self._streams = {}
        if self._transforms is not None:
            self._transforms.close()
            self._transforms = None
        self.assembler.clear(Reason.STOPPED)

    @property
    def waiting(self) -> int:
        """Messages received that are neither handed on nor dropped yet."""
        return self.assembler.waiting + sum(stream.waiting for stream in self._streams.values())

    def warnings(self) -> list[str]:
        """What is odd about the publishers."""
        lines = [line for stream in self._streams.values() for line in stream.warnings()]
        return lines + self.assembler.warnings()

    def _read_file(self, name: str, row: dict[str, Any]) -> None:
        vertices, faces = load_mesh(row["file"])
        topology = Topology(0, len(vertices), faces)
        if why := core_refusal(topology):
            raise MeshFileError(f"mesh.{name}.file {row['file']}: {why}")
        self.assembler.set_topology(name, topology)
        if row["static"]:
            self.assembler.add(name, MeshFrame(0, place(vertices, row["pose"]), version=0))

    def _retry_placement(self) -> None:
        for stream in self._streams.values():
            stream.retry()

    def _warn_of_transforms(self, text: str) -> None:
        self._links["transforms_refused"] += 1
        self._node.get_logger().warning(text, throttle_duration_sec=10.0)


def core_refusal(topology: Topology) -> str | None:
    """Why the core cannot take this topology, in its own words, or None."""
    try:
        hc.Scene().add_mesh("mesh", topology.faces, n_vertices=topology.n_vertices)
    except CORE_ERRORS as error:
        return str(error)
    return None
