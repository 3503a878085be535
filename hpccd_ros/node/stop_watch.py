# SPDX-License-Identifier: Apache-2.0
"""From steps, rejections and failures to the topics stop and speed_scale. A thread of its own publishes them, so
neither the executor nor a detection can delay them."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.duration import Duration
from std_msgs.msg import Bool, Float64

from hpccd_core import Cancelled
from hpccd_ros.base.quoting import listed
from hpccd_ros.detect.approach import Slowdown
from hpccd_ros.detect.core import CORE_ERRORS
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.drops import Rejection
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.node.configuration import Configuration
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.stop_doubts import WatchedScene
from hpccd_ros.node.stop_state import Cause, StopState, Why
from hpccd_ros.params import pair_parameters, robot_parameters

# In each time-out: half of it is promised, and two in a row may be late.
REPEATS = 4
LAST_WORD = 0.2  # s for readers to confirm it
LOG_PERIOD = 1.0  # s
LONG = 10.0  # s; a longer stop_timeout is reported: 500 is often meant as milliseconds
# Causes that belong to a node at work; the others are faults, and warnings in the log.
_EXPECTED = ("", Cause.INACTIVE, Cause.UNANSWERED, Cause.NEAR, Cause.INSIDE)


class StopSignal:
    """Publishes ``state`` at once and periodically until it is closed, then true, and 0, a last time.

    Belongs to a configured ``node``; ends when that is unconfigured.
    """

    def __init__(self, node: GuardedLifecycleNode, state: StopState, timeout: float) -> None:
        self._node = node
        self._state = state
        self._period = timeout / REPEATS
        self._publisher = node.configured_publisher(Bool, topic_names.STOP, qos.stop(timeout))
        self._scale_publisher = None
        if state.approach_time > 0:
            self._scale_publisher = node.configured_publisher(Float64, topic_names.SPEED_SCALE, qos.stop(timeout))
        self._log_after, self._logged = 0.0, str(Cause.INACTIVE)
        self._thread = threading.Thread(target=self._run, name="stop", daemon=True)
        self._thread.start()
        node.when_unconfigured(self.close)

    def close(self) -> None:
        """Needs no valid context; may be called again."""
        if self._state.closed:
            return
        self._state.close()
        self._thread.join()
        for publisher in (self._publisher, self._scale_publisher):
            if publisher is not None and self._node.context.ok():
                publisher.wait_for_all_acked(Duration(seconds=LAST_WORD))

    def _run(self) -> None:
        due = 0.0
        while True:
            why = self._state.next(due)
            scale = self._state.slowdown().scale if why is None else 0.0
            due = time.monotonic() + self._period
            if why is None and self._state.why() is not None:
                continue  # it took too long: the state is no longer valid
            try:
                self._publisher.publish(Bool(data=why is not None))
                if self._scale_publisher is not None:
                    self._scale_publisher.publish(Float64(data=scale))
                self._log(why)
            except Exception as error:  # silence is read as stop; a thread that ended could never speak again
                if not self._node.context.ok():
                    return
                self._node.errors.caught("stop", error)
            if self._state.closed:
                return

    def _log(self, why: Why | None) -> None:
        text = f"stop: {why.text}" if why is not None else "stop is false"
        cause = why.cause if why is not None else ""
        now = time.monotonic()
        if cause == self._logged or now < self._log_after or not self._node.context.ok():
            return
        self._log_after, self._logged = now + LOG_PERIOD, cause
        if cause in _EXPECTED:  # rclpy refuses another severity from the same line
            self._node.get_logger().info(text)
        else:
            self._node.get_logger().warning(text)


_WARNED = dict.fromkeys((Cause.NEAR, Cause.INSIDE, Cause.UNANSWERED), DiagnosticStatus.WARN)


class StopWatch:
    """Publishes stop for a configured ``node`` with parameter stop_distance. busy: whether a frame is being processed.

    The life cycle calls `begin` and `end`, the detection thread `first` and `look`, the executor `received` and
    `robots`, any thread `rejected`.
    """

    def __init__(self, node: GuardedLifecycleNode, configuration: Configuration, busy: Callable[[], bool]) -> None:
        settings = configuration.settings
        self._node = node
        self._configuration = configuration
        distance, timeout = settings["stop_distance"], settings["stop_timeout"]
        if timeout > LONG:
            node.get_logger().warning(
                f"stop_timeout: {timeout:g} s, so a publisher that ends is noticed only after that time; the unit is s"
            )
        self._approach_time: float = settings["approach_time"]
        self._state = StopState(
            distance, timeout, busy, approach_time=self._approach_time, clock_error=settings["clock_error"]
        )
        self._nearness: Nearness | None = None
        self._nearness_ms = 0.0
        self._scene_of: SceneFrame | None = None
        self._not_closed: list[str] = []
        self._signal = StopSignal(node, self._state, timeout)

    def begin(self, builder: SceneBuilder) -> None:
        settings = self._configuration.settings
        self._scene_of = None
        links = robot_parameters.links(self._configuration.robots)
        detail = pair_parameters.stop_detail(settings, links)
        self._nearness = Nearness(builder, self._configuration.options, settings["stop_distance"], detail)
        self._state.begin(WatchedScene.of(builder, settings, links))

    def end(self) -> None:
        """Called before the detection thread is joined: a running distance query is cancelled."""
        self._state.end()
        if self._nearness is not None:
            self._nearness.cancel()

    def close(self) -> None:
        """Publish true a last time; nothing afterwards."""
        self._signal.close()

    def apply_change(self) -> None:
        """Follow the parameters."""
        settings = self._configuration.settings
        distance, self._approach_time = settings["stop_distance"], settings["approach_time"]
        if self._nearness is not None:
            self._nearness.set(self._configuration.options, distance)
        self._state.changed(distance, self._approach_time)

    def first(self) -> None:
        self._state.first()

    def look(self, start: SceneFrame, end: SceneFrame) -> None:
        """Query the distances of a step before its contacts, so that stop rises before they are found. If the query
        fails, stop becomes true, and contacts are computed all the same."""
        began, approach_time, slowdown = time.perf_counter(), self._approach_time, Slowdown()
        try:
            self._look_at_topologies(end)
            near, distance = self._nearness.within(start, end)
            inside = self._nearness.inside(start, end) if near is None else None
            if near is None and inside is None and approach_time > 0:
                slowdown = self._nearness.slowdown(start, end, distance, approach_time)
        except Cancelled:
            raise
        except Exception as error:
            self._state.failed(f"the distances of the step that ends at {end.stamp} ns were not computed: {error}")
            if not isinstance(error, CORE_ERRORS):
                self._node.errors.caught("stop", error)
            return
        self._nearness_ms = 1e3 * (time.perf_counter() - began)
        self._state.answered(near, distance, end.origins, slowdown, approach_time, inside=inside)

    def _look_at_topologies(self, frame: SceneFrame) -> None:
        """Warn, once, of meshes of which is unknown what lies inside."""
        if self._scene_of is not None and self._scene_of.same_scene(frame):
            return
        before, self._scene_of, self._not_closed = self._not_closed, frame, self._nearness.not_closed(frame)
        if set(self._not_closed) - set(before):
            self._node.get_logger().warning(
                f"stop: {listed(self._not_closed)}: not closed, so stop cannot tell whether a mesh is inside and uses "
                "the distance of the surfaces only; fill the holes, or orient all faces alike, if something may get "
                "inside without a contact"
            )

    def rejected(self, rejection: Rejection) -> None:
        self._state.rejected(rejection)

    def received(self, kind: str, name: str, info: Mapping[str, Any]) -> None:
        """A message of this kind was received; name: of its mesh or topic."""
        self._state.received(f"a message ({kind}) of {name}", name, info)

    def robots(self, doubts: Mapping[str, str]) -> None:
        """Robots with a newer description that is not in use, and why."""
        self._state.robots(doubts)

    def status(self) -> tuple[bytes, str, dict[str, object]]:
        """(level, message, values) for the diagnostics."""
        slowdown, why, settings = self._state.slowdown(), self._state.why(), self._configuration.settings
        values: dict[str, object] = {
            "stop": why is not None,
            "cause": why.cause if why is not None else "",
            "stop_distance": settings["stop_distance"],
            "stop_timeout": settings["stop_timeout"],
            "clock_error": settings["clock_error"],
            "not_closed": ", ".join(self._not_closed),
            "look_ms": f"{self._nearness_ms:.3f}",
        }
        text = "false: nothing is near"
        if settings["approach_time"] > 0:
            scale = slowdown.scale if why is None else 0.0
            slowed_by = " and ".join(slowdown.pair or ())
            values |= {"approach_time": settings["approach_time"], "speed_scale": scale, "slowed_by": slowed_by}
            text += f"; speed_scale {scale:.2g}" + (f": {slowed_by} approach" if slowed_by else "")
        values |= {f"rises.{cause}": count for cause, count in sorted(self._state.rises.items())}
        if why is None:
            return DiagnosticStatus.OK, text, values
        return _WARNED.get(why.cause, DiagnosticStatus.ERROR), f"true: {why.text}", values
