# SPDX-License-Identifier: Apache-2.0
"""Peak memory and bytes per triangle, as reported by the detector and by the operating system.

  python -m bench memory                      the files of HPCCD_DATA and the generated scenes of Table 1's sizes
  python -m bench memory n-body --methods default,published,naive,front

"process" is the peak resident size of a new process that detects, minus that of one that does everything else.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import hpccd_core as hc
from bench import lab
from hpccd_core.options import METHODS
from hpccd_ros.bench.sources import TABLE_1

COLUMNS = {
    "scene": "scene",
    "method": "method",
    "triangles": "triangles",
    "contacts": "contacts",
    "detector, MiB": lambda row: row["detector_bytes"] / 2**20,
    "bytes a triangle": lab.whole("detector_bytes_per_triangle"),
    "process, MiB": lambda row: row["process_bytes"] / 2**20,
}


def configure(parser):
    lab.configure(parser, ("data", *TABLE_1))
    parser.add_argument("--methods", default="default", metavar="NAME,...", help=f"of {', '.join(METHODS)}")
    lab.tier_option(parser)


def run(args) -> lab.Report:
    methods = lab.listed("--methods", args.methods, METHODS)
    result, sources = lab.begin(args)
    for source in sources:
        step = source.step(source.spread(1)[0])
        if step is None:
            result.note(f"{source.name} skipped: its last step changes the topology")
            continue
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "step.npz"
            np.savez(path, faces=step.faces(), vertices_t0=step.vertices_t0, vertices_t1=step.vertices_t1)
            base = _median_peak(path, args, None)["peak_bytes"]
            for method in methods:
                run_ = _median_peak(path, args, method)
                held = run_["bytes"]
                result.add(
                    scene=source.name,
                    method=method,
                    triangles=step.triangles,
                    contacts=run_["contacts"],
                    detector_bytes=held,
                    detector_bytes_per_triangle=held / step.triangles,
                    process_bytes=run_["peak_bytes"] - base,
                )
    lab.show(f"peak memory of a step, {args.accuracy}, {args.threads or lab.cores()} threads", COLUMNS, result.rows)
    return result


def _median_peak(path, args, method):
    """The run whose peak is the median."""
    options = {"accuracy": args.accuracy, "backend": "cpu", "threads": args.threads, "method": method}
    words = [sys.executable, "-m", "bench.memory", str(path), json.dumps(method and options)]
    ended = [subprocess.run(words, capture_output=True, text=True, check=True) for _ in range(args.repeat)]
    runs = [json.loads(one.stdout) for one in ended]
    return sorted(runs, key=lambda one: one["peak_bytes"])[len(runs) // 2]


def _detect(path: str, options: str) -> None:
    """The process that is watched. options: of the detector, as JSON; null: do not detect."""
    with np.load(path, allow_pickle=False) as archive:
        faces, vertices_t0, vertices_t1 = (archive[key] for key in ("faces", "vertices_t0", "vertices_t1"))
    scene = hc.Scene()
    scene.add_mesh("scene", faces, n_vertices=len(vertices_t0))
    found = {}
    if (wanted := json.loads(options)) is not None:
        detector = hc.Detector(scene, **wanted)
        for _ in range(3):  # buffers have their size when a stream has run for a while
            contacts = detector.detect(vertices_t0, vertices_t1)
        found = {"contacts": len(contacts), "bytes": detector.stats["bytes"]}
    status = Path("/proc/self/status").read_text()
    peak = next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]
    print(json.dumps({"peak_bytes": 1024 * int(peak), **found}))


if __name__ == "__main__":
    _detect(*sys.argv[1:])
