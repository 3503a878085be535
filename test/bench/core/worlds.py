# SPDX-License-Identifier: Apache-2.0
"""Many worlds in one call on CPUs, beside detectors of one thread that are asked for one world at a time.

  python -m bench worlds                              64 worlds of two scenes, at steps spread over the motion
  python -m bench worlds two-triangles --worlds 64,1024

Each world is at a step of the motion; where it has fewer steps than there are worlds, steps come again. All ms are of
all worlds. "one call": of all threads; "1 thread": the same with one. "one detector": asked for each world in turn.
"W detectors": likewise, but one for each world (up to 1,024, as they take memory), which finds little of it in the
core's cache. "of all threads" is the time inside the core of the one detector over that of one call and its threads: 1
where each thread is as fast as one alone. What calls from Python cost, which one call pays once and the detectors for
each world, is left out of it. "bytes a world" is all that the detector of the call holds, over its worlds. Contacts of
each world are compared in the first and the last round.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import hpccd_core as hc
from bench import command
from bench.report import progress
from bench.report.timing import times
from hpccd_core._core import MOST_WORLDS
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores

MOST_DETECTORS = 1024  # of 2 MB each for cloth-drop
ROWS = ("vf", "vf_toc", "ee", "ee_toc")


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
    for source in sources:  # before anything is measured, as it would be lost
        _steps(source, counts[-1])
    for source in sources:
        for worlds in counts:
            report.add(**_measure(report, source, worlds, args))
    _print(report)
    return command.end(args, report)


def _steps(source, worlds):
    """At most so many, spread over the motion. UserError where they do not share their topology."""
    steps = [source.step(k) for k in source.spread(worlds)]
    if any(step is None or step.topology != steps[0].topology for step in steps):
        raise UserError(f"{source.name}: its topology changes, but worlds share theirs; name another scene")
    return steps


def _measure(report, source, worlds, args):
    steps = _steps(source, worlds)
    start, end = (
        np.stack([getattr(steps[k % len(steps)], name) for k in range(worlds)])
        for name in ("vertices_t0", "vertices_t1")
    )
    scene, threads = steps[0].scene(), args.threads or cores()
    tier = {"backend": "cpu", "accuracy": args.accuracy}
    single = [hc.Detector(scene, threads=1, **tier)]
    each = [hc.Detector(scene, threads=1, **tier) for _ in range(worlds if worlds <= MOST_DETECTORS else 0)]
    call, call_of_one = (hc.Detector(scene, worlds=worlds, threads=n, **tier) for n in (threads, 1))

    def in_turn(detectors):
        asked = detectors * (worlds // len(detectors))
        return [detector.detect(a, b) for detector, a, b in zip(asked, start, end, strict=True)]

    def core_ms_of_one():  # in a round of its own: to read the profile takes time
        total = 0.0
        for a, b in zip(start, end, strict=True):
            single[0].detect(a, b)
            total += single[0].profile["total"]
        return total

    ways: dict[str, Callable] = {
        "one_call": lambda: call.detect(start, end),
        "one_thread": lambda: call_of_one.detect(start, end),
        "one_detector": lambda: in_turn(single),
        **({"detectors": lambda: in_turn(each)} if each else {}),
    }
    ms = {way: [] for way in ways}
    core_ms = {"one_call": [], "one_detector": []}
    with progress.bar(f"{source.name}, {worlds} worlds", (args.repeat + 1) * len(ways)) as bar:
        for lap in range(args.repeat + 1):
            found = {}
            for way, ask in ways.items():
                began = time.perf_counter()
                found[way] = ask()
                if lap:
                    ms[way].append(1e3 * (time.perf_counter() - began))
                bar.step()
            if lap:
                core_ms["one_call"].append(call.profile["total"])
                core_ms["one_detector"].append(core_ms_of_one())
            if lap in (0, args.repeat):
                _compare(report, f"{source.name}, {worlds} worlds", found, worlds)
    if not each:
        report.note(f"{source.name}: no detector for each of {worlds:,} worlds: they take memory")
    core = {way: times(of_way).median for way, of_way in core_ms.items()}
    return {
        "scene": source.name,
        "accuracy": args.accuracy,
        "triangles": steps[0].triangles,
        "steps": len(steps),
        "worlds": worlds,
        "threads": threads,
        "contacts": len(found["one_call"]),
        **{f"{way}_ms": times(of_way).median for way, of_way in ms.items()},
        **{f"{way}_core_ms": of_way for way, of_way in core.items()},
        "of_all_threads": core["one_detector"] / core["one_call"] / threads,
        "bytes_a_world": call.stats["bytes"] / worlds,
    }


def _compare(report, what, found, worlds):
    """Rows and hashes of each world, by each way, with those of the one detector."""
    alone = found.pop("one_detector")
    for way, answer in found.items():
        of_worlds = answer if isinstance(answer, list) else [answer.world(k) for k in range(worlds)]
        for k, (mine, other) in enumerate(zip(of_worlds, alone, strict=True)):
            if mine.hash != other.hash or not all(np.array_equal(getattr(mine, r), getattr(other, r)) for r in ROWS):
                report.failure(f"{what}, {way}: contacts of world {k} are not those of a detector of one world")
                break
    if not any(len(other) for other in alone):
        report.note(f"{what}: nothing touches in any of them")


def _print(report):
    tables.show(
        f"many worlds, {report.rows[0]['accuracy']}, threads: {report.rows[0]['threads']}; median ms of all worlds",
        [
            "scene",
            "triangles",
            "steps",
            "worlds",
            "one call",
            "of all threads",
            "1 thread",
            "one detector",
            "W detectors",
            "bytes a world",
        ],
        [
            [
                r["scene"],
                r["triangles"],
                r["steps"],
                r["worlds"],
                r["one_call_ms"],
                r["of_all_threads"],
                r["one_thread_ms"],
                r["one_detector_ms"],
                r.get("detectors_ms"),
                round(r["bytes_a_world"]),
            ]
            for r in report.rows
        ],
        "detectors have one thread and are asked for one world at a time; of all threads: by time inside the core",
    )
