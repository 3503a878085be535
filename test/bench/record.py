# SPDX-License-Identifier: Apache-2.0
"""The writer of `hpccd record` with and without --sync: throughput, CPU time, and how long a message waits.

  python -m bench record                      on the disk of the folder for temporary files
  python -m bench record --folder /data --megabytes 500 --repeat 5

Variants alternate. "sync, slow disk": each sync takes 0.3 s longer; a message that waited for one would show it.
"""

from __future__ import annotations

import os
import random
import resource
import tempfile
import time
from pathlib import Path
from unittest import mock

import numpy as np
from bag_tools import STRING

from bench import lab
from hpccd_ros.bag.writer import BagWriter, Topic

MESSAGE = 90_000  # bytes: 7,500 vertices
SLOWER = 0.3  # s
VARIANTS = ("no sync", "sync", "sync, slow disk")
COLUMNS = {
    "variant": "variant",
    "MB/s": "throughput",
    "CPU ms / MB": "cpu_ms",
    "write, us: median": "median_us",
    "99 %": "p99_us",
    "largest": "largest_us",
    "syncs / s": "syncs",
}


def configure(parser):
    lab.configure(parser, rounds=3, leave_out=("size", "threads"))
    parser.add_argument("--folder", type=Path, help="where to write (default: the folder for temporary files)")
    parser.add_argument("--megabytes", type=int, default=300, help="to write at full speed (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=4.0, help="at 200 messages a second (default: %(default)s)")
    parser.add_argument("--flush", type=float, default=0.5, help="as of hpccd record (default: %(default)s)")


def run(args) -> lab.Report:
    result, _ = lab.begin(args)
    data = random.Random(1).randbytes(MESSAGE)
    found = {variant: [] for variant in VARIANTS}
    with tempfile.TemporaryDirectory(dir=args.folder) as folder, lab.bar("record", args.repeat * len(VARIANTS)) as done:
        for _ in range(args.repeat):
            for variant in VARIANTS:
                found[variant].append(_measure(Path(folder) / "run.mcap", variant, data, args))
                done()
    for variant, rounds in found.items():
        medians = {name: float(np.median([row[name] for row in rounds])) for name in rounds[0]}
        result.add(variant=variant, **medians)
    result.note(f"messages of {MESSAGE:,} bytes; write: from the call until it returns, at 200 messages a second")
    lab.show("writer of recordings", COLUMNS, result.rows)
    return result


def _measure(path: Path, variant: str, data: bytes, args) -> dict:
    syncs = []
    real = os.fdatasync

    def slowed(descriptor):
        time.sleep(SLOWER)
        syncs.append(real(descriptor))

    def counted(descriptor):
        syncs.append(real(descriptor))

    with mock.patch("os.fdatasync", slowed if variant == "sync, slow disk" else counted):
        count = max(1, args.megabytes * 1_000_000 // MESSAGE)
        before, began = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
        bag = _bag(path, variant, args)
        for number in range(count):
            bag.write("/text", data, number, number, number)
        written = time.perf_counter() - began
        bag.close()
        after = resource.getrusage(resource.RUSAGE_SELF)
        path.unlink()
        os.sync()  # the next variant does not pay for this one
        syncs.clear()
        bag = _bag(path, variant, args)
        waits, begin = [], time.perf_counter()
        for number in range(max(1, round(200 * args.seconds))):
            time.sleep(max(0.0, begin + number / 200 - time.perf_counter()))
            start = time.perf_counter()
            bag.write("/text", data, number, number, number)
            waits.append(1e6 * (time.perf_counter() - start))
        rate = len(syncs) / (time.perf_counter() - begin)
        bag.close()
        path.unlink()
    cpu = sum(after[:2]) - sum(before[:2])
    return {
        "throughput": 1e-6 * count * MESSAGE / written,
        "cpu_ms": 1e9 * cpu / (count * MESSAGE),
        "median_us": float(np.median(waits)),
        "p99_us": float(np.quantile(waits, 0.99)),
        "largest_us": max(waits),
        "syncs": rate,
    }


def _bag(path: Path, variant: str, args) -> BagWriter:
    bag = BagWriter(path, flush_interval=args.flush, sync=variant != "no sync")
    bag.add_topic(Topic("/text", STRING, []))
    return bag
