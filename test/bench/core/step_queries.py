# SPDX-License-Identifier: Apache-2.0
"""The questions of `python -m bench step`, asked so that nothing is known of a start, or all of it."""

from __future__ import annotations

import dataclasses
import math
import time
from collections import defaultdict

import numpy as np

import hpccd_core as hc
from bench.core import measure
from bench.core.variants import Variant
from hpccd_ros.bench.sources import Step

ALL, FIRST, STEP, TRIAL = QUERIES = ("all", "first", "step", "trial")
TRIALS = (1.0, 0.75, 0.5)  # parts of a step that a line search tries; and one that is turned
TURN = math.radians(5.0)


class Free(float):
    """How far a step may go, with the length and the hash that other answers have."""

    def __len__(self) -> int:
        return int(self < 1)

    @property
    def hash(self) -> int:
        return hash(float(self)) & (1 << 64) - 1

    @property
    def first_toc(self) -> float:
        return float(self)


class StepRunner(measure.CoreRunner):
    """Asks one of QUERIES of each step. Of TRIAL the start stays and the ends take turns; of the others the starts do,
    so that no call begins where the one before did."""

    def __init__(self, query: str, options: dict, change=None):
        report = FIRST if query == FIRST else ALL
        super().__init__(Variant(query, {**options, "report": report}, change), self._asked)
        self.query = query
        self.hashes: dict[tuple[int, int], set[int]] = defaultdict(set)  # by step and place in its turns
        self.earliest: dict[tuple[int, int], float] = {}
        self.listing_ms: list[float] = []  # of TRIAL: what the second call from a start takes
        self._step: Step | None = None
        self._name = 0  # of its contents: a source may make a step anew
        self._turns: list[Step] = []
        self._calls = 0
        self._from_start = 0  # calls from the start of this step

    def _as_wanted(self, step: Step) -> Step:
        if self._step is not step:
            turns = trials(step) if self.query == TRIAL else [step, elsewhere(step)]
            self._turns = [self._variant.change(turn) for turn in turns] if self._variant.change else turns
            self._from_start = 0
            self._step, self._name = step, hash((step.vertices_t0.tobytes(), step.vertices_t1.tobytes()))
            if self.query == TRIAL and self._detector is not None and self._topology == step.topology:
                for turn in 2 * self._turns:  # not timed: the first call sees the start, the second lists what is near
                    self._asked(self._detector, turn)
        self._calls += 1
        return self._turns[self._calls % len(self._turns)]

    def _asked(self, detector: hc.Detector, step: Step) -> hc.Contacts | Free:
        if self.query in (ALL, FIRST):
            found = measure.detect(detector, step)
        else:
            begin = time.perf_counter()
            found = Free(detector.collision_free_step(step.vertices_t0, step.vertices_t1))
            self._from_start += 1
            if self.query == TRIAL and self._from_start == 2:
                self.listing_ms.append(1e3 * (time.perf_counter() - begin))
        place = self._name, next(i for i, turn in enumerate(self._turns) if turn is step)
        self.hashes[place].add(found.hash)
        self.earliest[place] = min(found.first_toc, 1.0)
        return found


def elsewhere(step: Step) -> Step:
    """The same step shifted by a sixteenth of its size, a power of two: the same contacts but for rounding."""
    size = max(float(np.abs(v).max(initial=0.0)) for v in (step.vertices_t0, step.vertices_t1))
    shift = step.vertices_t0.dtype.type(2.0 ** math.floor(math.log2(size) - 4)) if size > 0 else 0
    return dataclasses.replace(step, vertices_t0=step.vertices_t0 + shift, vertices_t1=step.vertices_t1 + shift)


def trials(step: Step) -> list[Step]:
    """Steps from the same start: shorter ones, and one whose motion is turned about z."""
    start, motion = step.vertices_t0, step.vertices_t1 - step.vertices_t0
    turn = np.array([[math.cos(TURN), math.sin(TURN), 0], [-math.sin(TURN), math.cos(TURN), 0], [0, 0, 1]])
    ends = [start + part * motion for part in TRIALS] + [start + motion @ turn]
    return [dataclasses.replace(step, vertices_t1=np.ascontiguousarray(end.astype(start.dtype))) for end in ends]


def contradictions(runners: list[StepRunner], accuracy: str) -> list[str]:
    """Where calls of one question, or the earliest times of several, do not agree, in words."""
    said = [f"{r.query}: answers differ between calls" for r in runners if any(len(h) > 1 for h in r.hashes.values())]
    early = 1e-9 if accuracy in ("exact", "conservative") else 0.0
    times = {runner.query: runner.earliest for runner in runners}
    for query in (FIRST, STEP):
        for place, mine in times.get(query, {}).items():
            of_all = times[ALL].get(place, mine)
            if not of_all - (early if query == STEP else 0.0) <= mine <= of_all:
                said.append(f"{query}: {mine!r}, but the earliest contact of all is at {of_all!r}")
    return said
