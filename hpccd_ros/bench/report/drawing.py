# SPDX-License-Identifier: Apache-2.0
"""How a picture of a result is drawn: panels, bars and lines with one look."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.report import machine

# Okabe and Ito's colours, which people with any kind of colour vision tell apart.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, GREY = "#CC79A7", "#56B4E9", "#888888"
SERIES = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY, "#000000", "#A6761D")
MARKERS = "osD^vP*X"
# Of the core's tiers and backends.
TIER = {"fast": ORANGE, "balanced": SKY, "conservative": GREEN, "exact": BLUE}
BACKEND = {"cpu": "o", "hybrid": "D", "gpu": "^"}
_LEGEND_WIDTH = 1.4  # inches


@dataclasses.dataclass(frozen=True)
class Figure:
    """One picture of a result: a panel for each value of the keys `panel` of those `rows` that belong to it.

    name      of its file, without .png
    benchmark whose results it shows; kept: the one of hpccd_core/bench/results that docs/figures shows, if any
    title     may name keys of the first row in braces
    draw      fills a panel: (axis, rows) -> {label: artist} for the legend of the whole picture
    points    what is drawn of these rows, where it is not the rows themselves
    overview  fills a panel before the others with all rows
    heading   of a panel, from its rows
    legend    "first": in the first panel (behind an overview in that too); "each"; "right": of the whole picture
    """

    name: str
    benchmark: str
    title: str
    draw: Callable[..., dict | None]
    rows: Callable[[dict], bool] = lambda row: True
    kept: str | None = None
    points: Callable[[list[dict]], list[dict]] = lambda rows: rows
    panel: tuple[str, ...] = ("scene",)
    overview: Callable | None = None
    heading: Callable[[list[dict]], str] = lambda rows: rows[0]["scene"]
    size: tuple[int, float, float] = (4, 3.6, 3.2)  # panels in a row at most, inches of one
    legend: str | None = None
    right: str = "upper"  # end of the side at which the legend of the whole picture stands

    def shown(self, result) -> list[dict]:
        return self.points([row for row in result.rows if self.rows(row)])

    def compose(self, result):
        """The picture of a result (`machine`, `rows`) as a matplotlib figure, or None where it has no such rows."""
        rows = self.shown(result)
        if not rows:
            return None
        groups = by(rows, *self.panel)
        page, axes = _page(len(groups) + bool(self.overview), *self.size)
        narrow = self.legend == "right" and len(axes) == 1  # the title would stand above the legend too, or on it
        if narrow:
            page.set_figwidth(page.get_figwidth() + _LEGEND_WIDTH)
        if self.overview:
            self.overview(axes[0], rows)
        handles: dict = {}
        for mine, axis in zip(groups, axes[bool(self.overview) :], strict=True):
            axis.set_title(self.heading(mine), fontsize=9)
            handles |= self.draw(axis, mine) or {}
        with_legend = {"each": len(axes), "first": 1 + bool(self.overview)}.get(self.legend, 0)
        for axis in axes[:with_legend]:
            axis.legend(fontsize=7, frameon=False, handlelength=4)  # so long that dashes show
        if self.legend == "right":
            place = f"outside right {'center' if narrow else self.right}"
            page.legend(handles.values(), handles, loc=place, fontsize=8, frameon=False)
        page.suptitle(self.title.format_map(rows[0]), fontsize=11, fontweight="bold")
        page.supxlabel(machine.short(result.machine), fontsize=6.5, color="#666666")
        return page

    def save(self, result, folder: Path) -> Path:
        """Write the picture; UserError where the result has no rows for it."""
        page = self.compose(result)
        if page is None:
            raise UserError(f"{self.name}.png: this result has no rows for it; see the options of the benchmark")
        folder.mkdir(parents=True, exist_ok=True)
        page.savefig(folder / f"{self.name}.png", dpi=150)
        return folder / f"{self.name}.png"


def by(rows: Iterable[dict], *keys: str) -> list[list[dict]]:
    """Rows in groups of equal values of `keys`, in the order in which these first appear."""
    groups: dict[tuple, list[dict]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return list(groups.values())


def bars(axis, rows: Sequence[dict], label: str, parts: Callable, said: Callable, room: float) -> dict:
    """A bar for each row, of `parts(row)`: {name: (value, colour)}, with `said(row, length)` behind it.

    room: how much longer than the longest bar the axis is, for the words. Returns one piece of each name.
    """
    pieces, longest = {}, 0.0
    for place, row in enumerate(rows):
        left = 0.0
        for name, (value, colour) in parts(row).items():
            pieces[name] = axis.barh(place, value, left=left, color=colour, height=0.7)
            left += value
        axis.text(left, place, said(row, left), va="center", fontsize=7)
        longest = max(longest, left)
    axis.set_yticks(range(len(rows)), [row[label] for row in rows], fontsize=7.5)
    axis.invert_yaxis()
    axis.grid(False, axis="y")
    axis.set_xlim(0, room * longest or 1)
    axis.set_xlabel("ms a step", fontsize=8)
    return pieces


def line(axis, rows: Sequence[dict], x: str, y: str, **style):
    """y over x of the rows, by rising x; the line."""
    found = sorted(rows, key=lambda row: row[x])
    style = {"markersize": 4.5, "linewidth": 1.5} | style
    return axis.plot([row[x] for row in found], [row[y] for row in found], **style)[0]


def labels(axis, x: str, y: str) -> None:
    axis.set_xlabel(x, fontsize=8)
    axis.set_ylabel(y, fontsize=8)


def whole_number_axis(axis, values: Iterable) -> None:
    """Ticks at exactly these values of x, as plain numbers."""
    values = sorted(set(values))
    axis.set_xticks(values, [f"{v:,g}" if v < 1e6 else f"{v:,}" for v in values])
    axis.minorticks_off()


def _page(count: int, columns: int, width: float, height: float):
    """A matplotlib figure with `count` panels in rows of at most `columns`, and these as a list."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Page

    columns = min(columns, count)
    rows = math.ceil(count / columns)
    page = Page(figsize=(width * columns + 0.4, height * rows + 0.6), layout="constrained")
    FigureCanvasAgg(page)
    axes = list(page.subplots(rows, columns, squeeze=False).flat)
    for axis in axes[count:]:
        axis.set_axis_off()
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(True, color="#e6e6e6", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.tick_params(labelsize=8)
    return page, axes[:count]
