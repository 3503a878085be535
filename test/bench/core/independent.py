# SPDX-License-Identifier: Apache-2.0
"""What the machine gives: as many detectors of one thread each as there are threads, all at once.

They share no work, no data and no lock, so that what they fall short of is the machine's: cores that are halves of one,
caches, memory, and other programs. A method cannot be expected to scale better than that, but for what it saves because
all threads work on the same data.
"""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor

from bench.core.measure import CoreRunner, Sample
from bench.core.variants import Variant
from hpccd_ros.bench.sources import Step

METHOD = "independent"


class IndependentRunner:
    """Runs n detectors of one thread, each on the same step. A sample's ms are the mean of their times."""

    carries_state = True

    def __init__(self, n: int, options: dict):
        self.name = f"{METHOD}, {n} threads"
        self._barrier = threading.Barrier(n, timeout=60)  # one that cannot be put on its core must not hold up the rest
        self._runners = [CoreRunner(Variant(f"{METHOD} {i}", {**options, "threads": 1})) for i in range(n)]
        cores = sorted(os.sched_getaffinity(0))
        self._cores = cores if n <= len(cores) else None
        self._threads = ThreadPoolExecutor(n)

    def run(self, step: Step) -> Sample:
        samples = list(self._threads.map(lambda i: self._run_one(i, step), range(len(self._runners))))
        mean = sum(sample.ms for sample in samples) / len(samples)
        return Sample(mean, samples[0].hash, samples[0].contacts, {}, {})

    def close(self) -> None:
        self._threads.shutdown()

    def _run_one(self, number: int, step: Step) -> Sample:
        # Linux puts threads that wake together two on a core while another is idle.
        if self._cores:
            os.sched_setaffinity(threading.get_native_id(), {self._cores[number]})
        self._barrier.wait()
        return self._runners[number].run(step)
