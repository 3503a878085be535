# SPDX-License-Identifier: Apache-2.0
"""The timing loop: variants in turn on the same steps, so that what disturbs the machine disturbs all alike.

What is timed is one call of `detect` (or of another query), argument checks and the arrays of contacts included; where
the topology has changed since the step before, making scene and detector too. Not timed: reading or generating the
step, the first round (warm-up), and, where the measured steps do not follow each other, the steps before each one: of
the fastest variant TURN_MS long and at least one, and the same for all, so that all build their hierarchy at the same
step (of the only step of a file: the same step). They are computed because detectors carry their hierarchy from step to
step, and because in a stream no other detector has used caches and cores in between. The only step of a file is then
timed again and again, for TURN_MS: five times of 1.4 ms say little on a machine that others use as well.
"""

from __future__ import annotations

import dataclasses
import gc
import math
import time
from collections import defaultdict
from collections.abc import Callable, Sequence, Sized

import hpccd_core as hc
from bench.core.variants import Variant
from bench.report import progress
from bench.report.timing import Times, times
from hpccd_ros.bench.sources import Source, Step

# A scene of 1.4 ms reaches the speed of a stream after three or more steps.
TURN_MS = 10.0

NOTE = (
    "ms are wall-clock times of one call of detect() or another query from Python; variants run in turn, one round of "
    "warm-up is left out; the hierarchy is carried from step to step (first_ms: one call with a new detector, which "
    "builds it)"
)


@dataclasses.dataclass(frozen=True)
class Sample:
    """One timed call. hash, contacts: None where a peer does not list them."""

    ms: float
    hash: int | None
    contacts: int | None
    profile: dict[str, float]
    stats: dict[str, float]


def detect(detector: hc.Detector, step: Step) -> hc.Contacts:
    return detector.detect(step.vertices_t0, step.vertices_t1)


class CoreRunner:
    """Runs one variant of the core along a sequence of steps.

    ask(detector, step): the query, by default `detect`. Its answer has a length and a hash.
    """

    carries_state = True

    def __init__(self, variant: Variant, ask: Callable[[hc.Detector, Step], Sized] = detect):
        self.name = variant.name
        self._ask = ask
        self._variant = variant
        self._detector = None
        self._topology = None
        self._changed: tuple[Step, Step] | None = None

    def run(self, step: Step) -> Sample:
        step = self._as_wanted(step)
        began = time.perf_counter()
        if self._detector is None or step.topology != self._topology:
            self._detector, self._topology = self._variant.detector(step), step.topology
        found = self._ask(self._detector, step)
        end = time.perf_counter()
        return Sample(
            1e3 * (end - began),
            found.hash,
            len(found),
            dict(self._detector.profile),
            dict(self._detector.stats),
        )

    def _as_wanted(self, step):
        if self._variant.change is None:
            return step
        if self._changed is None or self._changed[0] is not step:
            self._changed = step, self._variant.change(step)
        return self._changed[1]


class Series:
    """What one variant did over all steps and rounds."""

    def __init__(self, name: str):
        self.name = name
        self.by_step: dict[int, list[Sample]] = defaultdict(list)
        self.first: Sample | None = None

    def add(self, step: int, sample: Sample, warm_up: bool) -> None:
        self.first = self.first or sample
        if not warm_up:
            self.by_step[step].append(sample)

    @property
    def samples(self) -> list[Sample]:
        return [sample for samples in self.by_step.values() for sample in samples]

    def times(self) -> Times:
        """Over all steps and rounds."""
        return times([sample.ms for sample in self.samples])

    def sequence_ms(self) -> float:
        """The whole sequence once: the sum over its steps of the median over the rounds."""
        return sum(times([s.ms for s in samples]).median for samples in self.by_step.values())

    def step_ms(self) -> float:
        """An average step: the median over the rounds."""
        return self.sequence_ms() / len(self.by_step)

    def least_ms(self) -> float:
        """An average step: the least over the rounds, which others on the machine disturb least."""
        return sum(times([s.ms for s in samples]).best for samples in self.by_step.values()) / len(self.by_step)

    def stages(self) -> dict[str, float]:
        """ms of each stage in an average step, the median over the rounds; "outside" is what the core did not see:
        the Python call, and scene and detector where the topology changed."""
        stages: dict[str, float] = defaultdict(float)
        for samples in self.by_step.values():
            for stage in sorted({stage for s in samples for stage in s.profile}):
                stages[stage] += times([s.profile.get(stage, 0.0) for s in samples]).median / len(self.by_step)
            if "total" in samples[0].profile:
                stages["outside"] += times([s.ms - s.profile["total"] for s in samples]).median / len(self.by_step)
        return dict(stages)

    def stats(self) -> dict[str, float]:
        """Counts of an average step."""
        total: dict[str, float] = defaultdict(float)
        for samples in self.by_step.values():
            for key, value in samples[-1].stats.items():
                total[key] += value / len(self.by_step)
        return dict(total)

    def candidates(self) -> float | None:
        """Pairs of features tested in an average step; None of a peer that does not tell."""
        stats = self.stats()
        return stats["vf_candidates"] + stats["ee_candidates"] if "vf_candidates" in stats else None

    def contacts(self) -> float | None:
        """Contacts of an average step."""
        counts = [samples[-1].contacts for samples in self.by_step.values()]
        return None if None in counts else sum(counts) / len(counts)

    def hashes(self) -> dict[int, set[int]]:
        """All hashes seen for each step; more than one for a step is a defect."""
        return {step: {s.hash for s in samples} for step, samples in self.by_step.items()}


def measure(source: Source, runners: Sequence, rounds: int, steps: int = 0) -> dict[str, Series]:
    """Every runner on `steps` steps spread over the source (0: all), `rounds` times; by the runner's name."""
    wanted = [k for k in source.spread(steps) if source.step(k) is not None]
    if not wanted:
        raise ValueError(f"{source.name}: none of its steps keeps its topology")
    series = {runner.name: Series(runner.name) for runner in runners}
    collecting = gc.isenabled()
    took: dict[str, float] = {}  # ms of the last step; the very first call of a runner is that of a new detector
    with progress.bar(source.name, (rounds + 1) * len(wanted) * len(runners)) as bar:
        try:
            for turn in range(rounds + 1):
                for place, k in enumerate(wanted):
                    step = source.step(k)
                    follows = place > 0 and wanted[place - 1] == k - 1
                    lead = [] if follows or not took else _lead(source, k, min(took.values()))
                    gc.collect()
                    gc.disable()
                    # Another one begins each time: whoever runs first finds the step's data in no cache.
                    shift = (turn + place) % len(runners)
                    for runner in [*runners[shift:], *runners[:shift]]:
                        if runner.carries_state and runner.name in took:
                            for before in lead:
                                runner.run(before)
                        again = source.n_steps == 1 and runner.name in took
                        for _ in range(_steps_in_turn(took[runner.name]) if again else 1):
                            sample = runner.run(step)
                            series[runner.name].add(k, sample, warm_up=turn == 0)
                        took[runner.name] = sample.ms
                        bar.step(f"{runner.name}: {sample.ms:.1f} ms")
                    gc.enable()
        finally:
            (gc.enable if collecting else gc.disable)()
    return series


def _lead(source: Source, k: int, ms: float) -> list[Step]:
    """The steps before step k where one takes `ms`; where there is none, step k itself."""
    back = range(_steps_in_turn(ms), 0, -1)
    return [(source.step(k - n) if k >= n else None) or source.step(k) for n in back]


def _steps_in_turn(ms: float) -> int:
    return max(1, math.ceil(TURN_MS / ms))


def disagreements(series: Sequence[Series]) -> list[str]:
    """Where variants that must find the same contacts do not, in words."""
    said = []
    for step in sorted({step for one in series for step in one.by_step}):
        seen = {one.name: one.hashes().get(step, set()) for one in series}
        if len(set().union(*seen.values())) > 1:
            text = ", ".join(
                f"{name} {'/'.join(f'{h:#018x}' for h in sorted(hashes))}" for name, hashes in seen.items()
            )
            said.append(f"step {step}: {text}")
    return said
