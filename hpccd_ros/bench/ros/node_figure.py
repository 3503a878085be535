# SPDX-License-Identifier: Apache-2.0
"""Bars: latency beside that of the echo, in its parts; marks at the 95th and 99th percentile."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing

PARTS = {"in": drawing.BLUE, "hand over": drawing.SKY, "answer": drawing.ORANGE, "out": drawing.GREEN}


def draw(report, path) -> None:
    rows = [row for row in report.rows if row["what"] == "latency"]
    figure, axes = drawing.panels(len(rows), columns=2, width=4.6, height=2.2)
    used = {}
    for row, axis in zip(rows, axes, strict=True):
        used["echo"] = axis.barh(0, row["echo_median_ms"], color=drawing.GREY, height=0.6)
        left = 0.0
        for part, color in PARTS.items():
            ms = row["parts_ms"][part]
            used[part] = axis.barh(1, ms, left=left, color=color, height=0.6)
            left += ms
        for place, who in enumerate(("echo", "node")):
            ends = [row[f"{who}_{key}_ms"] for key in ("median", "p95", "p99")]
            axis.plot(ends[1:], [place] * 2, "|", color="black", markersize=12)
            axis.plot([ends[0], ends[2]], [place] * 2, color="black", linewidth=0.8)
        axis.set_yticks([0, 1], ["echo", "node without\nits core"], fontsize=8)
        axis.invert_yaxis()
        axis.set_xlim(0, None)
        axis.grid(False, axis="y")
        axis.set_xlabel("ms; strokes: 95th and 99th percentile", fontsize=8)
        axis.set_title(f"{row['scene']}: {row['mb_in']:.2g} MB in, {row['mb_out']:.2g} MB out, "
                       f"{row['ratio']:.2f} x the echo", fontsize=9)
    figure.legend(list(used.values()), list(used), loc="outside right upper", fontsize=8, frameon=False)
    drawing.save(figure, path, report, "From publish to contacts: what the node adds to ROS")
