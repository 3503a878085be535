# SPDX-License-Identifier: Apache-2.0
"""Speed-up over threads, a line for each number of GPUs and each method: Fig. 6 of Kim et al. 2009."""

from __future__ import annotations

from pathlib import Path

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.report import drawing

GPUS = (drawing.GREY, drawing.BLUE, drawing.ORANGE, drawing.GREEN, drawing.RED)
LINES = {"default": "-", "published": "--"}


def draw(report, path: Path) -> Path:
    """One panel for each scene, both axes logarithmic, since the two methods are ten times apart."""
    rows = [row for row in report.rows if row.get("part") == "threads and GPUs"]
    if not rows:
        raise UserError("no times by threads and GPUs in this result: measure with --parts threads")
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    threads = sorted({row["threads"] for row in rows})
    figure, axes = drawing.panels(len(scenes), columns=3, width=3.8, height=3.4)
    for axis, scene in zip(axes, scenes, strict=True):
        axis.set_title(scene, fontsize=9)
        for method, line in LINES.items():
            for gpus in sorted({row["gpus"] for row in rows}):
                _line(axis, [r for r in rows if (r["scene"], r["method"], r["gpus"]) == (scene, method, gpus)],
                      linestyle=line, color=GPUS[gpus % len(GPUS)], marker=drawing.MARKERS[gpus],
                      label=f"{method}, {_count(gpus)}")  # fmt: skip
        axis.set_xscale("log", base=2)
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        drawing.whole_number_axis(axis, threads)
        axis.set_xlabel("CPU threads", fontsize=8)
        axis.set_ylabel("times faster than 1 thread, published", fontsize=8)
    axes[0].legend(fontsize=7, frameon=False, handlelength=4)
    path.parent.mkdir(parents=True, exist_ok=True)
    drawing.save(
        figure, path, report, f"Hybrid: speed-up by threads and GPUs, {rows[0]['accuracy']} (Kim et al. 2009, Fig. 6)"
    )
    return path


def _count(gpus: int) -> str:
    return "no GPU" if gpus == 0 else "1 GPU" if gpus == 1 else f"{gpus} GPUs"


def _line(axis, rows, **style):
    found = sorted(rows, key=lambda row: row["threads"])
    axis.plot([r["threads"] for r in found], [r["speedup"] for r in found], markersize=4.5, linewidth=1.5, **style)
