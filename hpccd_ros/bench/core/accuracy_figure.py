# SPDX-License-Identifier: Apache-2.0
"""The trade in pictures: time against error of each tier, and the sweeps of scale and offset."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing

BACKEND = {"cpu": "o", "hybrid": "D", "gpu": "^"}
# Where an error of exactly zero is drawn on a logarithmic axis.
TOC_FLOOR, SHARE_FLOOR = 1e-17, 1e-5


def draw_scenes(report, path) -> None:
    """ms a step to the right, error of the times of contact upwards; wrong contacts in words. To the left and below
    is better."""
    rows = [row for row in report.rows if row["part"] == "scene"]
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure, axes = drawing.panels(len(scenes), columns=3, width=3.9, height=3.2)
    for scene, axis in zip(scenes, axes, strict=True):
        mine = [row for row in rows if row["scene"] == scene]
        for row in mine:
            y = max(row["toc_worst"], TOC_FLOOR)
            axis.plot(row["step_ms"], y, **_style(row["accuracy"], row["backend"], row["simd"]))
            if row["missed"] + row["invented"]:
                axis.annotate(f"{row['missed']} missed, {row['invented']} invented", (row["step_ms"], y),
                              textcoords="offset points", xytext=(7, -2), fontsize=7)  # fmt: skip
        axis.set_yscale("log")
        axis.set_ylim(TOC_FLOOR / 5, 1)
        axis.set_yticks([TOC_FLOOR, 1e-12, 1e-8, 1e-4, 1], ["exact", "1e-12", "1e-8", "1e-4", "1"])
        axis.set_xlim(0, 1.25 * max(row["step_ms"] for row in mine))
        axis.set_xlabel("ms a step", fontsize=8)
        axis.set_ylabel("worst error of toc (step = 1)", fontsize=8)
        axis.set_title(f"{scene}, {mine[0]['contacts']:,.0f} contacts", fontsize=9)
    figure.legend(handles=list(_legend(rows)), loc="outside right center", fontsize=8, frameon=False)
    threads = rows[0]["threads"]
    drawing.save(figure, path, report, f"What each tier costs and how far its times are off, {threads} threads")


def _style(tier: str, backend: str, simd: str) -> dict:
    return {"linestyle": "", "marker": BACKEND[backend], "color": drawing.TIER[tier], "markersize": 8,
            "fillstyle": "none" if simd == "scalar" else "full"}  # fmt: skip


def _legend(rows):
    """Each colour once, then what else markers tell apart."""
    from matplotlib.lines import Line2D

    def entry(label, tier="exact", backend="cpu", simd="auto", **other):
        return Line2D([], [], label=label, **_style(tier, backend, simd) | other)

    yield from (entry(tier, tier) for tier in dict.fromkeys(row["accuracy"] for row in rows))
    if len({row["simd"] for row in rows}) > 1:
        yield entry("scalar code", simd="scalar", color="grey")
    if len(backends := dict.fromkeys(row["backend"] for row in rows)) > 1:
        yield from (entry(backend, backend=backend, color="grey") for backend in backends)


def draw_sweeps(report, path) -> None:
    """Share of wrong answers against scale and offset, for ordinary and degenerate queries."""
    rows = [row for row in report.rows if row["part"] == "sweep"]
    tiers = list(dict.fromkeys(row["accuracy"] for row in rows))
    figure, axes = drawing.panels(4, columns=2, width=4.6, height=2.8)
    panels = [(name, family) for family in ("ordinary", "degenerate") for name in ("scale", "offset")]
    for (name, family), axis in zip(panels, axes, strict=True):
        for place, tier in enumerate(tiers):
            mine = [r for r in rows if (r["sweep"], r["queries"], r["accuracy"]) == (name, family, tier)]
            # An offset of zero is drawn one decade below the first.
            x = [r["at"] or 0.1 for r in mine]
            axis.plot(x, [max(r["wrong_share"], SHARE_FLOOR) for r in mine], marker=drawing.MARKERS[place],
                      color=drawing.TIER[tier], markersize=9 - 2 * place, linewidth=1.3, label=tier)  # fmt: skip
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_ylim(SHARE_FLOOR / 2, 1)
        axis.set_yticks([SHARE_FLOOR, 1e-4, 1e-2, 1], ["none", "0.01 %", "1 %", "100 %"])
        axis.set_xlabel("scale" if name == "scale" else "distance from the origin, sizes of the features", fontsize=8)
        axis.set_ylabel("wrong answers", fontsize=8)
        axis.set_title(f"{family} queries", fontsize=9)
    axes[0].legend(fontsize=7.5, frameon=False)
    drawing.save(figure, path, report, "Where each tier begins to err (rational arithmetic is the truth)")
