# SPDX-License-Identifier: Apache-2.0
"""rclpy's action server with limits, and with a shutdown that responds to all waiting clients.

rclpy 7.1 stores the request and the result of each goal as long as results are kept, by default 15 minutes, of a clock
that may be simulated and stand still. This module overrides and reads rclpy's private methods and fields.
"""

import math
import time
from collections.abc import Callable, Coroutine
from typing import Any

from rclpy.action import GoalResponse
from rclpy.action.server import ActionServer, ServerGoalHandle
from rclpy.clock import Clock, ClockType
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Task

# Seconds that a goal and its result are kept after its end. Clients request the result as soon as the goal is accepted,
# so most requests come before the result.
KEPT = 10


class BoundedActionServer(ActionServer):
    """goals: most goals known at a time, including ended ones; more are rejected. room: results passed to `keep` are
    kept while the sum of their sizes is at most this; the last one is always kept.

    requests: QoS of all three services. rejected: called for each rejected goal. forgotten: called with a result to
    empty it. execute: coroutine function of the goal's handle; it ends the goal and returns the result.
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        name: str,
        execute: Callable[[ServerGoalHandle], Coroutine[Any, Any, Any]],
        *,
        goals: int,
        room: int,
        requests: QoSProfile,
        rejected: Callable[[], None],
        forgotten: Callable[[Any], None],
        **options: Any,
    ) -> None:
        super().__init__(
            _InSystemTime(node),
            kind,
            name,
            execute,
            goal_callback=self._decide,
            goal_service_qos_profile=requests,
            result_service_qos_profile=requests,
            cancel_service_qos_profile=requests,
            result_timeout=KEPT,
            **options,
        )
        self._goals = goals
        self._rejected = rejected
        self._forgotten = forgotten
        self._whole: dict[bytes, tuple[Any, int]] = {}  # result and size, the oldest first
        self._room = room
        self._closing = False
        self._unasked: set[bytes] = set()  # goals whose result was not requested yet
        self.last_sent = -math.inf  # time.monotonic() of the last result

    def keep(self, goal: ServerGoalHandle, result: Any, size: int) -> None:
        """Keep the result of a goal that ends now, until others need its room."""
        self._whole[bytes(goal.goal_id.uuid)] = result, size
        while len(self._whole) > 1 and sum(size for _, size in self._whole.values()) > self._room:
            oldest, _ = self._whole.pop(next(iter(self._whole)))
            self._forgotten(oldest)

    def finish(self, executor: Executor, patience: float) -> None:
        """Run the waiting tasks of goals that were ended, and send results, including those requested within
        ``patience`` seconds; new goals are rejected. In the executor's thread.
        """
        self._closing = True
        _run_tasks(executor)
        deadline = time.monotonic() + patience
        with self._handle:
            while time.monotonic() < deadline:
                if self._serve():
                    _run_tasks(executor)
                elif not self._unasked:
                    return
                else:
                    time.sleep(0.001)

    def _serve(self) -> bool:
        """Whether at least one request was waiting."""
        found = False
        implementation = self.action_type.Impl
        for take, kind, work in (
            (self._handle.take_goal_request, implementation.SendGoalService, self._execute_goal_request),
            (self._handle.take_cancel_request, implementation.CancelGoalService, self._execute_cancel_request),
            (self._handle.take_result_request, implementation.GetResultService, self._execute_get_result_request),
        ):
            taken = take(kind.Request)
            if all(taken):
                found = True
                _run(work(taken))
        return found

    def _decide(self, goal: Any) -> GoalResponse:
        if self._closing or len(self._goal_handles) >= self._goals:
            self._rejected()
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _execute_goal(self, execute: Any, goal: ServerGoalHandle) -> None:
        self._unasked.add(bytes(goal.goal_id.uuid))
        await super()._execute_goal(execute, goal)
        goal._goal_request = None  # megabytes

    async def _execute_get_result_request(self, request: Any) -> None:
        self._unasked.discard(bytes(request[1].goal_id.uuid))
        await super()._execute_get_result_request(request)

    async def _execute_expire_goals(self, expired: Any) -> None:
        for goal in expired:
            self._unasked.discard(bytes(goal.goal_id.uuid))
            self._whole.pop(bytes(goal.goal_id.uuid), None)
        await super()._execute_expire_goals(expired)

    def _send_result_response(self, header: Any, future: Any) -> None:
        super()._send_result_response(header, future)
        self.last_sent = time.monotonic()


class _InSystemTime:
    """A node for the action server, with the system clock, which never stands still."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._clock = Clock(clock_type=ClockType.SYSTEM_TIME)

    def get_clock(self) -> Clock:
        return self._clock

    def __getattr__(self, name: str) -> Any:
        return getattr(self._node, name)


def _run_tasks(executor: Executor) -> None:
    """Run tasks without an entity, such as rclpy's tasks of goals, and tasks that they create, such as sending a
    result."""
    seen: set[Task] = set()
    while new := [task for task, entity, _ in tuple(executor._tasks) if entity is None and task not in seen]:
        for task in new:
            seen.add(task)
            task()


def _run(work: Coroutine[Any, Any, None]) -> None:
    """Run it to its end: it does not wait for long."""
    try:
        while True:
            work.send(None)
    except StopIteration:
        pass
