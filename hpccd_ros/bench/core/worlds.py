# SPDX-License-Identifier: Apache-2.0
"""Many worlds in one call on CPUs, beside detectors of one thread that are asked for one world at a time.

  hpccd bench worlds                              64 worlds of two scenes, each at another step of the motion
  hpccd bench worlds two-triangles --worlds 64,1024

"of all threads" is the time of one detector with one thread, asked for each world in turn, over that of one call and
its threads: 1 where each thread is as fast as one alone. "W detectors": one for each world, which finds nothing of it
in the core's cache. Every world's contacts are compared.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import numpy as np

import hpccd_core as hc
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command
from hpccd_ros.bench.report import progress, table
from hpccd_ros.bench.report.machine import cores
from hpccd_ros.bench.report.timing import times

MOST_WORLDS = 65536


def configure(parser):
    command.configure(parser, default=("cloth-drop", "folding-strip"), steps=None, rounds=9)
    parser.add_argument("--worlds", default="64", metavar="W,...", help="how many in a call (default: %(default)s)")
    command.tier_option(parser, "exact")
    command.threads_option(parser)


def run(args) -> int:
    counts = command.numbers("--worlds", args.worlds, int)
    if counts[-1] > MOST_WORLDS:
        raise UserError(f"--worlds {counts[-1]}: a detector takes at most {MOST_WORLDS:,}")
    report, sources = command.begin(args)
    for source in sources:
        for worlds in counts:
            report.add(**_measure(report, source, worlds, args))
    _print(report)
    return command.end(args, report)


@dataclasses.dataclass(frozen=True)
class Worlds:
    """The same topology in as many steps of its motion: positions (W, V, 3)."""

    step: object
    start: np.ndarray
    end: np.ndarray

    @staticmethod
    def of(source, worlds):
        """Steps are taken again from the first on where there are fewer. UserError where topologies differ."""
        steps = [source.step(k) for k in source.spread(worlds)]
        if any(step is None or step.topology != steps[0].topology for step in steps):
            raise UserError(f"{source.name}: its topology changes, but worlds share theirs; name another scene")
        steps = [steps[k % len(steps)] for k in range(worlds)]
        return Worlds(steps[0], *(np.stack([getattr(s, f"vertices_{end}") for s in steps]) for end in ("t0", "t1")))

    def one_by_one(self, detectors):
        """World k by detector k, or all by the only one; the hashes."""
        asked = detectors * (len(self.start) // len(detectors))
        return [d.detect(a, b).hash for d, a, b in zip(asked, self.start, self.end, strict=True)]


def _measure(report, source, worlds, args):
    of = Worlds.of(source, worlds)
    scene, threads = of.step.scene(), args.threads or cores()
    tier = {"backend": "cpu", "accuracy": args.accuracy}
    many = {n: hc.Detector(scene, worlds=worlds, threads=n, **tier) for n in {threads, 1}}
    single = [hc.Detector(scene, threads=1, **tier)]
    each = [hc.Detector(scene, threads=1, **tier) for _ in range(worlds)]
    ways: dict[str, Callable] = {
        "one_call": lambda: many[threads].detect(of.start, of.end),
        "one_thread": lambda: many[1].detect(of.start, of.end),
        "one_detector": lambda: of.one_by_one(single),
        "detectors": lambda: of.one_by_one(each),
    }
    ms = {way: [] for way in ways}
    with progress.bar(f"{source.name}, {worlds} worlds", (args.repeat + 1) * len(ways)) as bar:
        for lap in range(args.repeat + 1):
            for way, ask in ways.items():
                began = time.perf_counter()
                found = ask()
                took = 1e3 * (time.perf_counter() - began)
                if lap:
                    ms[way].append(took)
                elif way in ("one_call", "one_thread"):
                    _check(report, f"{source.name}, {way}", of, found, single)
                bar.step(f"{took:.1f} ms")
    medians = {f"{way}_ms": times(of_way).median for way, of_way in ms.items()}
    return {
        "scene": source.name,
        "accuracy": args.accuracy,
        "triangles": of.step.triangles,
        "worlds": worlds,
        "threads": threads,
        "contacts": len(many[threads].detect(of.start, of.end)),
        **medians,
        "of_all_threads": medians["one_detector_ms"] / medians["one_call_ms"] / threads,
        "bytes_a_world": many[threads].stats["bytes"] / worlds,
    }


def _check(report, what, of, found, single):
    if [found.world(k).hash for k in range(len(of.start))] != of.one_by_one(single):
        report.failure(f"{what}: some world's contacts are not those of a detector of its own")


def _print(report):
    if not report.rows:
        return
    table.show(
        f"many worlds, {report.rows[0]['accuracy']}, {report.rows[0]['threads']} threads: median ms of all worlds",
        ["scene", "triangles", "worlds", "one call", "of all threads", "1 thread", "one detector", "W detectors",
         "bytes a world"],
        [[r["scene"], r["triangles"], r["worlds"], r["one_call_ms"], r["of_all_threads"], r["one_thread_ms"],
          r["one_detector_ms"], r["detectors_ms"], round(r["bytes_a_world"])] for r in report.rows],
        "detectors have one thread and are asked for one world at a time",
    )  # fmt: skip
