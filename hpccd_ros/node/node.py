# SPDX-License-Identifier: Apache-2.0
"""The node: life cycle and wiring."""

import contextlib
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from hpccd.msg import ContactArray
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from hpccd_ros.base import quoting
from hpccd_ros.detect import detection
from hpccd_ros.detect.detection import CORE_ERRORS, Detection, DetectionThread, Options
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.frame_queue import FrameQueue
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.middleware import (
    contact_messages,
    environment,
    fields,
    qos,
    qos_overrides,
    ros_start,
    stop_signals,
    topic_names,
)
from hpccd_ros.middleware.guard import GuardedExecutor
from hpccd_ros.middleware.unreadable import UnreadableExecutor
from hpccd_ros.node import node_recording, parameter_services
from hpccd_ros.node.detect_service import DetectService, NodeScene, new_counts
from hpccd_ros.node.diagnostics import Metrics, Reporter
from hpccd_ros.node.inputs import Inputs
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.markers import contact_markers, surface_cloud
from hpccd_ros.node.node_recording import NodeRecording
from hpccd_ros.node.refusal_log import RefusalLog
from hpccd_ros.node.unknown_meshes import UnknownMeshWatch
from hpccd_ros.params import parameters, scene_parameters
from hpccd_ros.params.parameters import ParameterError
from hpccd_ros.params.table import OUTPUTS

YIELD = 2e-5  # s; what counts is that it is not 0
# s. Once in so long, the pages that a message takes anew cost little; a node that once had to hold much, because its
# machine was busy for seconds, is not larger ever after.
GIVE_BACK_EVERY = 60.0


class _Executor(UnreadableExecutor, GuardedExecutor):
    """No callback ends the node, and no message is lost without a word."""


class HpccdNode(GuardedLifecycleNode):
    """Streams of vertices in, contacts out. To be run by a GuardedExecutor.

    Configured: parameters checked, mesh files read, publishers and service there. Active: subscribed,
    detecting.
    Raises ParameterError for parameters that it cannot start with.
    """

    def __init__(self) -> None:
        super().__init__("hpccd")
        parameter_services.refuse_unknown_types(self)
        self._settings, self._mesh_settings = parameters.declare(self)
        scene_parameters.check(self._settings, self._mesh_settings)
        if why := topic_names.unusable_name(self, self._mesh_settings) or qos_overrides.unusable_override(self):
            raise ParameterError(why)
        for name in parameters.unknown_overrides(self, qos_overrides.known(self, self._mesh_settings)):
            text = f"parameter {quoting.shortened(name)} is unknown and has no effect; see docs/parameters.md"
            self.get_logger().warning(text)
        self._options = _options(self._settings)
        if why := detection.refusal(self._options):
            raise ParameterError(why)
        if why := node_recording.refusal(self._settings):
            raise ParameterError(why)
        self._recording = NodeRecording(self, self._settings, self.errors)
        parameters.watch(
            self,
            self._settings,
            self._mesh_settings,
            configured=lambda: self._service is not None,
            check=self._check_change,
            on_change=self._apply_change,
        )

        self._log = RefusalLog(self.get_logger().warning)
        self._drops = DropCounter(self._log)
        self._refused = DropCounter(self._log)
        self._metrics = Metrics()
        self._links: Counter = Counter()
        self._reporter = Reporter(self.get_fully_qualified_name(), self._metrics, self._drops, self._refused)
        self._inputs: Inputs | None = None
        self._before: Counter = Counter()  # restarts, static_taken: counts of inputs that are gone
        self._unknown: UnknownMeshWatch | None = None
        self._service: DetectService | None = None
        self._served = new_counts()
        self._configured = contextlib.ExitStack()  # how to undo on_configure
        self._queue: FrameQueue | None = None
        self._thread: DetectionThread | None = None
        self._markers_after = 0.0

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read mesh files, create publishers, service and diagnostics."""
        settings = self._settings
        self._builder = scene_parameters.scene_builder(settings, self._mesh_settings)
        self._deforming = [mesh.name for mesh in self._builder.meshes if not mesh.static]
        try:
            self._inputs = self._make_inputs() if self._builder.meshes else None
        except ValueError as error:
            self.get_logger().error(f"cannot configure: {error}")
            return TransitionCallbackReturn.FAILURE
        self._contacts = self._publisher(ContactArray, "contacts", qos.CONTACTS)
        self._markers = self._publisher(MarkerArray, "markers", qos.MARKERS)
        self._surface = self._publisher(PointCloud2, "surface", qos.MARKERS)
        self._diagnostics = self._publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self._service = DetectService(
            self, settings, lambda: self._options, self._scene_for_service, self._served, self.errors
        )
        self._steady_timer(settings["diagnostics_period"], self._report)
        self._steady_timer(GIVE_BACK_EVERY, environment.give_back_freed_memory)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the detection thread and subscribe."""
        self._recording.follow(active=True)  # first: what the node hears, the recording shall have
        if self._inputs is not None:
            self._queue = FrameQueue(self._settings["frame_queue"])
            thread = DetectionThread(
                self._builder,
                self._queue,
                self._drops,
                options=lambda: self._options,
                on_detection=self._publish,
                on_first=lambda frame: self._metrics.first_frame(len(frame.fresh)),
                on_failure=self._failed,
            )
            thread.start()
            self._thread = thread
            self._inputs.open(self._enqueue)
        self._unknown = UnknownMeshWatch(
            self,
            list(self._mesh_settings),
            self._drops,
            self._metrics.frame_received,
            self._settings["count_unknown_meshes"],
        )
        self.get_logger().info(
            f"active: meshes {quoting.listed(self._mesh_settings) or 'none (service only)'}; "
            f"accuracy {self._options.accuracy}, backend {self._options.backend}, "
            f"contacts on {self._contacts.topic_name}; discovery "
            + (
                f"on this host only ({environment.DISCOVERY}=SUBNET opens it)"
                if environment.this_host_only()
                else "beyond this host"
            )
        )
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe and end the detection thread; frames that still waited are counted as dropped."""
        self._stop()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Back to unconfigured: topologies and positions are forgotten."""
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End for good, from any state."""
        self._stop()
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """After a transition that raised: back to unconfigured, with nothing left of what it may have made."""
        self._stop()
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def close(self) -> None:
        """End threads before the node is destroyed; needs no valid context."""
        self._stop()
        if self._service is not None:
            self._service.close()
            self._service = None

    def _stop(self) -> None:
        if self._unknown is not None:
            self._unknown.close()
            self._unknown = None
        if self._queue is not None:
            self._inputs.close()
            for frame in self._queue.close():
                self._count_dropped(frame, Reason.STOPPED)
        if self._thread is not None:
            self._thread.cancel()
            self._thread.join()
        self._queue = self._thread = None
        self._recording.end()

    def _release(self) -> None:
        if self._service is not None:
            self._service.close()
            self._service = None
        self._configured.close()
        self._before = self._counted_by_inputs()
        self._inputs = None

    def _counted_by_inputs(self) -> Counter:
        if self._inputs is None:
            return self._before
        assembler = self._inputs.assembler
        return self._before + Counter(restarts=assembler.restarts, static_taken=assembler.static_taken)

    def _steady_timer(self, period: float, callback: Callable[[], None]) -> None:
        # Steady time: it goes on while simulated time stands still.
        timer = self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._configured.callback(self.destroy_timer, timer)

    def _publisher(self, kind: type, topic: str, profile: QoSProfile) -> Publisher:
        publisher = qos_overrides.create_publisher(self, kind, topic, profile)
        self._configured.callback(self.destroy_publisher, publisher)
        return publisher

    def _make_inputs(self) -> Inputs:
        return Inputs(
            self,
            self._settings,
            self._mesh_settings,
            self._builder.meshes,
            drops=self._drops,
            refused=self._refused,
            metrics=self._metrics,
            links=self._links,
        )

    def _scene_for_service(self) -> NodeScene | str:
        if self.state != "active":
            return f"the node is {self.state}; activate it first"
        topologies = {mesh.name: self._inputs.assembler.topology(mesh.name) for mesh in self._builder.meshes}
        return NodeScene(self._builder, topologies)

    def _check_change(self, wanted: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> str | None:
        try:
            scene_parameters.check(wanted, meshes)
        except ParameterError as error:
            return str(error)
        if why := node_recording.refusal(wanted):
            return why
        options = _options(wanted)
        return None if options == self._options else detection.refusal(options)

    def _apply_change(self) -> None:
        self._options = _options(self._settings)
        if self._inputs is not None:
            self._inputs.assembler.restart_after = self._settings["restart_after"]
        self._recording.follow(active=self.state == "active")

    def _enqueue(self, frames: list[SceneFrame]) -> None:
        for frame in frames:
            for lost in self._queue.put(frame):
                self._count_dropped(lost, Reason.OVERLOAD)
        if frames:
            # Lets the detection thread have the interpreter at once, not when the executor is back in its wait: the
            # hand-over takes 0.03 instead of 0.35 ms.
            time.sleep(YIELD)

    def _count_dropped(self, frame: SceneFrame, reason: Reason) -> None:
        for mesh in frame.fresh:
            self._drops.count(mesh, reason)

    def _publish(self, found: Detection) -> None:
        """Called by the detection thread."""
        settings, end = self._settings, found.end
        # check_fields: its arrays are taken as they are, not copied.
        message = ContactArray(
            step=end.step, accuracy=found.options.accuracy, backend=found.backend, check_fields=True
        )
        message.header.stamp = fields.ns_to_stamp(end.stamp)
        message.header.frame_id = end.frame_id
        message.start = fields.ns_to_stamp(found.start.stamp)
        contact_messages.fill_contacts(
            message,
            found.contacts,
            found.layout,
            max_contacts=settings["max_contacts"],
            outputs=tuple(settings["outputs"]),
        )
        message.dropped_frames = self._drops.most_of(self._deforming)
        self._contacts.publish(message)
        now = time.monotonic()
        self._metrics.detected(
            len(end.fresh),
            1e3 * (now - end.received),
            found.detect_ms,
            found.profile,
            {
                "accuracy": found.options.accuracy,
                "backend": found.backend,
                "threads": found.threads,
                "contacts": message.total,
                "contacts_sent": len(message.kind),
                "first_toc": message.first_toc,
                "step": end.step,
                **{f"core.{name}": value for name, value in found.stats.items()},
            },
        )
        # A step that was under way when markers were asked for has none of what they show.
        shown = settings["markers"] and {"points", "normals"} <= set(found.options.outputs)
        if shown and now >= self._markers_after:
            self._markers_after = now + 1.0 / settings["markers_rate"]
            self._show(found, message.header)

    def _show(self, found: Detection, header: Header) -> None:
        """For viewers: called by the detection thread."""
        self._surface.publish(surface_cloud(found.end.vertices, header))
        self._markers.publish(
            contact_markers(
                np.asarray(found.contacts.points),
                np.asarray(found.contacts.normals),
                len(found.contacts.vf),
                stamp=header.stamp,
                frame_id=header.frame_id,
                size=self._settings["markers_size"],
                limit=self._settings["markers_max"],
            )
        )

    def _failed(self, frame: SceneFrame, error: Exception) -> None:
        """Called by the detection thread."""
        if not self.context.ok():
            return  # shutting down: the publisher is gone, nothing failed
        if not isinstance(error, CORE_ERRORS):
            self.errors.caught("detection", error)
        self._metrics.failed(f"{type(error).__name__}: {error}")
        self._log("scene", Reason.DETECTION_FAILED, f"step that ends at {frame.stamp} ns: {error}")

    def _report(self) -> None:
        inputs = self._inputs
        counts = self._counted_by_inputs()
        waiting = inputs.waiting if inputs else 0
        if self._queue is not None:
            held = [*self._queue.frames(), self._thread.working_on]
            waiting += sum(len(frame.fresh) for frame in held if frame is not None)
        self._diagnostics.publish(
            self._reporter.report(
                self.get_clock().now().to_msg(),
                state=self.state,
                waiting=waiting,
                restarts=counts["restarts"],
                static_taken=counts["static_taken"],
                last_refusal=self._log.last,
                links=self._links,
                warnings=[line for part in (inputs, self._unknown) if part is not None for line in part.warnings()],
                service=self._service.counts,
                errors=(self.errors.count, self.errors.last),
                recording=self._recording.status(),
                coordinate_frame=inputs.assembler.coordinate_frame if inputs else ("", ""),
            )
        )


def _options(settings: dict[str, Any]) -> Options:
    outputs = set(settings["outputs"])
    if settings["markers"]:
        outputs |= {"points", "normals"}
    return Options(
        settings["accuracy"],
        settings["backend"],
        settings["threads"],
        settings["report"],
        tuple(name for name in OUTPUTS if name in outputs),
    )


def main(argv: list[str] | None = None, node_type: type[HpccdNode] = HpccdNode) -> int:
    """Run the node until SIGINT or SIGTERM; node_type: a class built on HpccdNode, to look into it.

    Returns the exit status: 0 ended as told, 1 could not be configured, 2 wrong parameters or arguments, 3 DDS security
    is demanded and cannot be had.
    """
    stop = Future()
    stop_signals.watch(lambda: stop.set_result(None))
    environment.prepare()
    try:
        ros_start.init(argv)
        ros_start.refuse_other_arguments(argv)
        node = node_type()
    except ParameterError as error:
        return _not_started(ros_start.WRONG_PARAMETERS, str(error))
    except Exception as error:
        if (refused := ros_start.start_failure(error)) is None:
            raise
        return _not_started(*refused)
    executor = _Executor(node.errors)
    executor.add_node(node)
    try:
        if node.get_parameter("autostart").value and not stop.done():
            for transition in (node.trigger_configure, node.trigger_activate):
                if transition() != TransitionCallbackReturn.SUCCESS:
                    return 1
        stop_signals.spin(executor, stop)
    except ExternalShutdownException:
        pass
    finally:
        node.close()
        executor.shutdown(timeout_sec=1.0)
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _not_started(status: int, why: str) -> int:
    print(f"hpccd: {why}", file=sys.stderr)
    rclpy.try_shutdown()
    return status
