# SPDX-License-Identifier: Apache-2.0
"""The bounded queue between receiving and detecting."""

import threading

import numpy as np
import pytest

from hpccd_ros.frames.frame_queue import FrameQueue
from hpccd_ros.frames.types import SceneFrame, Topology

OLD, NEW = (Topology(v, 3, np.array([[0, 1, 2]], np.uint32)) for v in (0, 1))


def frame(stamp, topology=OLD):
    return SceneFrame(stamp, stamp, "", (topology,), (np.zeros((3, 3)),), ("cloth",), 0.0)


def stamps(frames):
    return [f.stamp for f in frames]


def pop_all(queue):
    return [(item.frame.stamp, item.first) for item in iter(lambda: queue.pop() if queue.frames() else None, None)]


def test_latest_wins_and_the_start_is_kept():
    queue = FrameQueue(1)
    assert [stamps(queue.put(frame(k))) for k in range(4)] == [[], [], [1], [2]]
    assert pop_all(queue) == [(0, True), (3, False)]
    assert [stamps(queue.put(frame(k))) for k in (4, 5)] == [[], [4]]
    assert pop_all(queue) == [(5, False)]


def test_longer_queue_keeps_order():
    queue = FrameQueue(2)
    assert [stamps(queue.put(frame(k))) for k in range(4)] == [[], [], [], [1]]
    assert pop_all(queue) == [(0, True), (2, False), (3, False)]


def test_other_topology_and_earlier_stamp_start_anew():
    queue = FrameQueue(10)
    for item in (frame(5), frame(6), frame(7, NEW), frame(8, NEW), frame(1, NEW), frame(2, NEW)):
        assert queue.put(item) == []
    assert [first for _, first in pop_all(queue)] == [True, False, True, False, True, False]


def test_starts_that_lost_their_end_are_dropped():
    queue = FrameQueue(1)
    assert queue.put(frame(0)) == queue.put(frame(1)) == queue.put(frame(2, NEW)) == []
    assert stamps(queue.put(frame(3, NEW))) == [1, 0]
    assert pop_all(queue) == [(2, True), (3, False)]


def test_memory_is_bounded_where_every_frame_starts_anew():
    queue, lost = FrameQueue(2), []
    for k in range(100):
        lost += queue.put(frame(k, Topology(k, 3, OLD.faces)))
    assert stamps(lost) == list(range(99)) and stamps(queue.frames()) == [99]


def test_close_returns_what_is_left_and_ends_the_reader():
    queue, got = FrameQueue(3), []
    reader = threading.Thread(target=lambda: [got.append(item.frame.stamp) for item in iter(queue.pop, None)])
    queue.put(frame(7))
    reader.start()
    while queue.frames():
        pass
    assert queue.close() == []
    reader.join(timeout=300)
    assert not reader.is_alive() and got == [7]
    assert stamps(queue.put(frame(8))) == [8]
    assert queue.pop() is None


def test_nothing_is_lost_between_threads():
    queue, got, lost = FrameQueue(2), [], []
    reader = threading.Thread(target=lambda: [got.append(item.frame) for item in iter(queue.pop, None)])
    reader.start()
    for k in range(5000):
        lost += queue.put(frame(k, OLD if k % 7 else NEW))
    lost += queue.close()
    reader.join(timeout=300)
    assert sorted(stamps(got + lost)) == list(range(5000))
    assert stamps(got) == sorted(stamps(got))


def test_capacity_must_be_positive():
    with pytest.raises(ValueError, match="capacity must be at least 1"):
        FrameQueue(0)
