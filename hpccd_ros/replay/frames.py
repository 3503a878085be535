# SPDX-License-Identifier: Apache-2.0
"""From recorded messages to frames of the scene, by the node's own rules."""

from collections import OrderedDict

from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.frames.assembler import FrameAssembler
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.sequence import SequenceWatch
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.transformer import Placement, Ready
from hpccd_ros.frames.types import MeshFrame, SceneFrame
from hpccd_ros.middleware import fields, mesh_messages, transform_topics
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.middleware.transform_topics import TransformTopic
from hpccd_ros.replay.recorded_setup import ReplaySetup


class FrameSource:
    """Assembles frames of the scene from recorded messages.

    drops, refused: what could not be used and why, counted as in the node. transforms_refused: by topic.
    """

    def __init__(self, setup: ReplaySetup, topics):
        settings = setup.settings
        # Messages of several topics may have reached the recorder in another order than the node.
        pending = 4 * settings["pending_frames"]
        self._setup = setup
        self.drops = DropCounter()
        self.refused = DropCounter()
        self.transforms_refused = DropCounter()
        self._decoders = {name: make_decoder(topics[name]) for name in setup.roles if name in topics}
        self._watches = {name: SequenceWatch() for name in setup.roles}
        self._unnoticed: set[str] = set()  # topics where the first message of a new publisher was refused
        self._assembler = FrameAssembler(
            list(setup.builder.meshes),
            self.drops,
            self.refused,
            max_pending=pending,
            restart_after=settings["restart_after"],
            tolerance=round(settings["stamp_tolerance"] * 1e9) if settings["stamp_match"] == "nearest" else None,
            frame_id=settings["frame_id"],
        )
        self._transforms = TransformBuffer()
        self._placements = {
            mesh: Placement(mesh, row, settings["frame_id"], pending, self.drops, self._transforms)
            for mesh, row in setup.meshes.items()
        }
        for mesh, (topology, frame) in setup.files.items():
            self._assembler.set_topology(mesh, topology)
            if frame is not None:
                self._assembler.add(mesh, frame)

    @property
    def topics(self) -> list[str]:
        return list(self._decoders)

    def take(self, message) -> list[SceneFrame]:
        """Frames that this recorded message completes."""
        mesh, kind = self._setup.roles[message.topic]
        decoded = self._decoders[message.topic](message)
        if kind in transform_topics.ALL:
            return self._take_transforms(decoded, transform_topics.ALL[kind])
        watch = self._watches[message.topic]
        _, new_publisher = watch.next(message.sequence) if message.sequence else (0, False)
        settings = self._setup.settings
        if kind == "topology":
            try:
                topology = mesh_messages.topology_from_message(decoded, settings["max_vertices"], settings["max_faces"])
            except InvalidMessageError as error:
                self.refused.count(mesh, error.reason, str(error))
                return []
            return self._assembler.set_topology(mesh, topology, new_publisher)
        if new_publisher:
            self._unnoticed.add(message.topic)
        try:
            stamp = fields.stamp_to_ns(decoded.header.stamp)
            if kind == "vertices":
                vertices = mesh_messages.vertices_from_message(decoded, settings["max_vertices"])
                version, step = decoded.topology_version, decoded.step
            else:
                vertices = mesh_messages.vertices_from_cloud(decoded, settings["max_vertices"])
                version = step = None
        except InvalidMessageError as error:
            self.drops.count(mesh, error.reason, str(error))
            return []
        new_publisher = message.topic in self._unnoticed
        self._unnoticed.discard(message.topic)
        frame = MeshFrame(stamp, vertices, version, step, decoded.header.frame_id)
        return self._assemble(mesh, self._placements[mesh].take(frame, new_publisher))

    def _take_transforms(self, message, topic: TransformTopic) -> list[SceneFrame]:
        for transform in transform_topics.in_message(message):
            try:
                transform_topics.keep(self._transforms, transform, topic.static)
            except ValueError as error:
                self.transforms_refused.count(topic.name, Reason.MALFORMED, str(error))
        return [
            frame for mesh, placement in self._placements.items() for frame in self._assemble(mesh, placement.retry())
        ]

    def _assemble(self, mesh: str, placed: list[Ready]) -> list[SceneFrame]:
        return [frame for of_mesh, new in placed for frame in self._assembler.add(mesh, of_mesh, new)]


class FrameWindow:
    """The last frames, by stamp: answers name the two frames between which they were found."""

    def __init__(self, capacity: int):
        self._capacity = capacity
        self._frames: OrderedDict[int, SceneFrame] = OrderedDict()
        self.first: int | None = None  # stamp of the very first frame

    def put(self, frame: SceneFrame) -> None:
        if self.first is None:
            self.first = frame.stamp
        self._frames.pop(frame.stamp, None)  # after a restart of the stream, a stamp may come again
        self._frames[frame.stamp] = frame
        if len(self._frames) > self._capacity:
            self._frames.popitem(last=False)

    def get(self, stamp: int) -> SceneFrame | None:
        return self._frames.get(stamp)


