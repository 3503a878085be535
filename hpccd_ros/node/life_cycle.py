# SPDX-License-Identifier: Apache-2.0
"""rclpy's life-cycle node with additions: invalid transitions are rejected, errors of transitions are reported, and the
resources that `on_configure` creates are released by `unconfigure`."""

import contextlib
from collections.abc import Callable
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from hpccd_ros.middleware import qos_overrides
from hpccd_ros.middleware.executors import Errors

Transition = Callable[[LifecycleState], TransitionCallbackReturn]


class GuardedLifecycleNode(LifecycleNode):
    """errors: unexpected exceptions of this node's callbacks; the node's executor uses it too."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.errors = Errors(self.get_logger().error)
        self._callbacks = {state: self._guarded(callback) for state, callback in self._callbacks.items()}
        self._configured = contextlib.ExitStack()
        service = self._service_change_state
        service.callback = self._reject_or(service.callback)

    @property
    def state(self) -> str:
        """Label of the life-cycle state."""
        return self._state_machine.current_state[1]

    def configured_publisher(self, kind: type, topic: str, profile: QoSProfile) -> Publisher:
        """A publisher until `unconfigure`."""
        publisher = qos_overrides.create_publisher(self, kind, topic, profile)
        self._configured.callback(self.destroy_publisher, publisher)
        return publisher

    def configured_timer(self, period: float, callback: Callable[[], None]) -> None:
        """A timer until `unconfigure`. In steady time: it runs while simulated time stands still."""
        timer = self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._configured.callback(self.destroy_timer, timer)

    def when_unconfigured(self, callback: Callable[[], None]) -> None:
        """Call it once at the next `unconfigure`, before resources that were created earlier are destroyed."""
        self._configured.callback(callback)

    def unconfigure(self) -> None:
        self._configured.close()

    def destroy_node(self) -> None:
        """Destroy its DDS entities too: the participant is gone when this returns."""
        super().destroy_node()
        # rclpy 7.1 leaves the state machine alive, which holds the rcl node and so the DDS participant; after gc.freeze
        # no garbage collection frees it. Fast DDS then deleted the participant in its static destructors, while the
        # discovery thread of rmw_fastrtps still used it: the process ended with SIGSEGV or SIGABRT.
        self._state_machine.destroy_when_not_in_use()

    def _guarded(self, callback: Transition) -> Transition:
        def transition(state: LifecycleState) -> TransitionCallbackReturn:
            try:
                return callback(state)
            except Exception as error:
                # rclpy goes on with `on_error`, without a word about what was raised.
                self.errors.caught(callback.__name__, error)
                return TransitionCallbackReturn.ERROR

        return transition

    def _reject_or(self, change: Callable) -> Callable:
        # rclpy 7.1 raises for a transition that the state does not have (ros2/rclpy#1209).
        def change_state(request: ChangeState.Request, response: ChangeState.Response) -> ChangeState.Response:
            wanted = request.transition
            offered = {label: number for number, label, *_ in self._state_machine.available_transitions}
            if wanted.label in offered if wanted.label else wanted.id in offered.values():
                return change(request, response)
            self.get_logger().warning(
                f"transition {wanted.label or wanted.id}: not available while the node is {self.state}; use one of "
                + (", ".join(f"{label} ({number})" for label, number in offered.items()) or "none"),
                throttle_duration_sec=1.0,
            )
            response.success = False
            return response

        return change_state
