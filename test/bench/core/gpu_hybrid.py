# SPDX-License-Identifier: Apache-2.0
"""The hybrid backend as Kim et al. 2009 measure theirs: Fig. 6 (threads by GPUs), segment sizes of section 6.2."""

from __future__ import annotations

import hpccd_core as hc
from bench.core.gpu_times import detector_times
from bench.report.progress import bar
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores

SEGMENT_PAIRS = (128, 256, 512, 1024, 2048, 4096, 8192, 16384)


def figure_6(report, args, name, step, accuracy="balanced"):
    """Threads 1, 2, 4, ... by 0, 1, ... GPUs, of the default and the published method, over one CPU thread with the
    published one."""
    gpus = range(len(hc.gpu_status()["devices"]) + 1)
    counts = sorted({*(1 << k for k in range(cores().bit_length()) if 1 << k <= cores()), cores()})
    runs = [("published", 1, 0)]
    runs += [
        (method, n, g) for method in ("published", "default") for n in counts for g in gpus if (method, n, g) != runs[0]
    ]
    base, expected = None, None
    with bar(f"{name}: threads and GPUs", len(runs)) as progress:
        for method, threads, n_gpus in runs:
            where = {"backend": "hybrid", "gpus": n_gpus} if n_gpus else {"backend": "cpu"}
            detector = hc.Detector(step.scene(), accuracy=accuracy, method=method, threads=threads, **where)
            measured, contacts = detector_times(detector, step, args.repeat)
            base, expected = base or measured.median, expected or contacts.hash
            _check(report, detector, contacts, expected, f"{name}, {method}, {threads} threads, {n_gpus} GPUs")
            report.add(
                part="threads and GPUs",
                scene=name,
                accuracy=accuracy,
                method=method,
                threads=threads,
                gpus=n_gpus,
                **measured.as_row(),
                speedup=base / measured.median,
            )
            progress.step()


def segment_sizes(report, args, name, step, accuracy="balanced"):
    """Frame time against the pairs a segment holds."""
    runs = [(m, n, p) for m in ("published", "default") for n in sorted({4, cores()}) for p in SEGMENT_PAIRS]
    with bar(f"{name}: segment sizes", len(runs)) as progress:
        for method, threads, pairs in runs:
            options = {"method": method, "threads": threads, "hybrid_segment_pairs": pairs}
            detector = hc.Detector(step.scene(), accuracy=accuracy, backend="hybrid", **options)
            measured, _ = detector_times(detector, step, args.repeat)
            report.add(
                part="segment size",
                scene=name,
                accuracy=accuracy,
                method=method,
                threads=threads,
                segment_pairs=pairs,
                **measured.as_row(),
            )
            progress.step()


def show(report):
    """Both as tables."""
    rows = [r for r in report.rows if r.get("part") == "threads and GPUs"]
    gpus = sorted({r["gpus"] for r in rows})
    lines = {}
    for r in rows:
        lines.setdefault((r["scene"], r["method"], r["threads"]), {})[r["gpus"]] = r
    cells = [[*key, *(value for g in gpus for value in _cell(found.get(g)))] for key, found in lines.items()]
    heads = [head for g in gpus for head in (f"{g} GPUs: ms", "times")]
    if cells:
        tables.show(
            "Fig. 6: ms, and times one CPU thread with the published method",
            ["scene", "method", "threads", *heads],
            cells,
            "the communication thread comes on top; with all cores it takes the place of the last one",
        )
    rows = [r for r in report.rows if r.get("part") == "segment size"]
    lines = {}
    for r in rows:
        lines.setdefault((r["scene"], r["method"], r["threads"]), []).append(r["median_ms"])
    if lines:
        tables.show(
            "section 6.2: ms by pairs in a segment",
            ["scene", "method", "threads", *map(str, SEGMENT_PAIRS)],
            [[*key, *ms] for key, ms in lines.items()],
        )


def _cell(row):
    return (row["median_ms"], row["speedup"]) if row else (None, None)


def _check(report, detector, contacts, expected, what):
    if contacts.hash != expected:
        report.failure(f"{what}: contacts differ")
    if detector.stats.get("gpu_fallbacks"):
        report.failure(f"{what}: frames left to the CPU: {detector.last_gpu_error}")
