# SPDX-License-Identifier: Apache-2.0
"""How calls of a detector on the GPU are timed, and what must hold of each."""

from __future__ import annotations

import time
from collections.abc import Callable

import hpccd_core as hc
from bench.report.timing import times

FEWEST, SECONDS = 5, 1.0  # rounds of each variant: at least so many, and no more once this time has passed
WARM_UP = 8  # the lists on the devices reach their size
STAGE_CALLS = 9


def call_times(ask: Callable, repeat: int):
    """(Times of ask() in ms, its last answer) after a warm-up; rounds end early where they take long."""
    began = time.perf_counter()
    for _ in range(WARM_UP):
        found = ask()
        if time.perf_counter() - began > SECONDS:
            break
    ms = []
    began = time.perf_counter()
    while len(ms) < repeat and (len(ms) < FEWEST or time.perf_counter() - began < SECONDS):
        start = time.perf_counter()
        found = ask()
        ms.append(1e3 * (time.perf_counter() - start))
    return times(ms), found


def detector_times(detector, step, repeat):
    """The same of detect()."""
    return call_times(lambda: detector.detect(step.vertices_t0, step.vertices_t1), repeat)


class StagesDetector(hc.Detector):
    """Whose profile tells device time by stage: events cost time themselves, so its calls are not those that count."""

    _gpu_stages = True


def device_stages(detector: StagesDetector, ask: Callable) -> dict[str, float]:
    """ms on the device by stage, the median over calls of ask() after a warm-up."""
    for _ in range(WARM_UP):
        ask()
    of_calls = []
    for _ in range(STAGE_CALLS):
        ask()
        of_calls.append({name: ms for name, ms in detector.profile.items() if name.startswith("gpu/")})
    return {name: times([call.get(name, 0.0) for call in of_calls]).median for name in of_calls[-1]}


def check(report, what: str, detector, same: bool) -> None:
    """Fails the command where answers differ from the CPU's, or the device has left a frame to it."""
    if not same:
        report.failure(f"{what}: answers of GPU and CPU differ")
    if detector.stats["gpu_fallbacks"]:
        report.failure(f"{what}: frames left to the CPU: {detector.last_gpu_error}")
