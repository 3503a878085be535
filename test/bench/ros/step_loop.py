# SPDX-License-Identifier: Apache-2.0
"""The loop of a solver that asks the node how far it may go and waits for the answer, beside the same call in process.

Four trial steps from each start, shorter ones and a longer one, there and back again: what a line search asks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
from hpccd.srv import Detect
from numpy.typing import NDArray
from rclpy.node import Node

from bench.lab import bar
from bench.ros.link import MESH, Link
from hpccd_ros import client
from hpccd_ros.bench import report as tables

TRIALS = (1.0, 0.5, 0.25, 0.75)  # parts of the motion
PERCENTILES = (("median", 50), ("p95", 95), ("p99", 99))

Positions = NDArray[np.float32]


class StepLoop:
    """Asks ~/detect in a node of this process. wrong: how many answers were not the core's own."""

    def __init__(self, node: Node, link: Link, alive: Callable[[], None]):
        self._link, self._alive = link, alive
        self._service = node.create_client(Detect, "hpccd/detect")
        self._motions = self._trials()
        self.wrong = 0
        link.spin_until(self._service.service_is_ready, "service", alive)

    def _trials(self) -> Iterator[tuple[Positions, Positions]]:
        motions = []
        for start, end in (self._link.positions, self._link.positions[::-1]):
            motions += [(start, start + np.float32(part) * (end - start)) for part in TRIALS]
        while True:
            yield from motions

    def round(self) -> tuple[float, float, float, float]:
        """(ms until the answer of the node, of these until the request was sent, ms of the same call here, the step)"""
        start, end = next(self._motions)
        began = time.perf_counter()
        future = self._service.call_async(client.collision_free_step_request({MESH: start}, {MESH: end}))
        sent = time.perf_counter()
        self._link.spin_until(future.done, "answer of ~/detect", self._alive)
        step = client.collision_free_step_from_response(future.result())
        came = time.perf_counter()
        expected = self._link.detector.collision_free_step(start, end)
        ended = time.perf_counter()
        self.wrong += step != expected
        return 1e3 * (came - began), 1e3 * (sent - began), 1e3 * (ended - came), step


def measure(node: Node, link: Link, scene: str, rounds: int, alive: Callable[[], None]) -> dict[str, float | int]:
    """Percentiles of both ways in turn; `wrong` answers are counted."""
    loop = StepLoop(node, link, alive)
    for _ in range(2 * len(TRIALS)):
        loop.round()
    with bar(f"{scene}: how far", rounds) as done:
        found = []
        for _ in range(rounds):
            found.append(loop.round())
            done()
    whole, request, core, step = np.array(found).T
    out: dict[str, float | int] = {"rounds": rounds, "mb_sent": 2 * link.bytes_in / 1e6, "wrong": loop.wrong}
    for who, ms in (("loop", whole), ("core", core), ("more", whole - core)):
        out |= {f"{who}_{key}_ms": float(np.percentile(ms, q)) for key, q in PERCENTILES}
    return out | {"request_median_ms": float(np.median(request)), "least_step": float(step.min())}


def show(rows: list[dict]) -> None:
    tables.show(
        "how far may I go, ms: asked of the node over DDS, and of the core in this process, in turn",
        ["scene", "MB sent", "over DDS", "p95", "p99", "in process", "p95", "p99", "DDS more", "p95", "p99"],
        [
            [
                r["scene"],
                r["mb_sent"],
                *(r[f"{who}_{key}_ms"] for who in ("loop", "core", "more") for key, _ in PERCENTILES),
            ]
            for r in rows
        ],
    )
