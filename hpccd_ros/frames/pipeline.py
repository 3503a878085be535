# SPDX-License-Identifier: Apache-2.0
"""Turns a checked message into frames of the scene: transform, assemble, queue. No ROS, no threads."""

import time
from collections.abc import Collection, Sequence

from hpccd_core.rigid.transform import IDENTITY
from hpccd_ros.frames.assembler import FrameAssembler
from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.frames.follower import Follower
from hpccd_ros.frames.frame_queue import FrameQueue
from hpccd_ros.frames.requested_times import RequestedTimes
from hpccd_ros.frames.rigid_mesh import RigidMesh
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.transformer import MeshTransformer, Transformed
from hpccd_ros.frames.types import (
    ALWAYS,
    JOINTS,
    TF,
    AssemblyRules,
    MeshFrame,
    MeshSettings,
    Outcome,
    PoseFrame,
    SceneFrame,
    Topology,
)


class FramePipeline:
    """The node and a replay push messages of the ``meshes``; the pipeline returns frames of the scene and rejections.

    followers: of the meshes whose ``input`` is JOINTS, each mesh in exactly one. transforms: filled by the caller, like
    the samples of the followers; call `retry` afterwards.
    """

    def __init__(
        self, meshes: Sequence[MeshSettings], rules: AssemblyRules, followers: Sequence[Follower] = ()
    ) -> None:
        self._meshes = tuple(meshes)
        self._rules = rules
        self._queue: FrameQueue | None = None
        self._rigid = {mesh.name: RigidMesh(mesh) for mesh in self._meshes if mesh.rigid}
        others = (mesh.name for mesh in self._meshes if not mesh.static and mesh.input not in (TF, JOINTS))
        # The mesh whose stamps are those of the scene's frames; None: all frames are requested.
        self._leader = next(others, None)
        asked = [mesh.name for mesh in self._meshes if mesh.input in (TF, JOINTS)]
        self._assembler = FrameAssembler(self._meshes, rules, asked if self._leader is not None else [])
        by_transforms = [mesh for mesh in self._meshes if mesh.input == TF]
        self._requested = RequestedTimes(by_transforms, tuple(followers), rules.frame_id)
        self._use_transforms(TransformBuffer())

    def load(self, mesh: str, topology: Topology, positions: MeshFrame | None) -> Outcome:
        """Load a mesh from a file. positions: of a static mesh, in the scene's frame; of one that moves by poses, as in
        the file."""
        outcome = self._assembler.set_topology(mesh, topology)
        if positions is not None and mesh in self._rigid:
            if (rejection := self._rigid[mesh].set_shape(positions)) is not None:
                outcome.rejections.append(rejection)
        elif positions is not None:
            outcome += self._assembler.add(mesh, positions)
        outcome.static_taken = 0  # they did not come by a message
        return outcome

    def inherit(self, other: "FramePipeline", meshes: Collection[str]) -> Outcome:
        """Take over transforms, and topologies, static positions, shapes and waiting frames of these meshes, which both
        have. Call it before anything is pushed; ``other`` must then only be stopped."""
        self._use_transforms(other.transforms)
        for name in meshes:
            self._transformers[name] = other._transformers.pop(name)
        for name in set(meshes) & set(self._rigid):
            self._rigid[name] = other._rigid[name]
        return self._led(self._assembler.inherit(other._assembler, meshes))

    def push(self, mesh: str, message: MeshFrame | PoseFrame | Topology, new_publisher: bool = False) -> Outcome:
        """Add a message of ``mesh``. new_publisher: it is the first of its publisher, or the first readable one."""
        if isinstance(message, Topology):
            return self._led(self._assembler.set_topology(mesh, message, new_publisher))
        if isinstance(message, MeshFrame) and mesh in self._rigid:
            rejection = self._rigid[mesh].set_shape(message)
            return Outcome(rejections=[rejection]) if rejection is not None else Outcome(static_taken=1)
        self._assembler.hear(mesh, message.received)
        return self._place(mesh, message, new_publisher)

    def retry(self) -> list[Outcome]:
        """Continue frames whose transforms have arrived, with an outcome for each: one transform may complete many."""
        found = [self._ask_for_latest()] if self._leader is None else []
        for mesh, transformer in self._transformers.items():
            if transformer.waiting:
                found += self._assemble(mesh, transformer.retry())
        for follower in self._requested.followers:
            if follower.waiting:
                found += self._assemble_followed(follower)
        return found

    def enqueue(self, frame: SceneFrame) -> list[Rejection]:
        """Put a complete frame into the queue; frames that it replaces are dropped."""
        return [rejection for lost in self._queue.put(frame) for rejection in lost.rejected(Reason.OVERLOAD)]

    def start(self, capacity: int) -> FrameQueue:
        """Create the queue that `enqueue` fills from now on, for this number of frames that end a step."""
        self._queue = FrameQueue(capacity)
        return self._queue

    def stop(self) -> Outcome:
        """Drop waiting messages as stopped and close the queue. Topologies and static positions stay."""
        outcome = Outcome()
        for transformer in self._transformers.values():
            outcome.rejections += transformer.clear(Reason.STOPPED)
        for follower in self._requested.followers:
            outcome.rejections += follower.clear(Reason.STOPPED)
            follower.forget()
        outcome.rejections += self._assembler.clear(Reason.STOPPED)
        for frame in self._queue.close() if self._queue is not None else ():
            outcome.rejections += frame.rejected(Reason.STOPPED)
        self._queue = None
        self._use_transforms(TransformBuffer())
        return outcome

    @property
    def waiting(self) -> int:
        """Messages whose frame is neither complete nor dropped, and those in the queue."""
        queued = self._queue.frames() if self._queue is not None else ()
        places = (*self._transformers.values(), *self._requested.followers)
        before = self._assembler.waiting + sum(place.waiting for place in places)
        return before + sum(len(frame.fresh) for frame in queued)

    @property
    def transforms(self) -> TransformBuffer:
        return self._requested.transforms

    @property
    def coordinate_frame(self) -> tuple[str, str]:
        """(frame_id of the scene or "", where it comes from)."""
        return self._assembler.coordinate_frame

    def set_restart_after(self, count: int) -> None:
        self._assembler.restart_after = count

    def moves_by_poses(self, mesh: str) -> bool:
        """Whether the vertices of ``mesh`` are its shape, and poses give its position."""
        return mesh in self._rigid

    def topology(self, mesh: str) -> Topology | None:
        """The current topology, or None."""
        return self._assembler.topology(mesh)

    def topology_rejected(self, mesh: str, why: str) -> None:
        """The last message with a topology of ``mesh`` was rejected."""
        self._assembler.topology_rejected(mesh, why)

    def awaited_transform(self, mesh: str) -> list[str]:
        """Reasons for which frames of ``mesh`` wait, in words; empty: none waits."""
        return self._transformers[mesh].warnings()

    def warnings(self) -> list[str]:
        """Static positions that are not used, and what followers are waiting for."""
        of_followers = [line for follower in self._requested.followers for line in follower.warnings()]
        return self._assembler.warnings() + of_followers

    def no_frame(self) -> list[str]:
        """If transforms or joints alone move the scene: why there is no frame."""
        return self._requested.warnings() if self._leader is None else []

    def unplaced(self) -> list[str]:
        """Names of the meshes that transforms move, of which none came."""
        return self._requested.unplaced()

    def _place(self, mesh: str, message: MeshFrame | PoseFrame, new_publisher: bool = False) -> Outcome:
        placed = self._rigid[mesh].place(message) if isinstance(message, PoseFrame) else message
        if isinstance(placed, Rejection):
            return Outcome(rejections=[placed])
        outcome = Outcome()
        for part in self._assemble(mesh, self._transformers[mesh].transform(placed, new_publisher)):
            outcome += part
        return outcome

    def _led(self, outcome: Outcome) -> Outcome:
        """Add the frames of the other meshes that are requested for accepted frames of the leader."""
        if outcome.restarts and self._leader is not None:  # before the new run is used
            outcome.rejections += self._clear_requested()
            for _, stamp, _ in outcome.joined[-1:]:
                self._requested.forget_future(stamp)
        joined, outcome.joined = outcome.joined, []
        for name, stamp, received in joined:
            if name == self._leader:
                outcome += self._ask(stamp, received)
        return outcome

    def _ask(self, stamp: int, received: float, new_publisher: bool = False) -> Outcome:
        """Request a frame of each mesh that transforms or joints move."""
        outcome = Outcome()
        for mesh in self._requested.by_transforms:
            outcome.asked.append(mesh.name)
            pose = PoseFrame(stamp, IDENTITY, mesh.frame, received, sent=ALWAYS)
            outcome += self._place(mesh.name, pose, new_publisher)
        for follower in self._requested.followers:
            outcome.asked += follower.names
            follower.ask(stamp, received, new_publisher)
            for part in self._assemble_followed(follower):
                outcome += part
        return outcome

    def _ask_for_latest(self) -> Outcome:
        """If nothing else moves: request a frame for each time that all inputs have reached."""
        requested = self._requested
        if (stamp := requested.next(self._assembler.restart_after)) is None:
            return Outcome()
        outcome = Outcome()
        if requested.reached.restarted:  # before samples of the previous run place a frame
            outcome.rejections += self._clear_requested()
            if requested.reached.set_back:
                requested.forget_future(stamp)
        outcome += self._ask(stamp, time.monotonic(), new_publisher=requested.reached.restarted)
        return outcome

    def _clear_requested(self) -> list[Rejection]:
        """Drop frames that were requested in a run that has ended."""
        rejections = []
        for mesh in self._requested.by_transforms:
            rejections += self._transformers[mesh.name].clear(Reason.RESTART)
        for follower in self._requested.followers:
            rejections += follower.clear(Reason.RESTART)
        return rejections

    def _assemble(self, mesh: str, transformed: Transformed) -> list[Outcome]:
        outcomes = [Outcome(rejections=transformed.rejections)]
        outcomes += [
            self._led(self._assembler.add(mesh, frame, new_publisher)) for frame, new_publisher in transformed.frames
        ]
        return outcomes

    def _assemble_followed(self, follower: Follower) -> list[Outcome]:
        """One outcome for each time at which the follower knows its frames now."""
        rejections, times = follower.retry(self.transforms)
        outcomes = [Outcome(rejections=rejections)]
        for frames in times:
            outcome = Outcome()
            for mesh, frame, new_publisher in frames:
                outcome += self._led(self._assembler.add(mesh, frame, new_publisher))
            outcomes.append(outcome)
        return outcomes

    def _use_transforms(self, transforms: TransformBuffer) -> None:
        self._requested.use(transforms)
        self._transformers = {
            mesh.name: MeshTransformer(mesh, self._rules.frame_id, self._rules.max_pending, transforms)
            for mesh in self._meshes
        }
