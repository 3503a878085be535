# SPDX-License-Identifier: Apache-2.0
"""A signal ends the node at once, however long the detection that is under way still takes."""

import resource
import signal

import pytest
from long_step import END, MESHES, START, N, long_request, step_needs_more_than
from node_process import PATIENCE
from waving_sheet import sheet_faces

from hpccd_ros.bag.examine import examine

ALONE = {"meshes": list(MESHES), "threads": 1, "accuracy": "exact"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_of_the_stream(start_node, tmp_path, number):
    own = tmp_path / "own.mcap"
    node = start_node({**ALONE, "record": str(own)})
    for mesh in MESHES:
        node.peer.topology(mesh, sheet_faces(N), N * N)
    for stamp, positions in enumerate((START, END)):
        for mesh in MESHES:
            node.peer.vertices(mesh, positions, stamp)
        node.frames_status(received=2 * stamp + 2, processed=2, waiting=2 * stamp)
    assert node.stop(number) == 0, node.output()
    counts = {topic.partition("/meshes/")[2] or topic: count for topic, count in examine(own).counts.items()}
    assert counts == {f"{mesh}/{kind}": n for mesh in MESHES for kind, n in (("topology", 1), ("vertices", 2))}, (
        "it did not wait for the answer"
    )
    assert "Traceback" not in node.output()


def test_of_a_request(start_node):
    node = start_node({**ALONE, "detect_time_limit": 600.0})
    reply = node.peer.client().call_async(long_request())
    node.wait_until(lambda: node.peer.statuses["service"][2]["open"] == "1", "request under way")
    before = cpu_of_ended_children()
    assert node.stop() == 0, node.output()
    used = cpu_of_ended_children() - before
    assert "Traceback" not in node.output()
    # Not spin_once: it may take one of the node's last messages instead. No node is left that could still respond.
    node.peer.executor.spin_until_future_complete(reply, timeout_sec=PATIENCE)
    assert reply.done() and reply.result().message.startswith("stopped: "), "told before the node was gone"
    assert step_needs_more_than(used), f"it took {used:.1f} s of a core: it did not wait for the answer"


def cpu_of_ended_children():
    """Seconds of a core, which unlike the time on a clock hardly depend on how busy the machine is."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
