# SPDX-License-Identifier: Apache-2.0
"""Step size queries: all contacts, the first ones, the collision-free step, and trial steps from a known start.

  python -m bench step                        the files of HPCCD_DATA, twisted rods, pieces that swarm
  python -m bench step cloth-ball --peer ipctk   compared with ipctk (pip install ipctk)
  python -m bench step cloth-ball-trial       trial steps of the solver in examples/cloth_on_ball
  python -m bench step data --backend gpu --arrays device   positions lie on the GPU (torch or cupy)

all, first: detect() with that report; step: collision_free_step(). Two starts alternate, the original one and one
shifted by a sixteenth of the scene's size, so that the detector cannot reuse the state of the last start. trial:
queries of a line search from one start: the whole step, three quarters and half of it, and one rotated by 5 degrees,
after untimed calls, the second of which computes the near list ("listing").
"""

from __future__ import annotations

import dataclasses
import math
import statistics
import time
from collections import defaultdict

import numpy as np

from bench import lab
from bench.device import to_device
from bench.peer import NOTE, PeerRunner
from hpccd_ros.bench import measure
from hpccd_ros.bench.measure import Runner
from hpccd_ros.bench.sources import Step

ALL, FIRST, STEP, TRIAL = QUERIES = ("all", "first", "step", "trial")
TRIALS = (1.0, 0.75, 0.5)  # parts of a step that a line search tries; and one that is turned
TURN = math.radians(5.0)
COLUMNS = {
    "scene": "scene",
    "query": "query",
    "contacts": lab.whole("contacts"),
    "earliest": "earliest",
    "ms": "step_ms",
    "/ all": "over_base",
    "listing, ms": "listing_ms",
    "x ipctk": "times_faster_than_ipctk",
}


class Free(float):
    """How far a step may go, with the length and the hash that other results have."""

    def __len__(self) -> int:
        return int(self < 1)

    @property
    def hash(self) -> int:
        return hash(float(self)) & (1 << 64) - 1

    @property
    def first_toc(self) -> float:
        return float(self)


class StepRunner(Runner):
    """Asks one of QUERIES of each step. Of TRIAL the start stays and the ends take turns; of the others the starts do,
    so that no call begins where the one before did."""

    def __init__(self, query: str, options: dict, change=None):
        super().__init__(query, {**options, "report": FIRST if query == FIRST else ALL}, self._query, change)
        self.hashes: dict[tuple[int, int], set[int]] = defaultdict(set)  # by step and place in its turns
        self.earliest: dict[tuple[int, int], float] = {}
        self.listing_ms: list[float] = []  # of TRIAL: ms of the second call from a start
        self._step: Step | None = None
        self._calls = self._from_start = 0

    def prepared(self, step: Step) -> Step:
        if self._step is not step:
            turns = trials(step) if self.name == TRIAL else [step, elsewhere(step)]
            self._turns = [self.change(turn) for turn in turns] if self.change else turns
            # The hash of its contents: a source may make a step again.
            self._step, self._key = step, hash((step.vertices_t0.tobytes(), step.vertices_t1.tobytes()))
            self._from_start = 0
            if self.name == TRIAL and self._detector is not None and self._topology == step.topology:
                for turn in 2 * self._turns:  # not timed: the first call sees the start, the second lists near pairs
                    self._query(self._detector, turn)
        self._calls += 1
        return self._turns[self._calls % len(self._turns)]

    def _query(self, detector, step: Step):
        if self.name in (ALL, FIRST):
            found = measure.detect(detector, step)
        else:
            begin = time.perf_counter()
            found = Free(detector.collision_free_step(step.vertices_t0, step.vertices_t1))
            self._from_start += 1
            if self.name == TRIAL and self._from_start == 2:
                self.listing_ms.append(1e3 * (time.perf_counter() - begin))
        place = self._key, next(i for i, turn in enumerate(self._turns) if turn is step)
        self.hashes[place].add(found.hash)
        self.earliest[place] = min(found.first_toc, 1.0)
        return found


def configure(parser):
    lab.configure(parser, ("data", "rod-twist-like", "n-body-like-lr"), steps=4)
    lab.backend_options(parser)
    lab.tier_option(parser, default="exact")


def run(args) -> lab.Report:
    lab.require_backend(args, accuracy=args.accuracy)
    result, sources = lab.begin(args)
    options = {"accuracy": args.accuracy, "backend": args.backend, "threads": args.threads}
    change = Step.as_one_mesh if args.peer else to_device if args.arrays == "device" else None
    for source in sources:
        runners = [StepRunner(query, options, change) for query in QUERIES]
        peers = [PeerRunner(args.threads or lab.cores())] if args.peer else []
        asked = {name: {"query": name} for name in (*QUERIES, "ipctk")}
        rows = lab.compare(result, args, source, [*runners, *peers], ALL, asked, check=False)
        for text in contradictions(runners, args.accuracy):
            result.failure(f"{source.name}: {text}")
        for runner, row in zip(runners, rows, strict=False):
            row["earliest"] = sum(runner.earliest.values()) / len(runner.earliest)
            row["listing_ms"] = statistics.median(runner.listing_ms) if runner.listing_ms else None
            if peers and runner.name != ALL:
                row["times_faster_than_ipctk"] = rows[-1]["step_ms"] / row["step_ms"]
        if peers:
            result.note(NOTE)
    lab.show(f"how far a step may go, {args.accuracy}, {args.backend}", COLUMNS, result.rows)
    return result


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
    """Where calls of one query, or the earliest times of several, do not agree, in words."""
    texts = [f"{r.name}: results differ between calls" for r in runners if any(len(h) > 1 for h in r.hashes.values())]
    early = 1e-9 if accuracy in ("exact", "conservative") else 0.0
    times = {runner.name: runner.earliest for runner in runners}
    for query in (FIRST, STEP):
        for place, mine in times.get(query, {}).items():
            of_all = times[ALL].get(place, mine)
            if not of_all - (early if query == STEP else 0.0) <= mine <= of_all:
                texts.append(f"{query}: {mine!r}, but the earliest contact of all is at {of_all!r}")
    return texts
