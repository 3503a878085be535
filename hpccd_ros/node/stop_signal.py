# SPDX-License-Identifier: Apache-2.0
"""The topic stop, published by a thread that does nothing else: neither the executor nor a detection can hold it up."""

import threading
import time

from rclpy.duration import Duration
from std_msgs.msg import Bool

from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.stop_state import StopState, Why

# In each time-out: half of it is promised, and two in a row may be late.
REPEATS = 4
LAST_WORD = 0.2  # s for readers to confirm it
LOG_PERIOD = 1.0  # s


class StopSignal:
    """Says what ``state`` says, at once and again and again, until it is closed: then true for the last time.

    Of a configured ``node``; ended where that is unconfigured.
    """

    def __init__(self, node: GuardedLifecycleNode, state: StopState, timeout: float) -> None:
        self._node = node
        self._state = state
        self._period = timeout / REPEATS
        self._publisher = node.configured_publisher(Bool, topic_names.STOP, qos.stop(timeout))
        self._log_after, self._logged = 0.0, ""
        self._thread = threading.Thread(target=self._run, name="stop", daemon=True)
        self._thread.start()
        node.when_unconfigured(self.close)

    def close(self) -> None:
        """Needs no valid context; what was closed may be closed again."""
        if self._state.closed:
            return
        self._state.close()
        self._thread.join()
        if self._node.context.ok():
            self._publisher.wait_for_all_acked(Duration(seconds=LAST_WORD))

    def _run(self) -> None:
        due = 0.0
        while True:
            why = self._state.next(due)
            due = time.monotonic() + self._period
            if why is None and self._state.why() is not None:
                continue  # it took too long: the state is no longer valid
            try:
                self._publisher.publish(Bool(data=why is not None))
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
        self._node.get_logger().info(text)
