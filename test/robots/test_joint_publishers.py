# SPDX-License-Identifier: Apache-2.0
"""Several publishers of joint states: which one sent a message, and whether two contradict each other."""

import math

import pytest

from hpccd_ros.frames.samples import HISTORY_NS
from hpccd_ros.robots.joint_history import RobotError, check_lengths
from hpccd_ros.robots.joint_publishers import MOST_PUBLISHERS, JointPublishers, PublisherNumbers

SECOND = 10**9


def test_publishers_are_told_apart_by_their_numbers():
    numbers = PublisherNumbers()
    assert [numbers.of(number, lambda: False) for number in (5, 6, 9, 1, 2)] == [None] * 5, "one, one that begins again"
    labels = [numbers.of(number, lambda: True) for number in (700, 3, 701, 4, 705, 6, 706)]
    assert labels == [1, 0] * 3 + [1]
    assert [numbers.of(number, lambda: False) for number in (1, 2)] == [None, None], "all others have left"
    for publisher in range(3 * MOST_PUBLISHERS):
        numbers.of(10**6 - publisher, lambda: True)
    assert len(numbers._last) == MOST_PUBLISHERS


def said(publishers, *messages):
    """Whether each message (publisher, seconds, value of the joint z) contradicts."""
    return [bool(publishers.contradiction(who, round(at * SECOND), [("z", value)])) for who, at, value in messages]


def test_two_that_differ_contradict_each_other_until_one_is_silent():
    publishers = JointPublishers(())
    assert said(publishers, (0, 1, 0.0), (1, 1.5, -2.0), (0, 2, 0.0)) == [False, False, True]
    assert said(publishers, (1, 2.5, -2.0), (0, 3, 0.0), (0, 3.1, 0.0), (0, 12, 0.0)) == [True] * 4
    assert "joint 'z', one sent 0 for 12500000000 ns" in publishers.contradiction(0, 12_500_000_000, [("z", 0.0)])
    assert said(publishers, (0, 2.6 + HISTORY_NS / SECOND, 0.0)) == [False]
    assert said(publishers, (0, 20, 0.0), (1, 20, 1e-3)) == [False, True], "at the same time"
    assert not publishers.contradiction(0, 21 * SECOND, [("other", 5.0)]), "a joint that only it publishes"


@pytest.mark.parametrize("continuous", [False, True])
def test_two_that_say_the_same_agree(continuous):
    """At the same times, or at others of the same motion; of a joint that turns round, modulo a turn."""
    publishers = JointPublishers(("z",) if continuous else ())
    turn = 2 * math.pi if continuous else 0.0
    motion = [(at / 10, math.sin(at / 10)) for at in range(100)]
    messages = [(who, at + 0.05 * who * (step % 2), value) for step, (at, value) in enumerate(motion) for who in (0, 1)]
    messages = [(who, at, math.sin(at) + turn * who) for who, at, _ in messages]
    assert not any(said(publishers, *messages))


def test_a_joint_named_twice():
    with pytest.raises(RobotError, match="joint states: 'z' is named twice; name each joint once in a message"):
        check_lengths(["a", "z", "z"], [0.0, 0.0, 0.0])
