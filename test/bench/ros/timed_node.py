# SPDX-License-Identifier: Apache-2.0
"""The node, with a note of when each frame passed through it: `python -m bench.ros.timed_node --ros-args ...`

At its end it writes FILE (variable HPCCD_BENCH_TIMES): for each step [step, received, detected, published, detect_ms,
core_ms], times in s of CLOCK_MONOTONIC, which all processes of a machine share.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.node import node, run

VARIABLE = "HPCCD_BENCH_TIMES"


class TimedNode(node.HpccdNode):
    """Beside the node itself: two looks at the clock and one append a frame."""

    def __init__(self) -> None:
        super().__init__()
        self.times: list[tuple[int, float, float, float, float, float]] = []

    def _publish(self, found: Detection) -> None:
        detected = time.monotonic()
        super()._publish(found)
        core_ms = found.profile.get("total", found.detect_ms)
        self.times.append((found.end.step, found.end.received, detected, time.monotonic(), found.detect_ms, core_ms))

    def destroy_node(self) -> None:
        Path(os.environ[VARIABLE]).write_text(json.dumps(self.times), encoding="utf-8")
        super().destroy_node()


if __name__ == "__main__":
    sys.exit(run.main(node_type=TimedNode))
