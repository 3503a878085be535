# SPDX-License-Identifier: Apache-2.0
"""Time of a step against the number of triangles, both logarithmic, with a linear law beside it."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing


def draw(report, path) -> None:
    rows = report.rows
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    threads = sorted({row["threads"] for row in rows})
    figure, axes = drawing.panels(len(scenes), columns=3, width=3.8, height=3.0)
    for scene, axis in zip(scenes, axes, strict=True):
        for place, n in enumerate(threads):
            mine = [row for row in rows if row["scene"] == scene and row["threads"] == n]
            x, y = [row["triangles"] for row in mine], [row["step_ms"] for row in mine]
            axis.plot(x, y, marker=drawing.MARKERS[place], color=drawing.SERIES[place],
                      label="1 thread" if n == 1 else f"{n} threads")  # fmt: skip
            axis.plot(x, [y[0] * t / x[0] for t in x], color="black", linewidth=0.8, linestyle=":",
                      label="linear" if place == 0 else None)  # fmt: skip
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_title(scene, fontsize=9)
        # Only what was measured: the axis's own labels run into one another on little more than a decade.
        axis.set_xticks(x, [f"{triangles:,}" for triangles in x])
        axis.minorticks_off()
        axis.set_xlabel("triangles", fontsize=8)
        axis.set_ylabel("ms a step", fontsize=8)
        axis.legend(fontsize=7, frameon=False)
    drawing.save(figure, path, report, f"Time of a step against size, {rows[0]['accuracy']}")
