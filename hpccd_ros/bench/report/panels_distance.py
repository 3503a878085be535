# SPDX-License-Identifier: Apache-2.0
"""Panels about distance queries: time against distance, beside plain detection and a peer; wrong answers of tiers."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing
from hpccd_ros.bench.report.drawing import BLUE, GREEN, ORANGE, PURPLE, RED

BY_DISTANCE = {"separation": {"color": BLUE, "marker": "o"}, "proximity": {"color": GREEN, "marker": "s"}}
# Without a distance: a level line.
LEVEL = {"plain": "black", "intersections": ORANGE, "distances": PURPLE}
LABEL = {
    "plain": "plain detection",
    "separation": "with separation d",
    "proximity": "proximity within d",
    "distances": "smallest distances",
}


def heading(rows: list[dict]) -> str:
    plain = next(row for row in rows if row["query"] == "plain")
    return f"{plain['scene']}\n{plain['triangles'] / 1000:.0f} K triangles, {plain['pairs']:,.0f} contacts"


def against_distance(axis, rows: list[dict]) -> dict:
    """ms a step upwards, d to the right, both logarithmic; dashed: the peer."""
    of = {mine[0]["query"]: mine for mine in drawing.by(rows, "query")}
    handles = {}
    for query, colour in LEVEL.items():
        for row in of.get(query, ()):
            label = LABEL.get(query, query)
            handles[label] = axis.axhline(row["step_ms"], color=colour, linewidth=1.5, label=label)
            if "ipctk_ms" in row:
                handles[f"ipctk: {query}"] = axis.axhline(
                    row["ipctk_ms"], color=colour, linewidth=1.2, linestyle="--", label=f"ipctk: {query}"
                )
    for query, style in BY_DISTANCE.items():
        if query not in of:
            continue
        handles[LABEL[query]] = drawing.line(axis, of[query], "distance", "step_ms", label=LABEL[query], **style)
        if theirs := [row for row in of[query] if "ipctk_ms" in row]:
            style = style | {"linestyle": "--", "fillstyle": "none", "label": f"ipctk: {query}"}
            handles[f"ipctk: {query}"] = drawing.line(axis, theirs, "distance", "ipctk_ms", **style)
    axis.set_yscale("log")
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:,g}")
    axis.yaxis.set_minor_formatter(_between_powers())
    axis.tick_params(which="minor", labelsize=7)
    if of.keys() & BY_DISTANCE.keys():
        axis.set_xscale("log")
    else:  # level lines alone
        axis.set_xticks([])
    drawing.labels(axis, "d, units of the scene" if of.keys() & BY_DISTANCE.keys() else "", "ms a step")
    return handles


def _between_powers():
    """Plain numbers where matplotlib labels ticks between powers of ten: where the axis spans few of these."""
    from matplotlib.ticker import LogFormatter

    class Plain(LogFormatter):
        def __call__(self, value, place=None):
            return f"{value:,g}" if super().__call__(value, place) else ""

    return Plain()


def queries(rows: list[dict]) -> str:
    return f"{rows[0]['query']}, {sum(mine[0]['n'] for mine in drawing.by(rows, 'generator')):,} queries"


def wrong_answers(axis, rows: list[dict]) -> dict:
    """Share of queries that each tier misses or invents, of all generators together."""
    tiers = [
        {"accuracy": mine[0]["accuracy"]} | {key: sum(row[key] for row in mine) for key in ("n", "missed", "invented")}
        for mine in drawing.by(rows, "accuracy")
    ]

    def parts(tier):
        return {key: (100 * tier[key] / tier["n"], colour) for key, colour in (("missed", RED), ("invented", ORANGE))}

    def said(tier, _):
        return f" {tier['missed']:,} + {tier['invented']:,}" if tier["missed"] + tier["invented"] else " none"

    handles = drawing.bars(axis, tiers, "accuracy", parts, said, room=1.5)
    axis.set_xlabel("wrong answers, %", fontsize=8)
    return handles
