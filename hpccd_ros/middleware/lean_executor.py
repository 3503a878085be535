# SPDX-License-Identifier: Apache-2.0
"""rclpy's executor with fewer and shorter turns: what it does in Python around each message is part of the latency.

A node with a robot has 35 handlers of events of QoS, most of them for warnings, and for each turn rclpy builds its wait
set anew: with them a turn takes twice as long. And each callback ends with a wake-up, which costs an empty turn.
"""

import threading
import time
from typing import Any

from rclpy.context import Context
from rclpy.event_handler import EventHandler, QoSPublisherEventType, QoSSubscriptionEventType
from rclpy.executors import SingleThreadedExecutor
from rclpy.guard_condition import GuardCondition
from rclpy.task import Task

#: Seconds between looks at events that only warn; a wait that is under way when one comes is not ended by it.
LOOK_EVERY = 0.5
WARNINGS = frozenset(
    {
        QoSPublisherEventType.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        QoSPublisherEventType.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
    }
)


class LeanExecutor(SingleThreadedExecutor):
    """For nodes with a timer of their own, as warnings may else come as late as the next message."""

    def __init__(self, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._guard.destroy()
        self._guard = self._wake = _WakeOfOthers(None, None, context=self._context)
        self._made: Task | None = None
        self._look_at = 0.0
        self._looked = False

    def spin_once(self, timeout_sec: float | None = None) -> None:
        if self._looked:
            self._looked, self._look_at = False, time.monotonic() + LOOK_EVERY
        super().spin_once(timeout_sec)

    def wait_for_ready_callbacks(self, *args: Any, **options: Any) -> Any:
        self._made = self._wake.unheard_of = None
        found = super().wait_for_ready_callbacks(*args, **options)
        if found[0] is self._made:
            self._wake.unheard_of = threading.get_ident()
        return found

    def _make_handler(self, *args: Any) -> Task:
        self._made = super()._make_handler(*args)
        return self._made

    def can_execute(self, entity: Any) -> bool:
        if type(entity) is EventHandler and entity.event_type in WARNINGS:
            if time.monotonic() < self._look_at:
                return False
            self._looked = True
        return super().can_execute(entity)


class _WakeOfOthers(GuardCondition):
    """``unheard_of``: a thread that runs what the last wait has found, and looks for work before it waits again. Of
    what tasks bring forth it would not know: it runs them and then waits."""

    unheard_of: int | None = None

    def trigger(self) -> None:
        if threading.get_ident() != self.unheard_of:
            super().trigger()
