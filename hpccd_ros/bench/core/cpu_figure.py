# SPDX-License-Identifier: Apache-2.0
"""Bars: the time of an average step and its stages, and the peer's beside them."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing, table


def in_order(stages: dict[str, float]) -> list[str]:
    """Names of the stages as they run, without the total; unknown ones at the end."""
    return [s for s in drawing.STAGE if s in stages] + [s for s in stages if s not in drawing.STAGE and s != "total"]


def draw(report, path) -> None:
    scenes = list(dict.fromkeys(row["scene"] for row in report.rows))
    figure, axes = drawing.panels(len(scenes), columns=4, width=3.5, height=2.6)
    used: dict[str, object] = {}
    for scene, axis in zip(scenes, axes, strict=True):
        rows = [row for row in report.rows if row["scene"] == scene]
        for place, row in enumerate(rows):
            left = 0.0
            for number, stage in enumerate(in_order(row["stages_ms"])):
                ms = max(0.0, row["stages_ms"][stage])
                color = drawing.STAGE.get(stage, drawing.SERIES[number % len(drawing.SERIES)])
                used[stage] = axis.barh(place, ms, left=left, color=color, height=0.7)
                left += ms
            ratio = row.get("times_faster_than_ipctk")
            said = f" {table.text(left)} ms" + (f", {ratio:.3g} x faster" if ratio else "")
            axis.text(left, place, said, va="center", fontsize=7.5)
        axis.set_yticks(range(len(rows)), [row["variant"] for row in rows], fontsize=8)
        axis.invert_yaxis()
        axis.set_title(f"{scene}, {rows[0]['triangles'] / 1000:.0f} K triangles", fontsize=9)
        # Room for the words beside the longest bar.
        axis.set_xlim(0, max(sum(r["stages_ms"][s] for s in in_order(r["stages_ms"])) for r in rows) * 1.75)
        axis.grid(False, axis="y")
        axis.set_xlabel("ms a step", fontsize=8)
    order = in_order(used)
    figure.legend([used[s] for s in order], order, loc="outside right upper", fontsize=8, frameon=False)
    first = report.rows[0]
    drawing.save(figure, path, report, f"Time of an average step, {first['accuracy']}, {first['threads']} threads")
