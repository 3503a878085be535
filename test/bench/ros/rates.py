# SPDX-License-Identifier: Apache-2.0
"""Frames at a fixed rate, whether the node keeps up or not: what was answered, what was dropped, and its memory."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.ros.link import Link
from bench.ros.node_process import NodeStatus, resident_mb

SETTLE = 10.0  # s for the last diagnostics to come
TRIAL = 3.0  # s of a trial in the search of the sustained rate
FINER = 1.1  # ratio of the rates that the search tries


@dataclass
class Trial:
    """rate: frames a second as sent. latency: publish to contacts of the frames answered, ms (p50, p95, p99).
    memory: resident MB of the node in the first and the last fifth of the time (medians), and the most.
    unaccounted: frames sent that were neither answered, nor counted as dropped or lost."""

    rate: float
    sent: int
    answered: int
    dropped: int
    middleware: int
    unaccounted: int
    last_answered: bool
    latency: tuple[float, float, float]
    memory: tuple[float, float, float]

    @property
    def memory_change(self) -> float:
        """Percent."""
        return 100 * (self.memory[1] / self.memory[0] - 1)


def trial(link: Link, status: NodeStatus, pid: int, alive: Callable[[], None], rate: float, seconds: float) -> Trial:
    """Send frames for `seconds` at `rate` a second and account for every one of them."""
    lane = link.node
    _settle(link, status, alive)
    before = status.counts()
    lane.clear()
    count = max(2, round(rate * seconds))
    begin = time.monotonic() + 0.01
    memory, memory_at = [], begin
    for k in range(count):
        while (left := begin + k / rate - time.monotonic()) > 0:
            link.spin(left)
        link.publish(lane)
        if time.monotonic() >= memory_at:
            memory.append(resident_mb(pid))
            memory_at += 0.1
    took = time.monotonic() - begin
    link.spin(0.2)
    _settle(link, status, alive)
    after = {key: value - before[key] for key, value in status.counts().items()}
    latencies = lane.latencies_ms()
    fifth = max(1, len(memory) // 5)
    return Trial(
        rate=count / took,
        sent=count,
        answered=after["answered"],
        dropped=after["dropped"] - after["middleware"],
        middleware=after["middleware"],
        # What the node never heard of at the end of a burst leaves no gap in its numbers: it must be missing here.
        unaccounted=count - after["answered"] - after["dropped"],
        last_answered=lane.step in lane.came,
        latency=tuple(np.percentile(latencies, [50, 95, 99])) if len(latencies) else (float("nan"),) * 3,
        memory=(float(np.median(memory[:fifth])), float(np.median(memory[-fifth:])), max(memory)),
    )


def _settle(link: Link, status: NodeStatus, alive: Callable[[], None]) -> None:
    """Until two reports in a row count the same and nothing waits (or SETTLE is over)."""
    deadline, last, heard = time.monotonic() + SETTLE, None, 0.0
    while time.monotonic() < deadline:
        alive()
        link.spin(0.02)
        if status.heard != heard:
            heard = status.heard
            counts = status.counts()
            if counts == last and not counts["waiting"]:
                return
            last = counts


def sustained(run: Callable[[float, float], Trial], guess: float, done: Callable[[], None]) -> float:
    """The highest rate of a ladder, by factors of 1.1 around `guess`, at which a trial drops no frame."""

    def clean(rate: float) -> bool:
        found = run(rate, TRIAL)
        done()
        return found.dropped == found.middleware == 0

    rate = guess
    if clean(rate):
        while rate < 4 * guess and clean(rate * FINER):
            rate *= FINER
        return rate
    while rate > guess / 8:
        rate /= FINER
        if clean(rate):
            break
    return rate
