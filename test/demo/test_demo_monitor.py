# SPDX-License-Identifier: Apache-2.0
"""The demo's view of the node: results and dropped frames, as the node counts them."""

import time

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from live import PATIENCE

from hpccd_ros.demo.monitor import Monitor


def _status(part, **values):
    pairs = [KeyValue(key=key.replace("__", "."), value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(name=f"/hpccd: {part}", values=pairs)


@pytest.fixture
def told():
    """A monitor that was told of 63 results and 26 frames of two meshes that were dropped."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("told", context=context, start_parameter_services=False)
    publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
    frames = _status(
        "frames",
        dropped=52,
        dropped__overload=52,
        dropped__cloth__overload=26,
        dropped__ball__overload=20,
        dropped__ball__late=6,
    )
    detection = _status("detection", detections=63, detect_ms__p50="2.5")
    with Monitor() as monitor:
        deadline = time.monotonic() + PATIENCE
        while monitor.core_ms is None or not monitor.dropped:
            assert time.monotonic() < deadline, "the monitor heard nothing"
            publisher.publish(DiagnosticArray(status=[frames, detection]))
            monitor.listen(0.1)
        yield monitor
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_a_dropped_frame_of_two_meshes_is_one(told):
    assert told.dropped == 26


def test_results_that_were_not_heard_count_too(told):
    assert (told.results, told.core_ms) == (63, 2.5)
