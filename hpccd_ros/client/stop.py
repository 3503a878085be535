# SPDX-License-Identifier: Apache-2.0
"""The node's topics stop and speed_scale as values that are false, or above 0, only while a recent message says so."""

import threading
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Bool, Float64

from hpccd_ros.base.clocks import CLOCK_ERROR, Clocks, ClockWatch
from hpccd_ros.base.quoting import counted
from hpccd_ros.client.topics import SPEED_SCALE_TOPIC, STOP_TIMEOUT, STOP_TOPIC, stop_qos
from hpccd_ros.middleware import graph, message_types

# Fraction of the time-out, the same in the node: silence reads as true before the time-out is over.
_IN_TIME = 0.95
# Times the node's time-out, above which a longer one is reported.
_FAR_LONGER = 4.0
# s between two looks for a topic that may be meant, while there is no publisher.
_SEARCH_EVERY = 1.0
# Times per time-out at which a timer checks whether it has passed.
_LOOKS = 4


class StopListener:
    """Listens to the node's stop topic; ``stop`` is true whenever the robot must stop.

    ``stop`` is false only if a message sent less than ``stop_timeout`` seconds ago says so, and at least ``publishers``
    publishers are alive. The age of a message is the system time minus its DDS source timestamp: a process that was
    suspended, or that started late and receives the latched message, does not accept an old message as new. ``stop``
    can be read at any time from any thread, and also becomes true if the executor runs no callbacks. A message from
    further in the future than ``clock_error``, or a larger jump of the system clock against the steady clock, makes it
    true until the clocks have agreed for ``stop_timeout``. ``/clock`` does not matter.

    Parameters
    ----------
    node : rclpy.node.Node
        Node that subscribes. Its executor must be a SingleThreadedExecutor or a MultiThreadedExecutor: in Jazzy,
        rclpy's experimental EventsExecutor fails at callbacks that ask for the time of their message.
    topic : str
        Name of the topic, relative to the namespace of `node`.
    stop_timeout : float
        Seconds, at least those of the node's parameter; with less, no message arrives.
    publishers : int
        Number of publishers that must be alive on the topic. Give the true number: with a smaller one, a publisher that
        was never heard is not missed. A true from any of them within ``stop_timeout`` makes ``stop`` true.
    on_change : callable, optional
        Called by the executor with this listener after ``stop`` changed, not when only the reason did: at messages and
        events at once, at a time-out when a timer looks, four times in each; not at all while the executor stands
        still.
    clock_error : float
        Largest difference between the system clocks of the two machines, in seconds.

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type or range.
    """

    _message_type: type = Bool
    _type_name = message_types.STOP
    _said = "is true"
    _silence: Any = True

    def __init__(
        self,
        node: Node,
        topic: str = STOP_TOPIC,
        stop_timeout: float = STOP_TIMEOUT,
        *,
        publishers: int = 1,
        on_change: "Callable[[StopListener], None] | None" = None,
        clock_error: float = CLOCK_ERROR,
    ) -> None:
        if not isinstance(topic, str):
            remedy = f"; did you mean stop_timeout={topic}?" if isinstance(topic, (int, float)) else ""
            raise TypeError(f"topic: expected a name, got {type(topic).__name__}{remedy}")
        profile: QoSProfile = stop_qos(stop_timeout)
        if isinstance(publishers, bool) or not isinstance(publishers, int):
            raise TypeError(f"publishers: expected how many, got {type(publishers).__name__}")
        if publishers < 1:
            raise ValueError(f"publishers: {publishers}; at least one must be there to say that nothing is near")
        if isinstance(clock_error, bool) or not isinstance(clock_error, (int, float)):
            raise TypeError(f"clock_error: expected seconds, got {type(clock_error).__name__}")
        if not 0 <= clock_error <= 10:
            raise ValueError(f"clock_error: {clock_error} s; give from 0 s to 10 s")
        if on_change is not None and not callable(on_change):
            raise TypeError(f"on_change: expected a callable, got {type(on_change).__name__}")
        self._node = node
        self._timeout = float(stop_timeout)
        self._publishers = publishers
        self._on_change = on_change
        self._lock = threading.Lock()
        self._clocks = Clocks()
        self._clock_error = float(clock_error)
        self._ages = ClockWatch(self._clock_error, self._timeout)
        # Earlier messages are not accepted: nothing here has seen whether a clock was set back since they were sent.
        self._begun = self._clocks.system()
        self._sent: int | None = None  # when the newest message was sent; None: none, or its publisher was lost since
        self._value = True  # whether that message says stop
        self._sent_true = 0  # when the newest message with true was sent
        self._alive: int | None = None  # None: DDS has not told yet
        self._lost = f"{node.resolve_topic_name(topic)}: no message yet"
        self._elsewhere = ""  # for that reason: a topic that may be meant
        self._notified: Any = self._silence  # to on_change
        events = SubscriptionEventCallbacks(
            deadline=self._on_deadline, liveliness=self._on_liveliness, incompatible_qos=self._on_incompatible
        )
        on_message: Any = self._on_message  # rclpy's types know no second argument
        self._subscription = node.create_subscription(
            self._message_type, topic, on_message, profile, event_callbacks=events
        )
        self._topic: str = self._subscription.topic_name
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(self._timeout / _LOOKS, self._notify, clock=steady)
        self._search: Any = node.create_timer(_SEARCH_EVERY, self._look_elsewhere, clock=steady)

    @property
    def stop(self) -> bool:
        """Whether the robot must stop."""
        return self._why() is not None

    @property
    def reason(self) -> str:
        """Why ``stop`` is true; empty if it is false. /diagnostics has the cause that the node knows."""
        return self._why() or ""

    def close(self) -> None:
        """End the subscription: ``stop`` is true from now on."""
        self._lose(f"{self._topic}: the listener was closed")
        self._node.destroy_timer(self._timer)
        self._node.destroy_timer(self._search)
        self._node.destroy_subscription(self._subscription)

    def _why(self) -> str | None:
        with self._lock:
            steady, system = self._clocks.steady(), self._clocks.system()
            self._ages.look(steady, system)
            if clocks := self._ages.why(steady):
                self._sent, self._lost = None, clocks  # its age is unknown now
                self._begun = 0
            if self._sent is None:
                return self._lost + self._elsewhere
            age = 1e-9 * (system - self._sent)
            if age < -self._clock_error:
                return f"{self._topic}: the last message was sent {-age:.3g} s in the future"
            if age >= _IN_TIME * self._timeout:
                return f"{self._topic}: the last message taken was sent {age:.3g} s ago"
            if self._alive is not None and self._alive < self._publishers:
                return self._too_few(self._alive)
            if self._value:
                said = f"{self._topic} {self._said}"
                if (self._alive or 0) <= self._publishers:
                    return said
                found, expected = self._alive, self._publishers
                return f"{said}; it has {found} publishers, of which {expected} were expected (publishers=)"
            several = max(self._publishers, self._alive or 0) > 1
            if several and 1e-9 * (system - self._sent_true) < self._timeout:
                return f"{self._topic}: one of several publishers said true in the last {self._timeout:g} s"
            return None

    def _too_few(self, alive: int) -> str:
        return f"{self._topic}: {counted(alive, 'publisher')} alive, {self._publishers} expected"

    def _heard(self) -> Any:
        """What on_change is about."""
        return self.stop

    def _says_stop(self, message: Any) -> bool:
        return bool(message.data)

    def _take(self, message: Any) -> None:
        """Keep what else the newest message says."""

    def _on_message(self, message: Any, info: dict[str, Any]) -> None:
        sent = info["source_timestamp"]  # 0, and so too old, if the middleware provides none
        with self._lock:
            steady, system = self._clocks.steady(), self._clocks.system()
            self._ages.look(steady, system)
            self._ages.hear(f"a message on {self._topic}", 1e-9 * (sent - system), steady)
            self._sent_true = min(self._sent_true, system)  # a clock may have been set back
            stop = self._says_stop(message)
            if stop:
                self._sent_true = max(self._sent_true, sent)
            if sent < self._begun:
                self._lost = f"{self._topic}: no message was sent since the listener was created"
            elif self._sent is None or sent >= self._sent or self._sent > system:
                self._value, self._sent = stop, sent
                self._take(message)
        self._notify()

    def _on_deadline(self, event: Any) -> None:
        self._lose(f"{self._topic}: no message for {self._timeout:g} s")

    def _on_liveliness(self, event: Any) -> None:
        with self._lock:
            self._alive, self._elsewhere = event.alive_count, ""
        if event.alive_count_change > 0:
            self._compare_timeouts()
        if event.alive_count < self._publishers:
            self._lose(self._too_few(event.alive_count))
        else:
            self._notify()

    def _look_elsewhere(self) -> None:
        """As long as no publisher was there: find another topic that may be meant."""
        if self._alive is not None:
            self._search.cancel()
            return
        published = self._node.count_publishers(self._topic) > 0
        near = "" if published else graph.near_published(self._node, self._topic, self._type_name)
        found = f"; it has no publisher, and {near} has: if that is meant, give topic={near!r}" if near else ""
        with self._lock:
            self._elsewhere = found if self._alive is None else ""

    def _compare_timeouts(self) -> None:
        """Warn where the listener waits much longer than the node promises: 500 is often meant as milliseconds."""
        promised = [
            publisher.qos_profile.deadline.nanoseconds
            for publisher in self._node.get_publishers_info_by_topic(self._topic)
        ]
        if promised and self._timeout > _FAR_LONGER * (longest := 1e-9 * max(promised)):
            node: Any = self._node  # rclpy's get_logger has no types
            node.get_logger().warning(
                f"{self._topic}: stop_timeout is {self._timeout:g} s here and {longest:g} s in the node, so a node "
                f"that hangs is noticed only after {self._timeout:g} s; give the node's stop_timeout, in seconds"
            )

    def _on_incompatible(self, event: Any) -> None:
        self._lose(
            f"{self._topic}: a publisher offers less than the listener requests: its stop_timeout is above "
            f"{self._timeout:g} s, or it is not reliable and latched; give the listener the node's stop_timeout"
        )

    def _lose(self, why: str) -> None:
        with self._lock:
            self._sent, self._lost = None, why
        self._notify()

    def _notify(self) -> None:
        heard = self._heard()
        with self._lock:
            changed, self._notified = heard != self._notified, heard
        if changed and self._on_change is not None:
            self._on_change(self)


class SpeedScaleListener(StopListener):
    """Listens to the node's topic speed_scale; ``speed_scale`` is 0 whenever the robot must stop.

    It is above 0 only if a message sent less than ``stop_timeout`` seconds ago says so and its one publisher is alive:
    it is 0 whenever ``stop`` of a StopListener would be true. ``stop`` is true where it is 0, and ``reason`` says why.

    Parameters
    ----------
    node, topic, stop_timeout, clock_error
        See StopListener.
    on_change : callable, optional
        Called with this listener after ``speed_scale`` changed, at the same times as that of StopListener.

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type or range.
    """

    _message_type = Float64
    _type_name = message_types.SPEED_SCALE
    _said = "is 0"
    _silence = 0.0

    def __init__(
        self,
        node: Node,
        topic: str = SPEED_SCALE_TOPIC,
        stop_timeout: float = STOP_TIMEOUT,
        *,
        on_change: "Callable[[SpeedScaleListener], None] | None" = None,
        clock_error: float = CLOCK_ERROR,
    ) -> None:
        self._scale = 0.0
        call: Any = on_change  # of this class, which it is called with
        super().__init__(node, topic, stop_timeout, on_change=call, clock_error=clock_error)

    @property
    def speed_scale(self) -> float:
        """Factor of the speed, from 0 (stop) to 1 (full speed)."""
        # A message that comes in between is newer, so that its scale is right too.
        return self._scale if self._why() is None else 0.0

    def _why(self) -> str | None:
        if (self._alive or 0) > 1:
            return f"{self._topic}: {self._alive} publishers alive, and their scales differ; give each a topic"
        return super()._why()

    def _heard(self) -> float:
        return self.speed_scale

    def _says_stop(self, message: Any) -> bool:
        return not message.data > 0  # NaN too

    def _take(self, message: Any) -> None:
        self._scale = 0.0 if self._value else min(1.0, message.data)
