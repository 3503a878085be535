# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about the least time that a machine needs."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept, by
from hpccd_ros.bench.report import text


def stages(result: Kept) -> list[str]:
    """A line for each stage, as on one thread the farthest from its least first, with three columns for each number of
    threads."""
    rows = [r for r in result.rows if r["part"] == "stage"]
    threads = sorted({r["threads"] for r in rows})

    def cells(row):
        if row is None:  # there told with another stage
            return [None] * 3
        least = row.get("least_ms")
        return [row["ms"], least, f"{row['over_least']:.1f}" if least else None]

    lines = []
    for mine in by(rows, "scene"):
        of = {(r["threads"], r["stage"]): r for r in mine}
        for row in (r for r in mine if r["threads"] == threads[0]):
            limits = row.get("limited_by", "")
            lines.append(
                [
                    f"{row['scene']}: {row['stage']}",
                    limits,
                    *(cell for n in threads for cell in cells(of.get((n, row["stage"])))),
                ]
            )
    heads = (f"{n} thread{'s' * (n > 1)}: ms" for n in threads)
    columns = ["scene: stage", "limited by", *(head for first in heads for head in (first, "least", "times"))]
    return markdown.table(columns, lines)


def rates(result: Kept) -> list[str]:
    """Of the machine, 10^9 a second; what is read and copied by how much data."""
    rows = [r for r in result.rows if r["part"] == "rate"]
    threads = sorted({r["threads"] for r in rows})
    of = {(r["rate"], r["bytes"], r["threads"]): text(r["per_second"] / 1e9) for r in rows}

    def name(rate, size):
        return f"{rate}, {text(size / 1024)} KB" if size else rate

    kinds = sorted({(r["rate"], r["bytes"]) for r in rows if not r["bytes"] or r["bytes"] >= 1 << 19})
    lines = [[name(*kind), *(of.get((*kind, n), "") for n in threads)] for kind in kinds]
    return markdown.table(["10^9 a second", *(f"{n} thread{'s' * (n > 1)}" for n in threads)], lines)
