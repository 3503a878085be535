# SPDX-License-Identifier: Apache-2.0
"""A signal ends the node at once, however long the detection that is under way still takes."""

import resource
import signal
import threading
import time

import pytest
from test_node_service import request
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.mcap_recover import examine

# A million contacts, nearly all degenerate, on one thread: tens of seconds of exact arithmetic.
N = 300
STEP = (2, 3)
ALONE = {"meshes": ["cloth"], "threads": 1, "accuracy": "exact"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_of_the_stream(start_node, tmp_path, number):
    own = tmp_path / "own.mcap"
    node = start_node({**ALONE, "record": str(own)})
    node.peer.topology("cloth", sheet_faces(N), N * N)
    node.peer.vertices("cloth", sheet_positions(N, STEP[0]), stamp=0)
    node.frames_status(answered=1)
    node.peer.vertices("cloth", sheet_positions(N, STEP[1]), stamp=1)
    node.frames_status(received=2, waiting=1)
    assert node.stop(number) == 0, node.output()
    counts = {topic.rpartition("/")[2]: count for topic, count in examine(own).counts.items()}
    assert counts == {"topology": 1, "vertices": 2}, "it did not wait for the answer"
    assert "Traceback" not in node.output()


def test_of_a_request(start_node):
    node = start_node({**ALONE, "detect_time_limit": 600.0})
    reply = node.peer.client().call_async(request(STEP[0], n=N))
    node.wait_until(lambda: node.peer.statuses["service"][2]["open"] == "1", "request under way")
    before = cpu_of_ended_children()
    assert node.stop() == 0, node.output()
    used = cpu_of_ended_children() - before
    assert not reply.done() and "Traceback" not in node.output()
    assert step_needs_more_than(used), f"it took {used:.1f} s of a core: it did not wait for the answer"


def cpu_of_ended_children():
    """Seconds of a core, which unlike the time on a clock hardly depend on how busy the machine is."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def step_needs_more_than(seconds):
    """Whether the step, computed here, is still under way after so many seconds of a core."""
    detector = hc.Detector(scene_of(cloth=sheet_faces(N)), threads=1, accuracy="exact")
    under_way = threading.Thread(target=lambda: given_up.append(not finishes(detector)))
    given_up, begin = [], time.process_time()
    under_way.start()
    while under_way.is_alive() and time.process_time() - begin < seconds:
        time.sleep(0.05)
    detector.cancel()
    under_way.join()
    return given_up[0]


def finishes(detector):
    try:
        detector.detect(*(sheet_positions(N, k) for k in STEP))
    except hc.Cancelled:
        return False
    return True
