# SPDX-License-Identifier: Apache-2.0
"""The common look of the figures."""

from __future__ import annotations

import math
from pathlib import Path

from hpccd_ros.bench.report import machine

# Okabe and Ito's colours, which people with any kind of colour vision tell apart.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, YELLOW, GREY = "#CC79A7", "#56B4E9", "#F0E442", "#888888"
SERIES = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY, "#000000", "#A6761D")
MARKERS = "osD^vP*X"

METHOD = {"default": BLUE, "published": GREEN, "naive": RED, "front": PURPLE, "independent": GREY}
TIER = {"fast": ORANGE, "balanced": SKY, "conservative": GREEN, "exact": BLUE}
# Stages in the order in which they run; the paper's four components (section 6.2) have four families of colour.
STAGE = {
    "bounds": "#9ecae1", "refit": "#4292c6", "build": "#08519c",
    "traverse": GREEN, "elementary": ORANGE, "contacts": PURPLE, "other": GREY, "outside": "#cccccc",
    "broad": "#c7e9c0", "narrow": "#fdd49e",
}  # fmt: skip


def panels(count: int, columns: int = 4, width: float = 3.6, height: float = 3.2):
    """A figure with `count` panels in rows of at most `columns`: (figure, list of axes)."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = min(columns, count)
    rows = math.ceil(count / columns)
    figure, axes = pyplot.subplots(
        rows, columns, figsize=(width * columns + 0.4, height * rows + 0.6), squeeze=False, layout="constrained"
    )
    flat = list(axes.flat)
    for axis in flat[count:]:
        axis.set_axis_off()
    for axis in flat:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(True, color="#e6e6e6", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.tick_params(labelsize=8)
        axis.title.set_fontsize(10)
    return figure, flat[:count]


def save(figure, path: Path, report, title: str) -> None:
    """Write the figure with its title and, small, where its numbers come from."""
    from matplotlib import pyplot

    figure.suptitle(title, fontsize=11, fontweight="bold")
    figure.supxlabel(machine.short(report.machine), fontsize=6.5, color="#666666")
    figure.savefig(path, dpi=150)
    pyplot.close(figure)


def whole_number_axis(axis, values) -> None:
    """Ticks at exactly these values of x, as plain numbers."""
    axis.set_xticks(list(values), [f"{v:g}" for v in values])
    axis.minorticks_off()
