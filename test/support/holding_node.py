# SPDX-License-Identifier: Apache-2.0
"""The node with faults in its threads, for test_stop_fails_safe.py.

In the step that ends at stamp RAISES its detection raises an unexpected exception; at HANGS it hangs for HELD seconds,
and so does its executor after a change of markers_max.
"""

import sys
import time

from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.node import node, run

RAISES, HANGS = 1_000_000, 2_000_000
HELD = 4.0


class HoldingNode(node.HpccdNode):
    def __init__(self) -> None:
        super().__init__()
        self.add_post_set_parameters_callback(self.hang_after_setting)

    def hang_after_setting(self, parameters: list) -> None:
        if any(parameter.name == "markers_max" for parameter in parameters):
            time.sleep(HELD)

    def _publish(self, found: Detection) -> None:
        if found.end.stamp == RAISES:
            raise LookupError("detection thread")
        if found.end.stamp == HANGS:
            time.sleep(HELD)
        super()._publish(found)


if __name__ == "__main__":
    sys.exit(run.main(node_type=HoldingNode))
