# SPDX-License-Identifier: Apache-2.0
"""From the topics of the meshes to detections: connects subscriptions, pipeline and detection thread."""

import itertools
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

from rclpy.node import Node

from hpccd_core import Cancelled, MeshFileError, load_mesh
from hpccd_ros.base.quoting import counted
from hpccd_ros.detect.core import CORE_ERRORS, unusable_topology
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import Detection, StepDetector
from hpccd_ros.detect.thread import DetectionThread
from hpccd_ros.frames import taken_inputs
from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.rigid_mesh import mesh_of_file
from hpccd_ros.frames.types import Outcome, SceneFrame, Topology
from hpccd_ros.middleware import graph, message_types, resources
from hpccd_ros.node import configuration
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.configuration import Configuration
from hpccd_ros.node.input_subscription import hand_over
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.mesh_subscriptions import MeshSubscriptions, Reception
from hpccd_ros.node.motion_subscriptions import JointSubscriptions, TransformSubscriptions
from hpccd_ros.node.stop_watch import StopWatch
from hpccd_ros.params import robot_parameters, scene_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.robots.joint_frames import JointFrames

# Inputs without messages that are reported at a time.
_MOST_SILENT = 10


class StreamDetection:
    """Created when a node with meshes or robots is configured; active between ``open`` and ``close``.

    Raises MeshFileError, and ValueError for a scene that cannot move.
    """

    def __init__(
        self, node: GuardedLifecycleNode, configuration: Configuration, builder: SceneBuilder, accounts: Accounts
    ) -> None:
        settings, meshes = configuration.settings, configuration.meshes
        self._node = node
        self._configuration = configuration
        self._builder = builder
        self._accounts = accounts
        accounts.inputs.restart()
        accounts.heard.clear()
        self._restart_after = settings["restart_after"]
        self._pipeline, self._by_joints = self._made()
        accounts.add(_load_files(self._pipeline, meshes, settings["points"]))
        self._subscriptions = Subscriptions(node, settings, meshes)
        self._thread: DetectionThread | None = None
        self._on_detection: Callable[[Detection], None] = lambda found: None
        self._stop: StopWatch | None = None

    def open(self, on_detection: Callable[[Detection], None], stop: StopWatch | None = None) -> None:
        """Start the detection thread, which calls ``on_detection``, and has ``stop`` look at each step; subscribe."""
        self._on_detection, self._stop = on_detection, stop
        self._start()
        self._subscriptions.open(self._pipeline, self._by_joints, self._accounts)

    def remake(self, builder: SceneBuilder) -> None:
        """Build the scene with the robots that are known now. Topologies, static positions, shapes, transforms and
        frames of meshes that wait for others stay; those of robots are requested again."""
        works = self._thread is not None
        if works and self._stop is not None:
            self._stop.end()
        before, self._builder = self._pipeline, builder
        self._accounts.inputs.add(taken_inputs.robots_known(list(self._configuration.robots)), 0)
        self._pipeline, self._by_joints = self._made()
        inherited = self._pipeline.inherit(before, self._configuration.meshes)
        self._accounts.add(before.stop())
        if not works:
            return
        self._end_thread()
        self._start()
        self._subscriptions.use(self._pipeline, self._by_joints)
        for outcome in (inherited, *self._pipeline.retry()):
            hand_over(outcome, self._pipeline, self._accounts)

    def _made(self) -> tuple[FramePipeline, dict[str, JointFrames]]:
        settings, robots = self._configuration.settings, self._configuration.robots
        most_waiting = settings["pending_frames"]
        by_joints = robot_parameters.followers(settings, robots, most_waiting)
        meshes = self._configuration.meshes
        return (scene_parameters.frame_pipeline(settings, meshes, most_waiting, robots, by_joints.values()), by_joints)

    def _start(self) -> None:
        stop = self._stop
        if stop is not None:
            stop.begin(self._builder)
            self._accounts.on_rejected = stop.rejected
            self._accounts.on_received = stop.received
        thread = DetectionThread(
            StepDetector(self._builder, self._configuration.options),
            self._pipeline.start(self._configuration.settings["frame_queue"]),
            on_step=stop.look if stop is not None else lambda start, end: None,
            on_detection=self._on_detection,
            on_first=lambda frame: self._first(frame, stop),
            on_failure=self._failed,
        )
        thread.start()
        self._thread = thread

    def close(self) -> None:
        """Unsubscribe and end the thread; waiting frames are counted as stopped. Topologies and static positions
        stay."""
        self._subscriptions.close()
        self._accounts.inputs.add(taken_inputs.STOPPED, 0)
        self._accounts.add(self._pipeline.stop())
        self._end_thread()

    def _end_thread(self) -> None:
        if self._thread is not None:
            self._thread.cancel()
            self._thread.join()
            self._thread = None

    def apply_change(self) -> None:
        """Apply changed parameters."""
        count = self._configuration.settings["restart_after"]
        if count != self._restart_after:
            self._accounts.inputs.add(taken_inputs.RESTART_AFTER, count)
            self._restart_after = count
        self._pipeline.set_restart_after(count)
        if self._thread is not None:
            self._thread.detector.options = self._configuration.options

    def works(self) -> bool:
        """Whether the detection thread processes a frame now; from any thread."""
        thread = self._thread
        return thread is not None and thread.working_on is not None

    @property
    def waiting(self) -> int:
        """Received messages that are neither processed nor dropped yet."""
        waiting = self._pipeline.waiting  # before the thread is looked at: it takes over what leaves the queue
        worked_on = self._thread.working_on if self._thread is not None else None
        return waiting + (len(worked_on.fresh) if worked_on is not None else 0)

    @property
    def coordinate_frame(self) -> tuple[str, str]:
        """(frame_id of the scene or "", its origin)."""
        return self._pipeline.coordinate_frame

    def topologies(self) -> dict[str, Topology | None]:
        """Mesh name -> its current topology, in the order of the scene."""
        return {mesh.name: self._pipeline.topology(mesh.name) for mesh in self._builder.meshes}

    def warnings(self) -> list[str]:
        """Warnings about the publishers."""
        robots = self._configuration.robots
        of_links = [
            self._by_joint_states([name])
            + lines[0]
            + (f"; {counted(len(lines) - 1, 'more link')} of it waiting" if len(lines) > 1 else "")
            for name, robot in robots.items()
            if (lines := [line for mesh in robot.meshes for line in self._pipeline.awaited_transform(mesh.name)])
        ]
        no_frame = [self._by_joint_states(robots) + line for line in self._pipeline.no_frame()]
        return self._subscriptions.warnings() + of_links + self._pipeline.warnings() + no_frame

    def _by_joint_states(self, robots: Iterable[str]) -> str:
        """For the beginning of a warning that transforms are missing: the topic of joint states that may move the first
        of these robots that waits for transforms; "": there is none."""
        waiting = {mesh.partition("/")[0] for mesh in self._pipeline.unplaced()}
        robot = next((name for name in robots if name in waiting), "")
        topics = graph.published(self._node, message_types.JOINT_STATES) if robot else set()
        if not topics:
            return ""
        here = self._node.resolve_topic_name("x").removesuffix("x")
        unlike = {
            name: (not name.startswith(here), robot not in name, not name.endswith("/joint_states"), name)
            for name in topics
        }
        topic = min(topics, key=unlike.__getitem__)
        return (
            f"robot {robot} waits for transforms, and {topic} has publishers; if this topic moves it, set "
            f"{ROBOT}.{robot}.joint_states: {topic}; "
        )

    def silent(self) -> list[str]:
        """Which messages have stopped, or have not begun, to come."""
        return self._subscriptions.silent()

    def rejected(self) -> list[str]:
        """Which messages that are sent once were rejected; the log has each."""
        return self._subscriptions.rejected()

    def _first(self, frame: SceneFrame, stop: StopWatch | None) -> None:
        """Called by the detection thread."""
        if stop is not None:
            stop.first()
        self._accounts.metrics.first_frame(len(frame.fresh))

    def _failed(self, frame: SceneFrame, error: Exception) -> None:
        """Called by the detection thread."""
        stopped = isinstance(error, Cancelled)
        self._accounts.not_processed(frame, Reason.STOPPED if stopped else Reason.DETECTION_FAILED)
        if stopped or not self._node.context.ok():
            return  # shutting down: the publisher is gone, nothing failed
        if not isinstance(error, CORE_ERRORS):
            self._node.errors.caught("detection", error)
        self._accounts.failed(frame, error)


class Subscriptions:
    """Nothing is subscribed before ``open``; ``close`` ends all subscriptions, even after ``open`` failed half-way.

    meshes: mesh name -> parameters mesh.NAME.*.
    """

    def __init__(self, node: Node, settings: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> None:
        self._node = node
        self._settings = settings
        self._meshes = meshes
        self._of_meshes: list[MeshSubscriptions] = []
        self._of_others: list[TransformSubscriptions | JointSubscriptions] = []

    def open(self, pipeline: FramePipeline, by_joints: Mapping[str, JointFrames], accounts: Accounts) -> None:
        """by_joints: robot -> what its joint states move, of those that are known."""
        if configuration.uses_transforms(self._settings, self._meshes):
            transforms = TransformSubscriptions(self._node, pipeline, accounts, self._settings["max_rate"])
            self._of_others.append(transforms)
        if robot_parameters.joint_topics(self._settings[ROBOT]):
            joints = JointSubscriptions(self._node, self._settings, pipeline, by_joints, accounts)
            self._of_others.append(joints)
        for name, mesh in self._meshes.items():
            reception = Reception(self._node, name, self._settings, pipeline, accounts)
            self._of_meshes.append(MeshSubscriptions(reception, mesh))

    def use(self, pipeline: FramePipeline, by_joints: Mapping[str, JointFrames]) -> None:
        """Send messages to this pipeline from now on."""
        for part in (*self._of_meshes, *self._of_others):
            part.use(pipeline, by_joints)

    def close(self) -> None:
        for subscriptions in (*self._of_meshes, *self._of_others):
            subscriptions.close()
        self._of_meshes.clear()
        self._of_others.clear()

    def warnings(self) -> list[str]:
        """Warnings about the publishers."""
        return [line for part in (*self._of_meshes, *self._of_others) for line in part.warnings()]

    def rejected(self) -> list[str]:
        """Messages that are sent once and were rejected."""
        return [line for part in self._of_meshes for line in part.rejected()]

    def silent(self) -> list[str]:
        """Which messages have stopped, or have not begun, to come; the first few, as each costs a look at the graph."""
        parts = (*self._of_meshes, *self._of_others)
        return list(itertools.islice((line for part in parts for line in part.silent()), _MOST_SILENT))


def _load_files(pipeline: FramePipeline, meshes: dict[str, dict[str, Any]], points: Collection[str]) -> Outcome:
    """Read them into the pipeline. meshes: name -> parameters mesh.NAME.*. points: that parameter. Raises
    MeshFileError."""
    outcome = Outcome()
    for name, mesh in meshes.items():
        if mesh["file"]:
            vertices, faces = load_mesh(resources.local_path(mesh["file"]))
            topology, positions = mesh_of_file(vertices, faces, mesh)
            if why := unusable_topology(topology, name, name in points):
                raise MeshFileError(f"mesh.{name}.file {mesh['file']}: {why}")
            outcome += pipeline.load(name, topology, positions)
    return outcome
