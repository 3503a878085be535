# SPDX-License-Identifier: Apache-2.0
"""rclpy's life-cycle node, with what it lacks: errors of transitions are told."""

from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from hpccd_ros.guard import Errors

Transition = Callable[[LifecycleState], TransitionCallbackReturn]


class GuardedLifecycleNode(LifecycleNode):
    """errors: what this node's callbacks raised that nothing expected; for the node's executor too."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.errors = Errors(self.get_logger().error)
        self._callbacks = {state: self._guarded(callback) for state, callback in self._callbacks.items()}

    @property
    def state(self) -> str:
        """Label of the life-cycle state."""
        return self._state_machine.current_state[1]

    def _guarded(self, callback: Transition) -> Transition:
        def transition(state: LifecycleState) -> TransitionCallbackReturn:
            try:
                return callback(state)
            except Exception as error:
                # rclpy goes on with `on_error`, without a word about what was raised.
                self.errors.caught(callback.__name__, error)
                return TransitionCallbackReturn.ERROR

        return transition
