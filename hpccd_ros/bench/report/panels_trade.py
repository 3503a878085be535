# SPDX-License-Identifier: Apache-2.0
"""The trade between time and wrong answers: one point for each setting over all scenes, a speck for each scene.

Scenes become comparable by the time of the tier exact on the CPU, asked for all contacts: that is 1 on each. What is
asked makes a row of panels, all with the same axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from hpccd_ros.bench.report import drawing, pareto
from hpccd_ros.bench.report.drawing import BACKEND, TIER

# What is drawn upwards: its label, and the decade under which zero has its place.
QUANTITIES = {
    "wrong": ("wrong answers: share missed, invented", 1e-7),
    "error": ("worst error of times (step = 1)", 1e-19),
}
SETTING = ("accuracy", "backend", "asked")
ASKED = {
    "all": "all contacts",
    "first": "less: the earliest contact alone",
    "any": "less: any one contact",
    "vertex_face": "less: vertices against faces",
    "edge_edge": "less: edges against edges",
}


def points(rows: Sequence[dict]) -> list[dict]:
    """From rows of `hpccd bench accuracy` about scenes: for each quantity, setting and scene {"quantity", *SETTING,
    "scene", "x", "y"}, and with scene None the whole: the geometric mean of the times, the worst of the errors. In the
    order of the panels, with what the axes of all must hold."""
    found = []
    for mine in drawing.by(rows, "scene"):
        base = next((r["step_ms"] for r in mine if _setting(r) == ("exact", "cpu", "all")), None)
        if base is None:  # nothing to compare with
            continue
        for row in {_setting(r): r for r in reversed(mine)}.values():  # of several instruction sets the first
            of = dict(zip(SETTING, _setting(row), strict=True)) | {"scene": row["scene"], "x": row["step_ms"] / base}
            found += [of | {"quantity": "wrong", "y": _wrong(row)}, of | {"quantity": "error", "y": row["toc_worst"]}]
    whole = [
        mine[0]
        | {
            "scene": None,
            "x": math.exp(sum(math.log(p["x"]) for p in mine) / len(mine)),
            "y": max(p["y"] for p in mine),
        }
        for mine in drawing.by(found, "quantity", *SETTING)
    ]
    asked = list(dict.fromkeys(_setting(row)[2] for row in rows))
    every = sorted(found + whole, key=lambda p: (asked.index(p["asked"]), list(QUANTITIES).index(p["quantity"])))
    times = [p["x"] for p in every]
    return [
        p
        | {
            "x_range": (min(times), max(times)),
            "lowest": p["asked"] == every[-1]["asked"],
            "y_most": max(q["y"] for q in every if q["quantity"] == p["quantity"]),
        }
        for p in every
    ]


def _setting(row) -> tuple[str, str, str]:
    return row["accuracy"], row["backend"], row.get("asked", "all")


def _wrong(row) -> float:
    """Share of all that is true or reported. Results of before --ask tell of the reported contacts alone."""
    reported = row.get("reported", row["contacts"])
    true = row.get("true", reported + row["missed"] - row["invented"])
    return (row["missed"] + row["invented"]) / max(1, true + row["invented"])


def heading(rows: Sequence[dict]) -> str:
    return ASKED.get(rows[0]["asked"], f"less: {rows[0]['asked']}")


def panel(axis, rows: Sequence[dict]) -> dict:
    label, floor = QUANTITIES[rows[0]["quantity"]]
    specks, whole = ([r for r in rows if (r["scene"] is None) == of_all] for of_all in (False, True))
    for mine in (specks, whole):
        for p in mine:
            axis.plot(p["x"], _height(p, floor), **_style(p))
    _axes(axis, rows[0], label, floor)
    best = sorted(pareto.front(whole, lambda p: (p["x"], p["y"])), key=lambda p: p["x"])
    _front(axis, best, floor)
    low, high = axis.get_xlim()
    for p in best:
        left = p["x"] > low * (high / low) ** 0.3  # else words would stand on those of the axis
        axis.annotate(
            f"{p['accuracy']}, {p['backend']}",
            (p["x"], _height(p, floor)),
            textcoords="offset points",
            xytext=(-6 if left else 6, -9),
            ha="right" if left else "left",
            fontsize=6.5,
            color="#333333",
        )
    return _legend(whole)


def _front(axis, best, floor) -> None:
    """Steps down from the top and on to the right: no setting lies below and left of them."""
    x, y = [p["x"] for p in best], [_height(p, floor) for p in best]
    corners = [(x[0], axis.get_ylim()[1]), *zip(x, y, strict=True), (axis.get_xlim()[1], y[-1])]
    axis.plot(*zip(*corners, strict=True), color="black", linewidth=0.8, drawstyle="steps-post", zorder=1, gid="front")


def _height(p, floor) -> float:
    """Zero lies in a band of its own, with a row for each tier: else they would lie on one another."""
    return max(p["y"], 10 * floor) if p["y"] else floor * 10 ** (-0.5 * list(TIER).index(p["accuracy"]))


def _style(p) -> dict:
    size = {"markersize": 7, "zorder": 3} if p["scene"] is None else {"markersize": 2.5, "alpha": 0.4, "zorder": 2}
    return {"linestyle": "", "marker": BACKEND[p["backend"]], "color": TIER[p["accuracy"]], **size}


def _axes(axis, p, label, floor) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    band = floor * 10**-1.5  # the last row of zero
    most = max(p["y_most"], 1e-3)
    axis.set_ylim(band / 6, 10 * most)
    axis.axhline(3 * floor, color="#cccccc", linewidth=0.7)
    powers = range(math.ceil(math.log10(floor)) + 1, math.floor(math.log10(most)) + 2)
    shown = [10.0**k for k in powers if k % (2 if len(powers) < 9 else 4) == 0]
    axis.set_yticks([math.sqrt(floor * band), *shown], ["none", *(f"{y:.0e}".replace("e-0", "e-") for y in shown)])
    axis.yaxis.minorticks_off()
    low, high = p["x_range"]
    ticks = [m * 10.0**k for k in range(-4, 3) for m in (1, 2, 5) if low / 1.3 <= m * 10.0**k <= 1.3 * high]
    axis.set_xticks(ticks, [f"{x:g}" for x in ticks])
    axis.xaxis.minorticks_off()
    axis.set_xlim(low / 1.4, 1.4 * high)
    drawing.labels(axis, "time, over that of exact on the CPU for all contacts" if p["lowest"] else "", label)


def _legend(whole) -> dict:
    from matplotlib.lines import Line2D

    def mark(**style):
        return Line2D([], [], **{"linestyle": "", "marker": "o", "color": "grey", "markersize": 7} | style)

    tiers = {
        tier: mark(color=colour, marker="s")
        for tier, colour in TIER.items()
        if any(p["accuracy"] == tier for p in whole)
    }
    backends = {
        name: mark(marker=marker) for name, marker in BACKEND.items() if any(p["backend"] == name for p in whole)
    }
    line = Line2D([], [], color="black", linewidth=0.8)
    return tiers | backends | {"one scene": mark(markersize=2.5), "nothing cheaper\nis as good": line}
