# SPDX-License-Identifier: Apache-2.0
"""The node's topic stop as one answer, which is true wherever nobody says that it is false."""

import threading
import time
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Bool

from hpccd_ros.client.topics import STOP_TIMEOUT, STOP_TOPIC, stop_qos

# Of the time-out, as the node takes it too: a silence reads as true before it is over.
_IN_TIME = 0.95
# Of each time-out the callback looks so often whether it has passed.
_LOOKS = 4


class StopListener:
    """Listens to ``topic`` in ``node``, whose executor is the user's: SingleThreadedExecutor or MultiThreadedExecutor.
    (rclpy's experimental EventsExecutor fails, in Jazzy, at every callback that asks when its message came.)

    ``stop`` and ``reason`` may be read at any time from any thread. They look at the steady clock: where the executor
    runs no callbacks any more, ``stop`` becomes true as well. ``stop`` is false only where a message said so, less than
    ``stop_timeout`` seconds ago, and as many publishers are alive as there are to be. No system time and no /clock
    matters, but for this: a message that waited too long in the queue, by the system time, does not count either.

    stop_timeout: s, at least those of the node's parameter; with less nothing is ever heard. publishers: how many must
    be alive on the topic. Of several, any that says true within ``stop_timeout`` makes it true; a message does not tell
    whose it is. on_change: called by the executor with this listener after ``stop`` changed: at messages and events at
    once, at a time-out when a timer looks, four times in each; not at all while the executor stands still.

    Raises TypeError or ValueError for wrong arguments.
    """

    def __init__(
        self,
        node: Node,
        topic: str = STOP_TOPIC,
        stop_timeout: float = STOP_TIMEOUT,
        *,
        publishers: int = 1,
        on_change: "Callable[[StopListener], None] | None" = None,
    ) -> None:
        profile: QoSProfile = stop_qos(stop_timeout)
        if isinstance(publishers, bool) or not isinstance(publishers, int):
            raise TypeError(f"publishers: expected how many, got {type(publishers).__name__}")
        if publishers < 1:
            raise ValueError(f"publishers: {publishers}; at least one must be there to say that nothing is near")
        self._node = node
        self._timeout = float(stop_timeout)
        self._publishers = publishers
        self._on_change = on_change
        self._lock = threading.Lock()
        self._heard: float | None = None  # the last message that counts; None: none, or lost since
        self._said = True  # what it said
        self._said_true = -float("inf")  # when the last came that said true
        self._alive: int | None = None  # None: DDS has not told yet
        self._lost = f"nothing was heard yet on {node.resolve_topic_name(topic)}"
        self._told = True  # to on_change
        events = SubscriptionEventCallbacks(
            deadline=self._on_deadline, liveliness=self._on_liveliness, incompatible_qos=self._on_incompatible
        )
        on_message: Any = self._on_message  # rclpy's types know no second argument
        self._subscription = node.create_subscription(Bool, topic, on_message, profile, event_callbacks=events)
        self._topic: str = self._subscription.topic_name
        self._timer = node.create_timer(
            self._timeout / _LOOKS, self._tell, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    @property
    def stop(self) -> bool:
        """Whether to stop."""
        return self._why() is not None

    @property
    def reason(self) -> str:
        """Why, in a sentence; what it is that the publisher knows is on /diagnostics. Empty where ``stop`` is false."""
        return self._why() or ""

    def close(self) -> None:
        """Hear no more: ``stop`` is true from now on."""
        self._lose("the listener was closed")
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._subscription)

    def _why(self) -> str | None:
        now = time.monotonic()
        with self._lock:
            if self._heard is None:
                return f"{self._lost[0].upper()}{self._lost[1:]}."
            if now - self._heard >= _IN_TIME * self._timeout:
                return f"Nothing was heard on {self._topic} for {now - self._heard:.3g} s."
            if self._alive is not None and self._alive < self._publishers:
                return f"{self._alive} of {self._publishers} publishers are alive on {self._topic}."
            if self._said:
                return f"It was said on {self._topic}."
            several = max(self._publishers, self._alive or 0) > 1
            if several and now - self._said_true < self._timeout:
                return f"One of several publishers said it on {self._topic}."
            return None

    def _on_message(self, message: Bool, info: dict[str, Any]) -> None:
        # Of a queue that nobody emptied for a while, the age that the middleware tells; in system time, which may jump.
        came = info["received_timestamp"]  # 0 where the middleware tells none
        waited = 1e-9 * (time.time_ns() - came) if came else 0.0
        now = time.monotonic()
        with self._lock:
            if message.data:
                self._said_true = now
            self._said = message.data
            if -self._timeout < waited < self._timeout:
                self._heard = now - max(waited, 0.0)
            else:
                self._heard, self._lost = None, f"what was heard on {self._topic} waited too long to be taken"
        self._tell()

    def _on_deadline(self, event: Any) -> None:
        self._lose(f"nothing was heard on {self._topic} for {self._timeout:g} s")

    def _on_liveliness(self, event: Any) -> None:
        with self._lock:
            self._alive = event.alive_count
        if event.alive_count < self._publishers:
            self._lose(f"{event.alive_count} of {self._publishers} publishers are alive on {self._topic}")
        else:
            self._tell()

    def _on_incompatible(self, event: Any) -> None:
        self._lose(
            f"a publisher on {self._topic} promises less than is asked for: its stop_timeout is above "
            f"{self._timeout:g} s, or it is not reliable and latched; give the listener that of the node"
        )

    def _lose(self, why: str) -> None:
        with self._lock:
            self._heard, self._lost = None, why
        self._tell()

    def _tell(self) -> None:
        stop = self.stop
        with self._lock:
            changed, self._told = stop != self._told, stop
        if changed and self._on_change is not None:
            self._on_change(self)
