# SPDX-License-Identifier: Apache-2.0
"""Waiting for the subscribers of a publisher. DDS matches both ends one after the other.

A publisher may know its reader seconds before the reader knows it (up to a third of healthy_check_timeout_ms of
config/fastdds*.xml). Messages published meanwhile arrive late, and those that the publisher's history no longer has
are lost. So a stream begins in two steps: `await_subscribers`, then one message and `await_acknowledged`.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence

from rclpy.duration import Duration
from rclpy.publisher import Publisher


def await_subscribers(
    publishers: Mapping[str, Publisher], wanted: int, wait: float, stop: Sequence = ()
) -> dict[str, int]:
    """Wait until each publisher has `wanted` subscribers, at most `wait` s or until `stop` is not empty.

    Returns the publishers with fewer, and their numbers of subscribers.
    """
    deadline = time.monotonic() + wait
    while True:
        found = {name: publisher.get_subscription_count() for name, publisher in publishers.items()}
        lacking = {name: count for name, count in found.items() if count < wanted}
        if not lacking or stop or time.monotonic() >= deadline:
            return lacking
        time.sleep(0.02)


def await_acknowledged(publishers: Iterable[Publisher], wait: float, stop: Sequence = ()) -> float:
    """Wait until every reliable reader has all messages, at most `wait` s or until `stop` is not empty.

    Returns the time that it took, s.
    """
    begin = time.monotonic()
    for publisher in publishers:
        # In short intervals, because signals are handled between them.
        while not publisher.wait_for_all_acked(Duration(seconds=0.1)):
            if stop or time.monotonic() - begin >= wait:
                break
    return time.monotonic() - begin
