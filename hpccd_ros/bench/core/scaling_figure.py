# SPDX-License-Identifier: Apache-2.0
"""Lines over the number of threads: Fig. 7 (speed-up) and Fig. 6 (ms a step)."""

from __future__ import annotations

from hpccd_ros.bench.core.independent import METHOD as INDEPENDENT
from hpccd_ros.bench.report import drawing


def draw_speedup(report, path) -> None:
    """One panel for all scenes with the first method, as Fig. 7, then one for each scene with all methods."""
    rows = [row for row in report.rows if "speedup" in row]
    if not rows:  # without a run of one thread there is no speed-up
        rows = [{**row, "speedup": 1.0} for row in report.rows]
    scenes, methods = _names(rows, "scene"), _names(rows, "method")
    threads = sorted({row["threads"] for row in rows})
    figure, axes = drawing.panels(1 + len(scenes), columns=4)
    overview = axes[0]
    overview.set_title(f"all scenes, method {methods[0]}", fontsize=9)
    for place, scene in enumerate(scenes):
        color, marker = drawing.SERIES[place % 8], drawing.MARKERS[place % 7]
        _line(overview, rows, scene, methods[0], label=scene, color=color, marker=marker)
    if "naive" in methods and methods[0] != "naive":
        average = [
            sum(r["speedup"] for r in rows if r["method"] == "naive" and r["threads"] == n) / len(scenes)
            for n in threads
        ]
        overview.plot(threads, average, color=drawing.GREY, marker="^", linestyle="--", label="naive, average")
    for axis, scene in zip(axes[1:], scenes, strict=True):
        axis.set_title(scene, fontsize=9)
        for method in methods:
            label, line = (method, "-") if method != INDEPENDENT else ("independent detectors", "--")
            _line(axis, rows, scene, method, label=label, linestyle=line, color=drawing.METHOD[method], marker="o")
    for axis in axes:
        axis.plot(threads, threads, color="black", linewidth=0.8, linestyle=":", label="linear", zorder=1)
        axis.set_xlim(0.7, threads[-1] + 0.3)
        axis.set_ylim(0, threads[-1] * 1.05)
        drawing.whole_number_axis(axis, threads)
        axis.set_xlabel("threads", fontsize=8)
        axis.set_ylabel("times faster than one thread", fontsize=8)
    axes[0].legend(fontsize=7, frameon=False)
    if len(scenes):
        axes[1].legend(fontsize=7, frameon=False)
    drawing.save(
        figure, path, report, f"Speed-up against threads, {rows[0]['accuracy']} (after Kim et al. 2009, Fig. 7)"
    )


def draw_times(report, path) -> None:
    """ms a step over threads, one panel for each scene, a line for each method."""
    rows = [row for row in report.rows if row["method"] != INDEPENDENT]
    scenes, methods = _names(rows, "scene"), _names(rows, "method")
    threads = sorted({row["threads"] for row in rows})
    figure, axes = drawing.panels(len(scenes), columns=4)
    for axis, scene in zip(axes, scenes, strict=True):
        axis.set_title(f"{scene}, {_of(rows, scene, methods[0])[0]['triangles'] / 1000:.0f} K triangles", fontsize=9)
        for method in methods:
            _line(axis, rows, scene, method, label=method, color=drawing.METHOD[method], marker="o", y="median_ms")
        axis.set_ylim(0, None)
        drawing.whole_number_axis(axis, threads)
        axis.set_xlabel("threads", fontsize=8)
        axis.set_ylabel("median ms a step", fontsize=8)
    axes[0].legend(fontsize=7, frameon=False)
    drawing.save(
        figure, path, report, f"Time of a step against threads, {rows[0]['accuracy']} (after Kim et al. 2009, Fig. 6)"
    )


def _names(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def _of(rows, scene, method):
    return sorted((r for r in rows if r["scene"] == scene and r["method"] == method), key=lambda r: r["threads"])


def _line(axis, rows, scene, method, y="speedup", **style):
    found = _of(rows, scene, method)
    axis.plot([r["threads"] for r in found], [r[y] for r in found], markersize=4.5, linewidth=1.5, **style)
