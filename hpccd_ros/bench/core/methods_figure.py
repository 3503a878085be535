# SPDX-License-Identifier: Apache-2.0
"""Bars: time of each method and instruction set, one panel for each scene."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing


def draw(report, path) -> None:
    scenes = list(dict.fromkeys(row["scene"] for row in report.rows))
    figure, axes = drawing.panels(len(scenes), columns=3, width=3.8, height=2.8)
    for scene, axis in zip(scenes, axes, strict=True):
        rows = [row for row in report.rows if row["scene"] == scene]
        for place, row in enumerate(rows):
            ms = row["sequence_ms"] / row["steps"]
            plain = drawing.SKY if row["threads"] > 1 else "#bbbbbb"
            axis.barh(place, ms, height=0.7, color=drawing.METHOD.get(row["variant"], plain))
            wrong = "" if row["same_contacts"] else "  OTHER CONTACTS"
            axis.text(ms, place, f" {ms:.3g}{wrong}", va="center", fontsize=7)
        axis.set_yticks(range(len(rows)), [row["variant"] for row in rows], fontsize=7.5)
        axis.invert_yaxis()
        axis.grid(False, axis="y")
        axis.set_xlim(0, 1.2 * max(row["sequence_ms"] / row["steps"] for row in rows))
        axis.set_xlabel("ms a step", fontsize=8)
        axis.set_title(scene, fontsize=9)
    threads = max(row["threads"] for row in report.rows)
    drawing.save(figure, path, report, f"Methods and instruction sets, {report.rows[0]['accuracy']}, {threads} threads")
