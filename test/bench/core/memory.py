# SPDX-License-Identifier: Apache-2.0
"""Peak memory and bytes per triangle: what the detector says it holds, and what the operating system saw.

  python -m bench memory                      the files of HPCCD_DATA and the generated scenes of Table 1's sizes
  python -m bench memory n-body --methods default,published,naive,front

"process" is the peak resident size of a fresh process that detects, less that of one that does all the same but the
detecting. "all candidates" is what keeping the step's candidate pairs would take, at 8 bytes a pair: candidates are
tested in batches instead, so they never show.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bench import command
from bench.core.variants import usable
from bench.report import progress
from hpccd_core.options import METHODS
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import TABLE_1

BYTES_OF_A_PAIR = 8


def configure(parser):
    command.configure(parser, default=("data", *TABLE_1), steps=None, rounds=5)
    parser.add_argument(
        "--methods", default="default", metavar="NAME,...", help=f"of {', '.join(METHODS)} (default: %(default)s)"
    )
    command.tier_option(parser)
    command.threads_option(parser)


def run(args) -> int:
    report, sources = command.begin(args)
    methods, refused = usable("method", command.listed("--methods", args.methods, METHODS), accuracy=args.accuracy)
    command.skipped(report, "method", refused)
    for source in sources:
        step = source.step(source.spread(1)[0])
        if step is None:
            report.note(f"{source.name} skipped: its last step changes the topology")
            continue
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "step.npz"
            np.savez(path, faces=step.faces(), vertices_t0=step.vertices_t0, vertices_t1=step.vertices_t1)
            with progress.bar(source.name, args.repeat * (len(methods) + 1)) as bar:
                base = _median_peak(path, args, None, bar)["peak_bytes"]
                for method in methods:
                    report.add(**_row(source, step, method, _median_peak(path, args, method, bar), base, args))
    _print(report)
    return command.end(args, report)


def _median_peak(path, args, method, bar):
    """The run whose peak is the median."""
    runs = []
    for _ in range(args.repeat):
        options = (
            None
            if method is None
            else {"accuracy": args.accuracy, "backend": "cpu", "threads": args.threads, "method": method}
        )
        child = subprocess.run(
            [sys.executable, "-m", "bench.core.memory_process", str(path), json.dumps(options)],
            capture_output=True,
            text=True,
            check=True,
        )
        runs.append(json.loads(child.stdout))
        bar.step(f"{runs[-1]['peak_bytes'] / 2**20:.0f} MB")
    return sorted(runs, key=lambda run: run["peak_bytes"])[len(runs) // 2]


def _row(source, step, method, run, base, args):
    stats = run["stats"]
    candidates = stats["vf_candidates"] + stats["ee_candidates"]
    return {
        "scene": source.name,
        "method": method,
        "accuracy": args.accuracy,
        "threads": args.threads or cores(),
        "triangles": step.triangles,
        "contacts": run["contacts"],
        "detector_bytes": stats["bytes"],
        "detector_bytes_per_triangle": stats["bytes"] / step.triangles,
        "process_bytes": run["peak_bytes"] - base,
        "process_bytes_per_triangle": (run["peak_bytes"] - base) / step.triangles,
        "candidates": candidates,
        "all_candidates_bytes": BYTES_OF_A_PAIR * candidates,
    }


def _print(report):
    mega = 2**20
    if not report.rows:
        return
    tables.show(
        f"peak memory of a step, {report.rows[0]['accuracy']}, {report.rows[0]['threads']} threads",
        [
            "scene",
            "method",
            "triangles",
            "contacts",
            "detector MB",
            "bytes / triangle",
            "process MB",
            "bytes / triangle",
            "candidate pairs",
            "all candidates MB",
        ],
        [
            [
                r["scene"],
                r["method"],
                r["triangles"],
                r["contacts"],
                r["detector_bytes"] / mega,
                round(r["detector_bytes_per_triangle"]),
                r["process_bytes"] / mega,
                round(r["process_bytes_per_triangle"]),
                r["candidates"],
                r["all_candidates_bytes"] / mega,
            ]
            for r in report.rows
        ],
        "process: with result arrays, thread stacks and what building the hierarchy takes for a moment",
    )
