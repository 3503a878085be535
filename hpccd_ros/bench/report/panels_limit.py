# SPDX-License-Identifier: Apache-2.0
"""The picture of `hpccd bench limit`."""

from __future__ import annotations

from hpccd_ros.bench.report import drawing, table
from hpccd_ros.bench.report.drawing import BLUE


def of_a_stage(row: dict) -> bool:
    return row["part"] == "stage" and row["stage"] not in ("rest", "step")


def stages(axis, rows) -> None:
    """A bar for each stage: of its time the part that this machine needs at least, and the rest."""

    def parts(row):
        least = min(row["ms"], row["least_ms"])
        return {"least": (least, BLUE), "more": (row["ms"] - least, "#d0d0d0")}

    def said(row, ms):
        times = f", {row['over_least']:.3g} x" if row["over_least"] is not None else ""  # nothing was to be done
        return f" {table.text(ms)} ms{times}"

    drawing.bars(axis, rows, "stage", parts, said, room=1.45)


def heading(rows) -> str:
    n = rows[0]["threads"]
    ms, least = (table.text(sum(row[key] for row in rows)) for key in ("ms", "least_ms"))
    return f"{rows[0]['scene']}, {n} thread{'s' * (n > 1)}: {ms} ms, at least {least}"
