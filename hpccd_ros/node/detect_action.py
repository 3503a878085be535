# SPDX-License-Identifier: Apache-2.0
"""Action ``~/detect``: the queries of the service, with feedback, cancelled with the goal."""

import itertools
import math
import time

from hpccd.action import Detect
from rclpy.action import CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType

from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.middleware.action_server import KEPT, BoundedActionServer
from hpccd_ros.node.detect_jobs import DetectJobs, Ticket
from hpccd_ros.node.detect_query import WAITING
from hpccd_ros.node.detect_service import DELIVERY, FAREWELL, ROOM_TO_REJECT
from hpccd_ros.node.life_cycle import GuardedLifecycleNode

# s between feedback messages of a goal.
PERIOD = 0.2
# Goals that get feedback in one period, in turn: with thousands of them the node would do little else.
MOST_TOLD = 50
# Contacts in all kept results: about 100 MB.
MOST_KEPT = 1_000_000
CANCELED = "canceled: as the client asked"
DEACTIVATED = (
    "stopped: the node was deactivated before the result was ready; send the goal again when the node is active"
)
FORGOTTEN = (
    f"the result was given up for later ones: results are kept for {KEPT} s, and no more than {MOST_KEPT} contacts "
    "in all; ask for it as soon as the goal is accepted"
)


class DetectAction:
    """Each goal gets the result of ``jobs``: it succeeds with one, is canceled if the client requests it, and is
    aborted, with the reason as message, if the service would reject it.
    """

    def __init__(self, node: GuardedLifecycleNode, jobs: DetectJobs) -> None:
        self._node = node
        self._jobs = jobs
        self._open: dict[bytes, tuple[ServerGoalHandle, Ticket]] = {}
        group = ReentrantCallbackGroup()
        self._server = BoundedActionServer(
            node,
            Detect,
            topic_names.DETECT,
            self._execute,
            goals=jobs.capacity + ROOM_TO_REJECT,
            room=MOST_KEPT,
            requests=qos.requests(jobs.capacity + ROOM_TO_REJECT),
            rejected=self._count_rejected,
            forgotten=_forget,
            handle_accepted_callback=self._accept,
            cancel_callback=self._cancel,
            callback_group=group,
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(
            PERIOD, self._send_feedback, callback_group=group, clock=steady, autostart=False
        )

    def stop(self) -> None:
        """Open goals are aborted at the executor's next turn."""
        for _, ticket in tuple(self._open.values()):
            ticket.give_up("stopped", DEACTIVATED)

    def close(self) -> None:
        """End all goals, then the action. In the thread of the executor; after ``jobs.close()``."""
        executor = self._node.executor
        if executor is not None and self._node.context.ok():
            self._server.finish(executor, FAREWELL)
            time.sleep(max(0.0, self._server.last_sent + DELIVERY - time.monotonic()))
        self._node.destroy_timer(self._timer)
        self._server.destroy()

    def _accept(self, goal: ServerGoalHandle) -> None:
        ticket = Ticket(WAITING, on_place=lambda: self._feedback(goal, ticket, self._jobs.places()))
        self._open[bytes(goal.goal_id.uuid)] = goal, ticket
        if self._timer.is_canceled():
            self._timer.reset()
        goal.execute()

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        if (open_ := self._open.get(bytes(goal.goal_id.uuid))) is None:
            return CancelResponse.REJECT
        open_[1].give_up("canceled", CANCELED)
        return CancelResponse.ACCEPT

    async def _execute(self, goal: ServerGoalHandle) -> Detect.Result:
        name = bytes(goal.goal_id.uuid)
        _, ticket = self._open[name]
        try:
            result = await self._jobs.fill(goal.request, Detect.Result(), ticket)
        finally:
            del self._open[name]
            if not self._open:
                self._timer.cancel()
        if ticket.ended == "succeeded":
            self._server.keep(goal, result, len(result.contacts.kind))
            goal.succeed()
        elif ticket.ended == "canceled":
            goal.canceled()
        else:
            goal.abort()
        return result

    def _send_feedback(self) -> None:
        places = self._jobs.places()
        for name in tuple(itertools.islice(self._open, MOST_TOLD)):
            self._open[name] = oldest = self._open.pop(name)  # to the end: the others are next
            self._feedback(*oldest, places)

    def _feedback(self, goal: ServerGoalHandle, ticket: Ticket, places: dict[Ticket, int]) -> None:
        feedback = Detect.Feedback(seconds=ticket.seconds, time_limit=ticket.time_limit)
        feedback.stage, feedback.ahead = ticket.stage, 0
        if (ahead := places.get(ticket)) is not None:
            feedback.stage, feedback.ahead = WAITING, ahead
        goal.publish_feedback(feedback)

    def _count_rejected(self) -> None:
        self._jobs.count("busy")


def _forget(result: Detect.Result) -> None:
    empty = Detect.Result(message=FORGOTTEN, collision_free_step=math.nan)
    for field in Detect.Result.get_fields_and_field_types():
        setattr(result, field, getattr(empty, field))
