# SPDX-License-Identifier: Apache-2.0
"""The node's accounts: everything that comes up is counted once, and logged where there is something to say. No ROS."""

import numpy as np

from hpccd_ros.frames.drops import Input, Reason, Rejection
from hpccd_ros.frames.types import Outcome, SceneFrame, Topology
from hpccd_ros.node.accounts import Accounts

TOPOLOGY = Topology(0, 3, np.array([[0, 1, 2]], np.uint32))
FRAME = SceneFrame(7, 1, "", (TOPOLOGY,) * 2, (np.zeros((3, 3)),) * 2, ("cloth", "ball"), 0.0)


def accounts():
    log = []
    return Accounts(log.append), log


def test_what_came_of_a_message():
    of_node, log = accounts()
    rejections = [
        Rejection("cloth", Reason.RESTART),
        Rejection("cloth", Reason.LATE, "stamp 3 ns was processed"),
        Rejection("ball", Reason.OLD_TOPOLOGY, "version 1 is older", what=Input.TOPOLOGY),
        Rejection("ball", Reason.MIDDLEWARE, "4 messages", messages=4),
    ]
    of_node.add(Outcome([FRAME], rejections, ["mesh cloth goes on: taken as a restart"], static_taken=2))
    assert of_node.dropped.by_mesh_and_reason() == {
        ("cloth", "restart"): 1,
        ("cloth", "late"): 1,
        ("ball", "middleware"): 4,
    }
    assert of_node.topologies_rejected.by_mesh_and_reason() == {("ball", "old_topology"): 1}
    assert (of_node.restarts, of_node.static_taken, of_node.metrics.snapshot()["processed"]) == (1, 2, 0)
    assert log == [
        "mesh cloth goes on: taken as a restart",
        "cloth: late: stamp 3 ns was processed",
        "ball: old_topology: version 1 is older",
        "ball: middleware: 4 messages",
    ]
    assert of_node.log.last == log[-1]


def test_a_frame_without_a_result_is_a_drop_of_each_message():
    of_node, log = accounts()
    of_node.not_processed(FRAME, Reason.DETECTION_FAILED)
    of_node.failed(FRAME, MemoryError("no room"))
    of_node.not_processed(FRAME, Reason.STOPPED)
    assert of_node.dropped.by_reason() == {Reason.DETECTION_FAILED: 2, Reason.STOPPED: 2}
    counts = of_node.metrics.snapshot()
    assert (counts["failures"], counts["last_failure"], counts["processed"]) == (1, "MemoryError: no room", 0)
    assert log == ["scene: detection_failed: step that ends at 7 ns: no room"]
