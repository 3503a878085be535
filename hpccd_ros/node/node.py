# SPDX-License-Identifier: Apache-2.0
"""The node: its life cycle, and the connections between its parts."""

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.middleware import environment, graph, qos, topic_names
from hpccd_ros.node import parameter_services
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.configuration import Configuration
from hpccd_ros.node.contacts_publisher import ContactsPublisher
from hpccd_ros.node.detect_action import DetectAction
from hpccd_ros.node.detect_jobs import DetectJobs
from hpccd_ros.node.detect_request import NodeScene
from hpccd_ros.node.detect_service import DetectService
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.node_recording import NodeRecording
from hpccd_ros.node.robot_descriptions import RobotDescriptions
from hpccd_ros.node.status_report import Reporter
from hpccd_ros.node.stop_watch import StopWatch
from hpccd_ros.node.stream_detection import StreamDetection
from hpccd_ros.node.unknown_meshes import UnknownMeshWatch
from hpccd_ros.node.viewer_publisher import ViewerPublisher
from hpccd_ros.node.warning_log import WarningLog

# s. At this interval the pages that a message allocates again cost little; a node that once held much, because its
# machine was busy for seconds, does not stay larger.
GIVE_BACK_EVERY = 60.0
# s between two looks for warnings that the log lacks.
LOOK_EVERY = 1.0
SUCCESS = TransitionCallbackReturn.SUCCESS


class HpccdNode(GuardedLifecycleNode):
    """Vertices in, contacts out. A GuardedExecutor runs it.

    Configured: parameters are checked, mesh files read; publishers, service and action exist. Active: subscribed and
    detecting, once all robots are known.
    Raises ParameterError for invalid parameters.
    """

    def __init__(self) -> None:
        super().__init__("hpccd")
        parameter_services.replace_callbacks(self)
        self._configuration = Configuration(self)
        self._settings = self._configuration.settings
        self._recording = NodeRecording(self, self._settings, self.errors)
        self._configuration.follow(configured=lambda: self._jobs is not None, on_change=self._apply_change)
        self._accounts = Accounts(self.get_logger().warning)
        self._warning_log = WarningLog(self.get_logger().warning)
        self._reporter = Reporter(self.get_fully_qualified_name(), self._accounts)
        self._robots: RobotDescriptions | None = None
        self._stream: StreamDetection | None = None  # none for a node without meshes and robots
        self._scene_error = ""  # why robots that are known make no scene
        self._viewers: ViewerPublisher | None = None
        self._stop_watch: StopWatch | None = None
        self._unknown: UnknownMeshWatch | None = None
        self._jobs: DetectJobs | None = None
        self._service: DetectService | None = None
        self._action: DetectAction | None = None

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read mesh files, create publishers, service, action and diagnostics."""
        settings = self._settings
        self._contacts = ContactsPublisher(self, settings)
        self._viewers = ViewerPublisher(self, settings)
        try:
            self._robots = RobotDescriptions(self, settings, self._follow_robots, self._doubt_robots)
            self._make_scene()
        except ValueError as error:
            self.get_logger().error(f"cannot configure: {error}")
            self._release()
            return TransitionCallbackReturn.FAILURE
        if self._stream is not None and settings["stop_distance"] >= 0:
            self._stop_watch = StopWatch(self, self._configuration, self._stream.works)
        self._diagnostics = self.configured_publisher(DiagnosticArray, topic_names.DIAGNOSTICS, qos.DIAGNOSTICS)
        self._jobs = DetectJobs(self, self._configuration, self._scene_for_requests, self._accounts)
        self._service = DetectService(self, self._jobs, settings)
        self._action = DetectAction(self, self._jobs)
        self.configured_timer(settings["diagnostics_period"], self._report)
        self.configured_timer(LOOK_EVERY, self._log_warnings)
        self.configured_timer(GIVE_BACK_EVERY, self._give_back)
        return SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Subscribe and detect."""
        self._recording.follow(active=True)  # first: what the node hears, the recording shall have
        if self._stream is not None:
            self._stream.open(self._publish, self._stop_watch)
        self._unknown = UnknownMeshWatch(self, self._settings, self._configuration.meshes, self._accounts)
        self.get_logger().info(f"active: {self._configuration.summary(self._contacts.topic)}")
        return SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe; count waiting frames as dropped, and end open goals."""
        self._stop()
        if self._action is not None:
            self._action.stop()
        return SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Back to unconfigured: topologies and positions are forgotten."""
        self._release()
        return SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End for good, from any state."""
        self._stop()
        self._release()
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """After a transition that raised: back to unconfigured, without anything that it created."""
        return self.on_shutdown(state)

    def close(self) -> None:
        """End threads before the node is destroyed; needs no valid context."""
        self._stop()
        if self._stop_watch is not None:
            self._stop_watch.close()
        self._end_requests()

    def _make_scene(self) -> None:
        """Make the scene of the known robots. Raises ValueError, and keeps the previous scene then."""
        self._builder = self._configuration.with_robots(self._robots.robots)
        self._deforming = [mesh.name for mesh in self._builder.meshes if not mesh.static]
        if self._stream is not None:
            self._stream.remake(self._builder)
        elif self._builder.meshes:
            self._stream = StreamDetection(self, self._configuration, self._builder, self._accounts)

    def _follow_robots(self) -> None:
        """Make the scene of the received descriptions."""
        try:
            self._make_scene()
        except ValueError as error:
            self._scene_error = f"{error}; the scene stays as it was"
            self.get_logger().error(self._scene_error)
        else:
            self._scene_error = ""
        self._doubt_robots()

    def _doubt_robots(self) -> None:
        """If stop is published, tell it the robots whose last description is not in the scene."""
        if self._stop_watch is None or self._robots is None:
            return
        in_scene = dict.fromkeys(self._settings["robots"], self._scene_error) if self._scene_error else {}
        self._stop_watch.robots(in_scene | self._robots.doubts())

    def _stop(self) -> None:
        if self._unknown is not None:
            self._unknown.close()
            self._unknown = None
        if self._stop_watch is not None:
            self._stop_watch.end()
        if self._stream is not None:
            self._stream.close()
        if self._viewers is not None:
            self._viewers.end()
        self._recording.end()

    def _release(self) -> None:
        self._end_requests()
        self.unconfigure()
        self._stream = self._stop_watch = self._robots = None
        self._scene_error = ""
        self._configuration.forget_robots()

    def _end_requests(self) -> None:
        for part in (self._jobs, self._service, self._action):
            if part is not None:
                part.close()
        self._jobs = self._service = self._action = None

    def _apply_change(self) -> None:
        if self._scene_error:
            self._follow_robots()  # a parameter may have been at fault
        if self._stream is not None:
            self._stream.apply_change()
        if self._service is not None:
            self._service.apply_change()
        if self._stop_watch is not None:
            self._stop_watch.apply_change()
        self._recording.follow(active=self.state == "active")

    def _scene_for_requests(self) -> NodeScene | str:
        if self.state != "active":
            return f"the node is {self.state}; activate it first"
        known = self._stream.topologies() if self._stream is not None else {}
        return NodeScene(self._builder, {mesh.name: known.get(mesh.name) for mesh in self._builder.meshes})

    def _publish(self, found: Detection) -> None:
        """Called by the detection thread."""
        dropped = self._accounts.dropped.most_of(self._deforming)
        message = self._contacts.publish(found, dropped, self._accounts.inputs)
        self._accounts.processed(found, message.total, len(message.kind))
        self._viewers.show(found, message.header, self._builder)

    def _give_back(self) -> None:
        self._jobs.forget_scenes(unused_for=GIVE_BACK_EVERY)
        environment.give_back_freed_memory()

    def _warnings(self) -> list[str]:
        parts = (self._robots, self._stream, self._unknown)
        lines = [line for part in parts if part is not None for line in part.warnings()]
        if why := graph.same_name(self, self.get_fully_qualified_name()):
            lines.insert(0, why)
        return lines

    def _rejected(self) -> list[str]:
        """Inputs that are sent once and were rejected; the log has each already."""
        parts = (self._robots, self._stream)
        rejected = [line for part in parts if part is not None for line in part.rejected()]
        return [self._scene_error, *rejected] if self._scene_error else rejected

    def _silent(self) -> list[str]:
        return self._stream.silent() if self._stream is not None else []

    def _log_warnings(self) -> None:
        if self.state == "active":
            self._warning_log.tell(self._warnings(), lasting=self._silent())

    def _report(self) -> None:
        message = self._reporter.report(
            self.get_clock().now().to_msg(),
            state=self.state,
            waiting=self._stream.waiting if self._stream is not None else 0,
            warnings=[*self._configuration.warnings, *self._rejected(), *self._warnings()],
            silent=self._silent(),
            service=self._jobs.counts,
            errors=(self.errors.count, self.errors.last),
            recording=self._recording.status(),
            stop=self._stop_watch.status() if self._stop_watch is not None else None,
            coordinate_frame=self._stream.coordinate_frame if self._stream is not None else ("", ""),
        )
        self._diagnostics.publish(message)
