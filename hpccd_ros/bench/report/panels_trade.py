# SPDX-License-Identifier: Apache-2.0
"""The trade between time and wrong answers: one point for each setting over all scenes, a speck for each scene.

Scenes become comparable by the time of the tier exact on the CPU, asked for all contacts: that is 1 on each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from hpccd_ros.bench.report import drawing, pareto
from hpccd_ros.bench.report.drawing import BACKEND, TIER

# What is drawn upwards: its label, and the decade under which zero has its place.
QUANTITIES = {
    "wrong": ("wrong answers: share missed and invented", 1e-7),
    "error": ("worst error of the times of contact (step = 1)", 1e-19),
}
SETTING = ("accuracy", "backend", "asked")


def points(rows: Sequence[dict]) -> list[dict]:
    """From rows of `hpccd bench accuracy` about scenes: for each quantity, setting and scene {"quantity", *SETTING,
    "scene", "x", "y"}, and with scene None the whole: the geometric mean of the times, the worst of the errors."""
    found = []
    for mine in drawing.by(rows, "scene"):
        base = next((r["step_ms"] for r in mine if _setting(r) == ("exact", "cpu", "all")), None)
        if base is None:  # nothing to compare with
            continue
        for (row, *_) in _groups(mine):  # of several instruction sets the first
            of = dict(zip(SETTING, _setting(row), strict=True)) | {"scene": row["scene"], "x": row["step_ms"] / base}
            found += [of | {"quantity": "wrong", "y": _wrong(row)}, of | {"quantity": "error", "y": row["toc_worst"]}]
    whole = [
        mine[0] | {"scene": None, "x": math.exp(sum(math.log(p["x"]) for p in mine) / len(mine)),
                   "y": max(p["y"] for p in mine)}
        for mine in drawing.by(found, "quantity", *SETTING)
    ]  # fmt: skip
    return sorted(found + whole, key=lambda p: list(QUANTITIES).index(p["quantity"]))


def _setting(row) -> tuple[str, str, str]:
    return row["accuracy"], row["backend"], row.get("asked", "all")


def _groups(rows):
    groups: dict = {}
    for row in rows:
        groups.setdefault(_setting(row), []).append(row)
    return groups.values()


def _wrong(row) -> float:
    """Share of all that is true or reported. Results of before --ask tell of the reported contacts alone."""
    reported = row.get("reported", row["contacts"])
    true = row.get("true", reported + row["missed"] - row["invented"])
    return (row["missed"] + row["invented"]) / max(1, true + row["invented"])


def heading(rows: Sequence[dict]) -> str:
    return {"wrong": "time against wrong answers", "error": "time against the error of times"}[rows[0]["quantity"]]


def panel(axis, rows: Sequence[dict]) -> dict:
    label, floor = QUANTITIES[rows[0]["quantity"]]
    specks, whole = ([r for r in rows if (r["scene"] is None) == of_all] for of_all in (False, True))
    for mine in (specks, whole):
        for p in mine:
            axis.plot(p["x"], _height(p, floor), **_style(p))
    every = [p for p in whole if p["asked"] == "all"]
    best = sorted(pareto.front(every, lambda p: (p["x"], p["y"])), key=lambda p: p["x"])
    for p in best:
        _name(axis, p, floor, f"{p['accuracy']}, {p['backend']}", {"xytext": (-6, -9), "ha": "right"})
    less = [p for p in whole if p["asked"] != "all"]
    for place, mine in enumerate(drawing.by(less, "asked")):  # beside the lowest point of each backend
        side = {"xytext": (6, -2), "ha": "left"} if place % 2 else {"xytext": (-6, -2), "ha": "right"}
        for points_there in drawing.by(mine, "backend"):
            _name(axis, min(points_there, key=lambda p: _height(p, floor)), floor, mine[0]["asked"], side)
    _axes(axis, rows, label, floor)
    _front(axis, best, floor)
    return _legend(whole)


def _front(axis, best, floor) -> None:
    """Steps down from the top and on to the right: no setting lies below and left of them."""
    x, y = [p["x"] for p in best], [_height(p, floor) for p in best]
    corners = [(x[0], axis.get_ylim()[1]), *zip(x, y, strict=True), (axis.get_xlim()[1], y[-1])]
    axis.plot(*zip(*corners, strict=True), color="black", linewidth=0.8, drawstyle="steps-post", zorder=1, gid="front")


def _height(p, floor) -> float:
    """Zero lies in a band of its own, with a row for each tier: else they would lie on one another."""
    return max(p["y"], 10 * floor) if p["y"] else floor * 10 ** (-0.4 * list(TIER).index(p["accuracy"]))


def _style(p) -> dict:
    whole = p["scene"] is None
    return {
        "linestyle": "", "marker": BACKEND[p["backend"]], "color": TIER[p["accuracy"]],
        "markersize": 7 if whole else 2.5, "alpha": 1 if whole else 0.35, "zorder": 3 if whole else 2,
        "fillstyle": "full" if p["asked"] == "all" else "none",
    }  # fmt: skip


def _name(axis, p, floor, text, place) -> None:
    axis.annotate(text, (p["x"], _height(p, floor)), textcoords="offset points", fontsize=6.5, color="#333333", **place)


def _axes(axis, rows, label, floor) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    band = floor * 10**-1.2  # the last row of zero
    most = max([p["y"] for p in rows] + [1e-3])
    axis.set_ylim(band / 6, 10 * most)
    axis.axhline(3 * floor, color="#cccccc", linewidth=0.7)
    powers = range(math.ceil(math.log10(floor)) + 1, math.floor(math.log10(most)) + 2)
    shown = [10.0**k for k in powers if len(powers) < 9 or k % 4 == 0]
    axis.set_yticks([math.sqrt(floor * band), *shown], ["none", *(f"{y:.0e}".replace("e-0", "e-") for y in shown)])
    axis.yaxis.minorticks_off()
    lowest, highest = min(p["x"] for p in rows), max(p["x"] for p in rows)
    ticks = [m * 10.0**k for k in range(-4, 3) for m in (1, 2, 5) if lowest / 1.3 <= m * 10.0**k <= 1.3 * highest]
    axis.set_xticks(ticks, [f"{x:g}" for x in ticks])
    axis.xaxis.minorticks_off()
    axis.set_xlim(lowest / 1.4, 1.4 * highest)
    drawing.labels(axis, "time, over that of exact on the CPU for all contacts", label)


def _legend(whole) -> dict:
    from matplotlib.lines import Line2D

    def mark(**style):
        return Line2D([], [], **{"linestyle": "", "marker": "o", "color": "grey", "markersize": 7} | style)

    tiers = {tier: mark(color=colour, marker="s") for tier, colour in TIER.items()
             if any(p["accuracy"] == tier for p in whole)}  # fmt: skip
    backends = {name: mark(marker=marker) for name, marker in BACKEND.items()
                if any(p["backend"] == name for p in whole)}  # fmt: skip
    others = {"one scene": mark(markersize=2.5, alpha=0.5)}
    if any(p["asked"] != "all" for p in whole):
        others["asks for less"] = mark(fillstyle="none")
    others["nothing cheaper\nis as good"] = Line2D([], [], color="black", linewidth=0.8)
    return tiers | backends | others
