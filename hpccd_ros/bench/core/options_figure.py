# SPDX-License-Identifier: Apache-2.0
"""Bars: time of a step with each option, the full run on top."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing


def draw(report, path) -> None:
    scenes = list(dict.fromkeys(row["scene"] for row in report.rows))
    figure, axes = drawing.panels(len(scenes), columns=3, width=4.4, height=2.9)
    for scene, axis in zip(scenes, axes, strict=True):
        rows = [row for row in report.rows if row["scene"] == scene]
        for place, row in enumerate(rows):
            axis.barh(place, row["step_ms"], height=0.7, color=drawing.GREY if place == 0 else drawing.BLUE)
            said = f" {row['step_ms']:.3g} ms, {row['over_full']:.2f}"
            axis.text(row["step_ms"], place, said, va="center", fontsize=7)
        axis.set_yticks(range(len(rows)), [row["option"] for row in rows], fontsize=7.5)
        axis.invert_yaxis()
        axis.grid(False, axis="y")
        axis.set_xlim(0, 1.45 * max(row["step_ms"] for row in rows))
        axis.set_xlabel("ms a step", fontsize=8)
        axis.set_title(scene, fontsize=9)
    first = report.rows[0]
    drawing.save(figure, path, report, f"What each option saves, {first['accuracy']}, {first['threads']} threads")
