# SPDX-License-Identifier: Apache-2.0
"""The picture of `hpccd bench limit`."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing, table
from hpccd_ros.bench.report.drawing import BLUE


def stages(axis, rows) -> dict:
    """A bar for each stage: of its time the part that this machine needs at least, and the rest."""

    def parts(row):
        least = min(row["ms"], row["least_ms"])
        return {"the least that the machine needs": (least, BLUE), "more than that": (row["ms"] - least, "#d0d0d0")}

    def said(row, ms):
        return f" {table.text(ms)} ms, {row['over_least']:.3g} x"

    return drawing.bars(axis, rows, "stage", parts, said, room=1.5)


def heading(rows) -> str:
    n = rows[0]["threads"]
    return f"{rows[0]['scene']}, {n} thread{'s' * (n > 1)}"
