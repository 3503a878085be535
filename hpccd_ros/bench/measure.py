# SPDX-License-Identifier: Apache-2.0
"""The timing loop: variants alternate on the same steps, so that disturbances of the machine affect all alike.

One call of `detect` (or of another query) is timed, with its argument checks and result arrays; where the topology
changed, making scene and detector too. Not timed: reading or generating the step, the first round (warm-up), and, where
the measured steps do not follow each other, the steps before each one, which detectors see because they carry their
hierarchy from step to step. The only step of a file is timed again and again for TURN_MS.
"""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import math
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import hpccd_core as hc
from hpccd_core import options
from hpccd_ros.bench.sources import Source, Step

TURN_MS = 10.0  # a scene of 1.4 ms reaches the speed of a stream after three or more steps
BACKENDS = tuple(name for name in options.BACKENDS if name != "auto")
NOTE = (
    "ms are wall-clock times of one call of detect() or another query from Python; variants run in turn, one round of "
    "warm-up is left out; the hierarchy is carried from step to step (first_ms: a call of a new detector, which builds "
    "it)"
)


def times(ms: Sequence[float]) -> dict[str, float]:
    """{"calls", "average_ms", "median_ms", "p95_ms", "best_ms"} of at least one time in ms."""
    array = np.asarray(ms, float)
    return {
        "calls": len(array),
        "average_ms": float(array.mean()),
        "median_ms": float(np.median(array)),
        "p95_ms": float(np.percentile(array, 95)),
        "best_ms": float(array.min()),
    }


@contextlib.contextmanager
def bar(description: str, total: int) -> Iterator[Callable[[], None]]:
    """Progress on stderr: a function that counts one call as done. Silent where stderr is no terminal."""
    # Redrawn by update() only: a thread that draws in between would take time from what is measured.
    with Progress(
        *(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
        auto_refresh=False,
    ) as progress:
        task = progress.add_task(description, total=total)
        yield lambda: progress.update(task, advance=1, refresh=True)


def usable(name: str, values: Sequence[str], **others) -> tuple[list[str], dict[str, str]]:
    """Those `values` of the option `name` that work here, and {value: reason} of the others."""
    rejected = {value: _why_unusable(**{name: value}, **others) for value in values}
    return [v for v in values if rejected[v] is None], {v: why for v, why in rejected.items() if why is not None}


def _why_unusable(**given) -> str | None:
    scene = hc.Scene()
    scene.add_mesh("a", np.array([[0, 1, 2]], np.uint32))
    scene.add_mesh("b", np.array([[0, 1, 2]], np.uint32))
    xyz = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], np.float32)
    try:
        # Some fail only when they are asked to work: a device that is listed but gone, a tier of one backend.
        hc.Detector(scene, **given).detect(xyz, xyz)
    except (ValueError, TypeError, RuntimeError, NotImplementedError) as error:
        return f"{type(error).__name__}: {error}"
    return None


@dataclasses.dataclass(frozen=True)
class Sample:
    """One timed call. hash, contacts: None where a peer does not list them."""

    ms: float
    hash: int | None
    contacts: int | None
    profile: dict[str, float]
    stats: dict[str, float]


def detect(detector: hc.Detector, step: Step):
    return detector.detect(step.vertices_t0, step.vertices_t1)


class Runner:
    """Runs a detector with these options along a sequence of steps.

    ask(detector, step): the query, whose result has a length and a hash. change: what is done to each step first.
    scene: further settings of the core's scene.
    """

    carries_state = True

    def __init__(self, name: str, options: dict, ask: Callable = detect, change=None, scene=None):
        self.name, self.options, self.ask, self.change = name, options, ask, change
        self._scene, self._detector, self._topology, self._changed = scene, None, None, (None, None)

    def detector(self, step: Step) -> hc.Detector:
        scene = step.scene()
        if self._scene:
            self._scene(scene)
        return hc.Detector(scene, **self.options)

    def run(self, step: Step) -> Sample:
        step = self.prepared(step)
        began = time.perf_counter()
        if self._detector is None or step.topology != self._topology:
            self._detector, self._topology = self.detector(step), step.topology
        found = self.ask(self._detector, step)
        ms = 1e3 * (time.perf_counter() - began)
        return Sample(ms, found.hash, len(found), dict(self._detector.profile), dict(self._detector.stats))

    def prepared(self, step: Step) -> Step:
        if self.change is None:
            return step
        if self._changed[0] is not step:
            self._changed = step, self.change(step)
        return self._changed[1]


class Series:
    """The samples of one runner over all steps and rounds."""

    def __init__(self):
        self.by_step: dict[int, list[Sample]] = defaultdict(list)
        self.first_ms = math.nan

    def times(self) -> dict[str, float]:
        """Over all steps and rounds; first_ms; step_ms: an average step, the median over the rounds; least_ms."""
        ms = [[sample.ms for sample in samples] for samples in self.by_step.values()]
        return {
            **times([value for of_step in ms for value in of_step]),
            "steps": len(ms),
            "step_ms": float(np.mean([np.median(of_step) for of_step in ms])),
            "least_ms": float(np.mean([min(of_step) for of_step in ms])),
            "first_ms": self.first_ms,
        }

    def stages(self) -> dict[str, float]:
        """ms of each stage in an average step, the median over the rounds; "outside" is the Python call."""
        stages: dict[str, float] = defaultdict(float)
        for samples in self.by_step.values():
            for stage in sorted({stage for s in samples for stage in s.profile}):
                stages[stage] += float(np.median([s.profile.get(stage, 0.0) for s in samples])) / len(self.by_step)
            if "total" in samples[0].profile:
                outside = np.median([s.ms - s.profile["total"] for s in samples])
                stages["outside"] += float(outside) / len(self.by_step)
        return dict(stages)

    def stats(self) -> dict[str, float]:
        """Counts of an average step; "candidates": tested pairs of features."""
        total: dict[str, float] = defaultdict(float)
        for samples in self.by_step.values():
            for key, value in samples[-1].stats.items():
                total[key] += value / len(self.by_step)
        if "vf_candidates" in total:
            total["candidates"] = total["vf_candidates"] + total["ee_candidates"]
        return dict(total)

    def contacts(self) -> float | None:
        """Contacts of an average step."""
        counts = [samples[-1].contacts for samples in self.by_step.values()]
        return None if None in counts else sum(counts) / len(counts)

    def row(self) -> dict:
        """Times, counts and stages as keys of a result's row."""
        stats = self.stats()
        counts = {key: stats[key] for key in ("candidates", "node_pairs", "bytes") if key in stats}
        return {"contacts": self.contacts(), **self.times(), **counts, "stages_ms": self.stages()}


def measure(source: Source, runners: Sequence, rounds: int, steps: int = 0) -> dict[str, Series]:
    """Every runner on `steps` steps spread over the source (0: all), `rounds` times; by the runner's name."""
    wanted = [k for k in source.spread(steps) if source.step(k) is not None]
    if not wanted:
        raise ValueError(f"{source.name}: none of its steps keeps its topology")
    series = {runner.name: Series() for runner in runners}
    collecting = gc.isenabled()
    took: dict[str, float] = {}  # ms of the last step; the first call of a runner is that of a new detector
    with bar(source.name, (rounds + 1) * len(wanted) * len(runners)) as done:
        try:
            for turn in range(rounds + 1):
                for place, k in enumerate(wanted):
                    step = source.step(k)
                    follows = place > 0 and wanted[place - 1] == k - 1
                    lead = [] if follows or not took else _lead(source, k, min(took.values()))
                    gc.collect()
                    gc.disable()
                    # Another one begins each time: whichever runs first finds the step's data in no cache.
                    shift = (turn + place) % len(runners)
                    for runner in [*runners[shift:], *runners[:shift]]:
                        known = runner.name in took
                        for before in lead if runner.carries_state and known else ():
                            runner.run(before)
                        for _ in range(_in_turn(took[runner.name]) if known and source.n_steps == 1 else 1):
                            sample = runner.run(step)
                            if turn:
                                series[runner.name].by_step[k].append(sample)
                            elif not known:
                                series[runner.name].first_ms = took.setdefault(runner.name, sample.ms)
                        took[runner.name] = sample.ms
                        done()
                    gc.enable()
        finally:
            (gc.enable if collecting else gc.disable)()
    return series


def _lead(source: Source, k: int, ms: float) -> list[Step]:
    """The steps before step k where one takes `ms`; where there is none, step k itself."""
    return [(source.step(k - n) if k >= n else None) or source.step(k) for n in range(_in_turn(ms), 0, -1)]


def _in_turn(ms: float) -> int:
    return max(1, math.ceil(TURN_MS / ms))


def disagreements(series: dict[str, Series]) -> list[str]:
    """Sentences about runners that must find the same contacts but do not."""
    texts = []
    for step in sorted({step for one in series.values() for step in one.by_step}):
        seen = {name: {s.hash for s in one.by_step.get(step, ())} for name, one in series.items()}
        if len(set().union(*seen.values())) > 1:
            hashes = (f"{name} {'/'.join(f'{h:#018x}' for h in sorted(of))}" for name, of in seen.items())
            texts.append(f"step {step}: {', '.join(hashes)}")
    return texts
