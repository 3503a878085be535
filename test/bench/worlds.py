# SPDX-License-Identifier: Apache-2.0
"""Many worlds in one call on CPUs, compared with detectors of one thread and one call per world.

  python -m bench worlds                              64 worlds of two scenes, at steps spread over the motion
  python -m bench worlds two-triangles --worlds 64,1024

All ms are for all worlds. "one call": on all threads; "1 thread": on one. "one detector": one call per world. "a
detector each": one detector per world (at most 1,024, because they need memory). "of all threads": core time of the one
detector divided by that of one call times its threads; 1 if each thread is as fast as on its own. "of the machine": the
same with as many such detectors at once as threads, each with its share of the worlds: they do not wait for each other,
but share caches and memory. Contacts of each world are compared in the last round.
"""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import hpccd_core as hc
from bench import lab
from hpccd_core._core import MOST_WORLDS

MOST_DETECTORS = 1024  # of 2 MB each for cloth-drop
ROWS = ("vf", "vf_toc", "ee", "ee_toc")
COLUMNS = {
    "scene": "scene",
    "triangles": "triangles",
    "worlds": "worlds",
    "one call, ms": "one_call_ms",
    "of all threads": "of_all_threads",
    "of the machine": "of_the_machine",
    "1 thread, ms": "one_thread_ms",
    "one detector": "one_detector_ms",
    "a detector each": "detectors_ms",
    "bytes a world": lab.whole("bytes_a_world"),
}


def configure(parser):
    lab.configure(parser, ("cloth-drop", "folding-strip"), rounds=9)
    parser.add_argument("--worlds", default="64", metavar="W,...", help="how many in a call (default: %(default)s)")
    lab.tier_option(parser, "exact")


def run(args) -> lab.Report:
    counts = lab.numbers("--worlds", args.worlds, int)
    if counts[-1] > MOST_WORLDS:
        raise lab.UserError(f"--worlds {counts[-1]}: a detector takes at most {MOST_WORLDS:,}")
    result, sources = lab.begin(args)
    steps = {source.name: _steps(source, counts[-1]) for source in sources}  # before anything is measured
    for name in steps:
        for worlds in counts:
            result.add(**_measure(result, name, steps[name], worlds, args))
    lab.show(f"many worlds, {args.accuracy}; median ms of all worlds", COLUMNS, result.rows)
    return result


def _steps(source, worlds):
    """At most `worlds` of them, spread over the motion. UserError where they do not share their topology."""
    steps = [source.step(k) for k in source.spread(worlds)]
    if any(step is None or step.topology != steps[0].topology for step in steps):
        raise lab.UserError(f"{source.name}: its topology changes, but worlds share theirs; name another scene")
    return steps


def _measure(result, name, steps, worlds, args):
    steps = [steps[k * len(steps) // min(worlds, len(steps))] for k in range(min(worlds, len(steps)))]
    start, end = (
        np.stack([getattr(steps[k % len(steps)], ends) for k in range(worlds)])
        for ends in ("vertices_t0", "vertices_t1")
    )
    scene, tier = steps[0].scene(), {"accuracy": args.accuracy, "backend": "cpu"}
    threads = args.threads or lab.cores()
    alone = [hc.Detector(scene, threads=1, **tier) for _ in range(min(threads, worlds))]
    one, all_begin = alone[0], threading.Barrier(len(alone))
    each = [hc.Detector(scene, threads=1, **tier) for _ in range(worlds if worlds <= MOST_DETECTORS else 0)]
    call, call_of_one = (hc.Detector(scene, worlds=worlds, threads=n, **tier) for n in (threads, 1))

    def in_turn(detectors):
        return [detector.detect(a, b) for detector, a, b in zip(detectors, start, end, strict=True)]

    def core_ms(detector, share):
        total = 0.0
        for a, b in zip(start[share], end[share], strict=True):
            detector.detect(a, b)
            total += detector.profile["total"]
        return total

    def core_ms_of(number):
        all_begin.wait()
        return core_ms(alone[number], slice(number, None, len(alone)))

    ways = {
        "one_call": lambda: call.detect(start, end),
        "one_thread": lambda: call_of_one.detect(start, end),
        "one_detector": lambda: in_turn([one] * worlds),
        **({"detectors": lambda: in_turn(each)} if each else {}),
    }
    ms, found = lab.in_turn(f"{name}, {worlds} worlds", ways, args.repeat)
    core = {"one_call": [], "one_detector": [], "at_once": []}
    with ThreadPoolExecutor(len(alone)) as pool:
        for _ in range(args.repeat):
            call.detect(start, end)
            core["one_call"].append(call.profile["total"])
            core["one_detector"].append(core_ms(one, slice(None)))
            core["at_once"].append(sum(pool.map(core_ms_of, range(len(alone)))))
    core = {way: lab.times(of_way)["median_ms"] for way, of_way in core.items()}
    _compare(result, f"{name}, {worlds} worlds", found, worlds)
    return {
        "scene": name,
        "triangles": steps[0].triangles,
        "steps": len(steps),
        "worlds": worlds,
        "threads": threads,
        "contacts": len(found["one_call"]),
        **{f"{way}_ms": lab.times(of_way)["median_ms"] for way, of_way in ms.items()},
        "of_all_threads": core["one_detector"] / core["one_call"] / threads,
        "of_the_machine": core["at_once"] / core["one_call"] / threads,
        "bytes_a_world": call.stats["bytes"] / worlds,
    }


def _compare(result, what, found, worlds):
    """Rows and hashes of each world, by each way, with those of the one detector."""
    alone = found["one_detector"]
    for way, given in found.items():
        of_worlds = given if isinstance(given, list) else [given.world(k) for k in range(worlds)]
        for k, (mine, other) in enumerate(zip(of_worlds, alone, strict=True)):
            if mine.hash != other.hash or not all(np.array_equal(getattr(mine, r), getattr(other, r)) for r in ROWS):
                result.failure(f"{what}, {way}: contacts of world {k} are not those of a detector of one world")
                break
