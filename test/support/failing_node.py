# SPDX-License-Identifier: Apache-2.0
"""The node with injected faults that its code does not expect: a program for test_guard.py."""

import sys

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.node import node, run


class FailingNode(node.HpccdNode):
    def __init__(self) -> None:
        super().__init__()
        self.activations = 0
        self.create_timer(0.01, self.fail_on_time)
        self.create_service(SetParametersAtomically, "~/fail", self.fail_on_request)
        self.add_post_set_parameters_callback(self.fail_after_setting)

    def fail_on_time(self) -> None:
        raise LookupError("timer")

    def fail_on_request(self, request: object, response: object) -> object:
        raise LookupError("request")

    def fail_after_setting(self, parameters: list) -> None:
        if any(parameter.name == "markers_max" for parameter in parameters):
            raise LookupError("parameter")

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        super().on_activate(state)
        self.activations += 1
        if self.activations == 2:
            raise LookupError("transition")
        return TransitionCallbackReturn.SUCCESS

    def _publish(self, found: Detection) -> None:
        if found.end.stamp == 2:
            raise LookupError("detection thread")
        super()._publish(found)


if __name__ == "__main__":
    sys.exit(run.main(node_type=FailingNode))
