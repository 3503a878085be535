# SPDX-License-Identifier: Apache-2.0
"""The pictures that benchmarks draw, as a table at the end: of which result, which rows, which axes."""

from __future__ import annotations

from pathlib import Path

from hpccd_ros.bench.report import drawing, panels_distance, panels_limit, panels_trade, table
from hpccd_ros.bench.report.drawing import (
    BACKEND,
    BLUE,
    GREEN,
    GREY,
    MARKERS,
    ORANGE,
    PURPLE,
    RED,
    SERIES,
    SKY,
    TIER,
    Figure,
)
from hpccd_ros.bench.report.results import whole_scene

METHOD = {"default": BLUE, "published": GREEN, "naive": RED, "front": PURPLE, "independent": GREY}
GPUS = (GREY, BLUE, ORANGE, GREEN, RED)
# Stages in the order in which they run; the paper's four components (section 6.2) have four families of colour.
STAGE = {
    "bounds": "#9ecae1",
    "refit": "#4292c6",
    "build": "#08519c",
    "traverse": GREEN,
    "elementary": ORANGE,
    "contacts": PURPLE,
    "other": GREY,
    "outside": "#cccccc",
    "broad": "#c7e9c0",
    "narrow": "#fdd49e",
}
NODE_PART = {"in": BLUE, "hand over": SKY, "answer": ORANGE, "out": GREEN}
# Where an error of exactly zero is drawn on a logarithmic axis.
TOC_FLOOR, SHARE_FLOOR = 1e-17, 1e-5


def stages_in_order(stages: dict[str, float]) -> list[str]:
    """Names of the stages as they run, without the total; unknown ones at the end."""
    return [s for s in STAGE if s in stages] + [s for s in stages if s not in STAGE and s != "total"]


def _triangles(rows) -> str:
    return f"{rows[0]['scene']}, {rows[0]['triangles'] / 1000:.0f} K triangles"


def _stages(axis, rows):
    def parts(row):
        stages = row["stages_ms"]
        return {s: (max(0.0, stages[s]), STAGE.get(s, SERIES[n % 8])) for n, s in enumerate(stages_in_order(stages))}

    def said(row, ms):
        ratio = row.get("times_faster_than_ipctk")
        return f" {table.text(ms)} ms" + (f", {ratio:.3g} x faster" if ratio else "")

    found = drawing.bars(axis, rows, "variant", parts, said, room=1.75)
    return {stage: found[stage] for stage in stages_in_order(found)}


def _variants(axis, rows):
    def parts(row):
        plain = SKY if row["threads"] > 1 else "#bbbbbb"
        return {"": (row["sequence_ms"] / row["steps"], METHOD.get(row["variant"], plain))}

    def said(row, ms):
        return f" {ms:.3g}" + ("" if row["same_contacts"] else "  OTHER CONTACTS")

    drawing.bars(axis, rows, "variant", parts, said, room=1.2)


def _options(axis, rows):
    def parts(row):
        return {"": (row["step_ms"], GREY if row is rows[0] else BLUE)}

    drawing.bars(axis, rows, "option", parts, lambda row, ms: f" {ms:.3g} ms, {row['over_full']:.2f}", room=1.45)


def _speedup_axes(axis, rows):
    threads = sorted({row["threads"] for row in rows})
    axis.plot(threads, threads, color="black", linewidth=0.8, linestyle=":", label="linear", zorder=1)
    axis.set_xlim(0.7, threads[-1] + 0.3)
    axis.set_ylim(0, threads[-1] * 1.05)
    drawing.whole_number_axis(axis, threads)
    drawing.labels(axis, "threads", "times faster than one thread")


def _speedup_of_all(axis, rows):
    """Fig. 7: the first method on all scenes, and the average of the naive one."""
    first = rows[0]["method"]
    axis.set_title(f"all scenes, method {first}", fontsize=9)
    for place, mine in enumerate(drawing.by([r for r in rows if r["method"] == first], "scene")):
        style = {"color": SERIES[place % 8], "marker": MARKERS[place % 7]}
        drawing.line(axis, mine, "threads", "speedup", label=mine[0]["scene"], **style)
    naive = drawing.by([r for r in rows if r["method"] == "naive"], "threads")
    if naive and first != "naive":
        average = [{**mine[0], "speedup": sum(r["speedup"] for r in mine) / len(mine)} for mine in naive]
        style = {"color": GREY, "marker": "^", "linestyle": "--"}
        drawing.line(axis, average, "threads", "speedup", label="naive, average", **style)
    _speedup_axes(axis, rows)


def _speedup(axis, rows):
    for mine in drawing.by(rows, "method"):
        method = mine[0]["method"]
        label, style = (method, "-") if method != "independent" else ("independent detectors", "--")
        drawing.line(axis, mine, "threads", "speedup", label=label, linestyle=style, color=METHOD[method], marker="o")
    _speedup_axes(axis, rows)


def _threads(axis, rows):
    for mine in drawing.by(rows, "method"):
        method = mine[0]["method"]
        drawing.line(axis, mine, "threads", "median_ms", label=method, color=METHOD[method], marker="o")
    axis.set_ylim(0, None)
    drawing.whole_number_axis(axis, (row["threads"] for row in rows))
    drawing.labels(axis, "threads", "median ms a step")


def _hybrid(axis, rows):
    for method, style in (("default", "-"), ("published", "--")):
        for mine in sorted(drawing.by([r for r in rows if r["method"] == method], "gpus"), key=lambda m: m[0]["gpus"]):
            gpus = mine[0]["gpus"]
            count = "no GPU" if gpus == 0 else "1 GPU" if gpus == 1 else f"{gpus} GPUs"
            drawing.line(
                axis,
                mine,
                "threads",
                "speedup",
                linestyle=style,
                color=GPUS[gpus % len(GPUS)],
                marker=MARKERS[gpus % len(MARKERS)],
                label=f"{method}, {count}",
            )
    axis.set_xscale("log", base=2)
    axis.set_yscale("log")  # the two methods are ten times apart
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    drawing.whole_number_axis(axis, (row["threads"] for row in rows))
    drawing.labels(axis, "CPU threads", "times faster than 1 thread, published")


def _size(axis, rows):
    for place, mine in enumerate(sorted(drawing.by(rows, "threads"), key=lambda m: m[0]["threads"])):
        n, style = mine[0]["threads"], {"marker": MARKERS[place], "color": SERIES[place]}
        drawing.line(axis, mine, "triangles", "step_ms", label="1 thread" if n == 1 else f"{n} threads", **style)
        x = [row["triangles"] for row in mine]
        axis.plot(
            x,
            [mine[0]["step_ms"] * t / x[0] for t in x],
            color="black",
            linewidth=0.8,
            linestyle=":",
            label=None if place else "linear",
        )
    axis.set_xscale("log")
    axis.set_yscale("log")
    # Only what was measured: the axis's own labels run into one another on little more than a decade.
    drawing.whole_number_axis(axis, (row["triangles"] for row in rows))
    drawing.labels(axis, "triangles", "ms a step")


def _latency(axis, rows):
    (row,) = rows
    used = {"echo": axis.barh(0, row["echo_median_ms"], color=GREY, height=0.6)}
    left = 0.0
    for part, colour in NODE_PART.items():
        used[part] = axis.barh(1, row["parts_ms"][part], left=left, color=colour, height=0.6)
        left += row["parts_ms"][part]
    for place, who in enumerate(("echo", "node")):
        median, *late = (row[f"{who}_{key}_ms"] for key in ("median", "p95", "p99"))
        axis.plot(late, [place] * 2, "|", color="black", markersize=12)
        axis.plot([median, late[-1]], [place] * 2, color="black", linewidth=0.8)
    axis.set_yticks([0, 1], ["echo", "node without\nits core"], fontsize=8)
    axis.invert_yaxis()
    axis.set_xlim(0, None)
    axis.grid(False, axis="y")
    axis.set_xlabel("ms; strokes: 95th and 99th percentile", fontsize=8)
    return used


def _latency_heading(rows) -> str:
    row = rows[0]
    return f"{row['scene']}: {row['mb_in']:.2g} MB in, {row['mb_out']:.2g} MB out, {row['ratio']:.2f} x the echo"


def _tier_marker(row) -> dict:
    return {
        "linestyle": "",
        "marker": BACKEND[row["backend"]],
        "color": TIER[row["accuracy"]],
        "markersize": 8,
        "fillstyle": "none" if row["simd"] == "scalar" else "full",
    }


def _tiers(axis, rows):
    """ms a step to the right, error of the times of contact upwards, wrong contacts in words: best is below left."""
    from matplotlib.lines import Line2D

    handles = {}
    for row in rows:
        y = max(row["toc_worst"], TOC_FLOOR)
        (point,) = axis.plot(row["step_ms"], y, **_tier_marker(row))
        if row["backend"] == "cpu" and row["simd"] != "scalar":
            handles[row["accuracy"]] = point
        if row["missed"] + row["invented"]:
            axis.annotate(
                f"{row['missed']} missed, {row['invented']} invented",
                (row["step_ms"], y),
                textcoords="offset points",
                xytext=(7, -2),
                fontsize=7,
            )
    others = {"scalar code": {"simd": "scalar"}} if len({row["simd"] for row in rows}) > 1 else {}
    if len(backends := {row["backend"] for row in rows}) > 1:
        others |= {backend: {"backend": backend, "simd": "auto"} for backend in BACKEND if backend in backends}
    for name, other in others.items():
        handles[name] = Line2D([], [], **_tier_marker(rows[0] | other) | {"color": "grey"})
    axis.set_yscale("log")
    axis.set_ylim(TOC_FLOOR / 5, 1)
    axis.set_yticks([TOC_FLOOR, 1e-12, 1e-8, 1e-4, 1], ["exact", "1e-12", "1e-8", "1e-4", "1"])
    axis.set_xlim(0, 1.25 * max(row["step_ms"] for row in rows))
    drawing.labels(axis, "ms a step", "worst error of toc (step = 1)")
    return handles


def _sweep(axis, rows):
    for place, mine in enumerate(drawing.by(rows, "accuracy")):
        tier = mine[0]["accuracy"]
        # An offset of zero is drawn one decade below the first.
        drawn = [{"at": row["at"] or 0.1, "share": max(row["wrong_share"], SHARE_FLOOR)} for row in mine]
        drawing.line(
            axis,
            drawn,
            "at",
            "share",
            marker=MARKERS[place],
            color=TIER[tier],
            markersize=9 - 2 * place,
            linewidth=1.3,
            label=tier,
        )
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_ylim(SHARE_FLOOR / 2, 1)
    axis.set_yticks([SHARE_FLOOR, 1e-4, 1e-2, 1], ["none", "0.01 %", "1 %", "100 %"])
    of_scale = rows[0]["sweep"] == "scale"
    drawing.labels(axis, "scale" if of_scale else "distance from the origin, sizes of the features", "wrong answers")


FIGURES = (
    Figure(
        "cpu",
        "cpu",
        "Time of an average step, {accuracy}, {threads} threads",
        _stages,
        kept="cpu-4-cores",
        heading=_triangles,
        size=(4, 3.5, 2.6),
        legend="right",
    ),
    Figure(
        "scaling",
        "scaling",
        "Speed-up against threads, {accuracy} (after Kim et al. 2009, Fig. 7)",
        _speedup,
        rows=lambda row: "speedup" in row,
        kept="scaling-4-cores",
        overview=_speedup_of_all,
        legend="first",
    ),
    Figure(
        "threads",
        "scaling",
        "Time of a step against threads, {accuracy} (after Kim et al. 2009, Fig. 6)",
        _threads,
        rows=lambda row: row["method"] != "independent",
        heading=_triangles,
        legend="first",
    ),
    Figure(
        "hybrid",
        "gpu",
        "Hybrid: speed-up by threads and GPUs, {accuracy} (Kim et al. 2009, Fig. 6)",
        _hybrid,
        rows=lambda row: row["part"] == "threads and GPUs",
        kept="gpu-2-h200-32-cores",
        size=(3, 3.8, 3.4),
        legend="first",
    ),
    Figure(
        "accuracy",
        "accuracy",
        "What each tier costs and how far its times are off, {threads} threads",
        _tiers,
        rows=whole_scene,
        kept="accuracy-4-cores",
        size=(3, 3.9, 3.2),
        legend="right",
        heading=lambda rows: f"{rows[0]['scene']}, {rows[0]['contacts']:,.0f} contacts",
        right="center",
    ),
    Figure(
        "accuracy-sweeps",
        "accuracy",
        "Where each tier begins to err (rational arithmetic is the truth)",
        _sweep,
        rows=lambda row: row["part"] == "sweep",
        kept="accuracy-4-cores",
        panel=("queries", "sweep"),
        heading=lambda rows: f"{rows[0]['queries']} queries",
        size=(2, 4.6, 2.8),
        legend="first",
    ),
    Figure(
        "trade",
        "accuracy",
        "What each setting costs and how wrong it is",
        panels_trade.panel,
        rows=lambda row: row["part"] == "scene",
        kept="accuracy-trade-h200-16-cores",
        points=panels_trade.points,
        panel=("asked", "quantity"),
        heading=panels_trade.heading,
        size=(2, 4.6, 2.7),
        legend="right",
        right="center",
    ),
    Figure(
        "distance",
        "distance",
        "Distance queries, {accuracy}, {threads} threads",
        panels_distance.against_distance,
        kept="distance-2-cores",
        heading=panels_distance.heading,
        size=(3, 3.5, 3.0),
        legend="right",
    ),
    Figure(
        "accuracy-distance",
        "accuracy",
        "Where each tier errs in distance queries made to be hard",
        panels_distance.wrong_answers,
        rows=lambda row: row["part"] == "hard distance",
        panel=("query",),
        kept="accuracy-distance-2-cores",
        heading=panels_distance.queries,
        size=(3, 3.9, 1.7),
        legend="right",
    ),
    Figure(
        "limit",
        "limit",
        "Where the time goes; blue: the least that this machine needs for the same work",
        panels_limit.stages,
        rows=panels_limit.of_a_stage,
        kept="limit-2-cores",
        panel=("scene", "threads"),
        heading=panels_limit.heading,
        size=(2, 4.4, 2.1),
    ),
    Figure(
        "methods",
        "methods",
        "Methods and instruction sets, {accuracy}, {threads} threads",
        _variants,
        size=(3, 3.8, 2.8),
    ),
    Figure("options", "options", "What each option saves, {accuracy}, {threads} threads", _options, size=(3, 4.4, 2.9)),
    Figure("size", "size", "Time of a step against size, {accuracy}", _size, size=(3, 3.8, 3.0), legend="each"),
    Figure(
        "ros",
        "ros",
        "From publish to contacts: what the node adds to ROS",
        _latency,
        kept="ros-4-cores",
        rows=lambda row: row["what"] == "latency",
        heading=_latency_heading,
        size=(2, 4.6, 2.2),
        legend="right",
    ),
)


def draw(result, folder: Path) -> list[Path]:
    """Every picture that the result has rows for; the files."""
    mine = [figure for figure in FIGURES if figure.benchmark == result.benchmark]
    return [figure.save(result, folder) for figure in mine if figure.shown(result)]
