# SPDX-License-Identifier: Apache-2.0
"""The bounded queue between receiving and detecting."""

import threading

import pytest

from hpccd_ros.mailbox import Mailbox


def test_latest_wins():
    box = Mailbox(1)
    assert [box.put(i) for i in range(4)] == [[], [0], [1], [2]]
    assert box.take() == 3


def test_longer_queue_keeps_order():
    box = Mailbox(2)
    assert [box.put(i) for i in range(3)] == [[], [], [0]]
    assert (box.take(), box.take()) == (1, 2)


def test_close_returns_what_is_left_and_ends_the_reader():
    box = Mailbox(3)
    got = []
    reader = threading.Thread(target=lambda: [got.append(item) for item in iter(box.take, None)])
    box.put("a")
    reader.start()
    while box.items():
        pass
    assert box.close() == []
    reader.join(timeout=30)
    assert not reader.is_alive() and got == ["a"]
    assert box.put("b") == ["b"]
    assert box.take() is None


def test_nothing_is_lost_between_threads():
    box, got, lost = Mailbox(2), [], []
    reader = threading.Thread(target=lambda: [got.append(item) for item in iter(box.take, None)])
    reader.start()
    for i in range(5000):
        lost += box.put(i)
    lost += box.close()
    reader.join(timeout=30)
    assert sorted(got + lost) == list(range(5000))
    assert got == sorted(got)


def test_capacity_must_be_positive():
    with pytest.raises(ValueError, match="capacity must be at least 1"):
        Mailbox(0)
