# SPDX-License-Identifier: Apache-2.0
"""Goals of the action ~/detect, sent to a NodeProcess by rclpy's own ActionClient."""

from action_msgs.msg import GoalStatus
from hpccd.action import Detect
from node_process import PATIENCE
from rclpy.action import ActionClient

from hpccd_ros import client

SUCCEEDED, CANCELED, ABORTED = (
    GoalStatus.STATUS_SUCCEEDED,
    GoalStatus.STATUS_CANCELED,
    GoalStatus.STATUS_ABORTED,
)


class Goals:
    """A client of its own. peer: whose node it belongs to; that of the NodeProcess unless another is given."""

    def __init__(self, node, peer=None):
        self._node = node
        self._peer = peer
        self._client = ActionClient((peer or node.peer).node, Detect, "hpccd/detect")
        assert self._client.wait_for_server(PATIENCE)

    def wait_until(self, condition, what):
        def heard():
            if self._peer is not None:
                self._peer.executor.spin_once(timeout_sec=0.0)
            return condition()

        self._node.wait_until(heard, what)

    def send(self, request):
        """Accepted, its result asked for."""
        return self.send_all([request])[0]

    def send_all(self, requests):
        """All under way at once."""
        goals = [Goal(self) for _ in requests]
        futures = [
            self._client.send_goal_async(client.goal_from_request(request), feedback_callback=goal.heard)
            for request, goal in zip(requests, goals, strict=True)
        ]
        self.wait_until(lambda: all(future.done() for future in futures), "results to the goals")
        for goal, future in zip(goals, futures, strict=True):
            goal.handle = future.result()
            if goal.handle.accepted:
                goal.reply = goal.handle.get_result_async()
        return goals


class Goal:
    """feedback: all that came, in order."""

    def __init__(self, goals):
        self._goals = goals
        self.feedback = []
        self.handle = self.reply = None

    @property
    def stages(self):
        return [feedback.stage for feedback in self.feedback]

    def heard(self, message):
        self.feedback.append(message.feedback)

    def ended(self):
        """(status, result)"""
        self._goals.wait_until(self.reply.done, "result of the goal")
        return self.reply.result().status, self.reply.result().result

    def cancel(self):
        """How many goals the node says that it cancels."""
        future = self.handle.cancel_goal_async()
        self._goals.wait_until(future.done, "result to the request to cancel")
        return len(future.result().goals_canceling)
