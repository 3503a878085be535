# SPDX-License-Identifier: Apache-2.0
"""Fig. 6 and Fig. 7 of Kim et al. 2009: time and speed-up over one thread against the number of threads.

  python -m bench scaling                        1, 2, 4, ... threads up to all cores; generated and data scenes
  python -m bench scaling n-body-like-lr --threads-list 1,2,3,4 --methods default,naive

Methods: default, published (sections 3 and 4 of the paper), naive (section 3.2) and front (Tang et al. 2009). The
speed-up of a method is relative to itself with one thread. All must find the same contacts. "independent": as many
detectors of one thread each, all at once, without shared data: the limit of the machine.
"""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor

from bench import lab
from hpccd_core.options import METHODS
from hpccd_ros.bench.measure import Runner, Sample
from hpccd_ros.bench.sources import TABLE_1

INDEPENDENT = "independent"
COLUMNS = {
    "scene": "scene",
    "method": "method",
    "threads": "threads",
    "median ms": "median_ms",
    "p95 ms": "p95_ms",
    "speed-up": "speedup",
    "efficiency": lambda row: row["speedup"] and row["speedup"] / row["threads"],
}


def configure(parser):
    lab.configure(parser, ("data", *TABLE_1), steps=6, leave_out=("threads",))
    parser.add_argument("--methods", default=",".join(METHODS), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument("--threads-list", metavar="N,...", help="default: 1, 2, 4, ... and all cores")
    lab.tier_option(parser)


def run(args) -> lab.Report:
    doubling = [1 << k for k in range(lab.cores().bit_length()) if 1 << k <= lab.cores()]
    counts = lab.thread_counts(args.threads_list, [*doubling, lab.cores()])
    methods = lab.listed("--methods", args.methods, METHODS)
    result, sources = lab.begin(args)
    options = {"accuracy": args.accuracy, "backend": "cpu"}
    for source in sources:
        runners, asked = [], {}
        for method in methods:
            for n in counts:
                runners.append(Runner(f"{method} {n}", {**options, "threads": n, "method": method}))
                asked[f"{method} {n}"] = {"method": method, "threads": n}
        for n in counts if "default" in methods and counts[0] == 1 else ():
            if n > 1:
                runners.append(IndependentRunner(n, options))
                asked[runners[-1].name] = {"method": INDEPENDENT, "threads": n}
        rows = lab.compare(result, args, source, runners, runners[0].name, asked)
        alone = {row["method"]: row["step_ms"] for row in rows if row["threads"] == 1}
        for row in rows:
            own, at_once = ("default", row["threads"]) if row["method"] == INDEPENDENT else (row["method"], 1)
            row["speedup"] = at_once * alone[own] / row["step_ms"] if own in alone else None
    lab.show(f"speed-up over one thread ({args.accuracy})", COLUMNS, result.rows)
    return result


class IndependentRunner:
    """Runs n detectors of one thread, each on the same step. A sample's ms are the mean of their times."""

    carries_state = True

    def __init__(self, n: int, options: dict):
        self.name = f"{INDEPENDENT} {n}"
        self._barrier = threading.Barrier(n, timeout=60)  # one that cannot be put on its core must not hold up the rest
        self._runners = [Runner(f"{self.name} {i}", {**options, "threads": 1}) for i in range(n)]
        cores = sorted(os.sched_getaffinity(0))
        self._cores = cores if n <= len(cores) else None
        self._threads = ThreadPoolExecutor(n)

    def run(self, step) -> Sample:
        samples = list(self._threads.map(lambda i: self._run_one(i, step), range(len(self._runners))))
        mean = sum(sample.ms for sample in samples) / len(samples)
        return Sample(mean, samples[0].hash, samples[0].contacts, {}, {})

    def _run_one(self, number: int, step) -> Sample:
        # Linux puts threads that wake together two on a core while another is idle.
        if self._cores:
            os.sched_setaffinity(threading.get_native_id(), {self._cores[number]})
        self._barrier.wait()
        return self._runners[number].run(step)
