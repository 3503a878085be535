# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about distance queries."""

from __future__ import annotations

from hpccd_ros.bench.report import markdown
from hpccd_ros.bench.report.drawing import by
from hpccd_ros.bench.report.results import Kept
from hpccd_ros.bench.report.table import text


def by_distance(result: Kept) -> list[str]:
    """Separation and proximity, a line for each scene and distance."""
    lines = []
    for mine in by(result.rows, "scene"):
        plain = next(r for r in mine if r["query"] == "plain")
        of = {(r["query"], r["distance"]): r for r in mine}
        for d in sorted({r["distance"] for r in mine if r["distance"] is not None}):
            lines.append([plain["scene"], f"{d:g}", round(plain["pairs"]), plain["step_ms"],
                          *(cell for query in ("separation", "proximity") for cell in _cells(of.get((query, d))))])
    columns = ["scene", "d", "contacts", "plain, ms", "separation: pairs", "ms (/ plain)", "us a pair more", "x ipctk",
               "proximity: pairs", "ms (/ plain)", "us a pair more", "x ipctk"]  # fmt: skip
    return markdown.table(columns, lines)


def of_a_snapshot(result: Kept) -> list[str]:
    """Intersections and smallest distances, a line for each scene."""
    lines = []
    for mine in by(result.rows, "scene"):
        of = {r["query"]: r for r in mine if r["distance"] is None}
        pairs, ms, _, faster = _cells(of.get("intersections"))
        lines.append([mine[0]["scene"], of["plain"]["step_ms"], pairs, ms, faster, *_cells(of.get("distances"))[:2]])
    columns = ["scene", "plain, ms", "intersections", "ms (/ plain)", "x ipctk", "pairs of meshes",
               "smallest distances: ms (/ plain)"]  # fmt: skip
    return markdown.table(columns, lines)


def _cells(row: dict | None) -> list:
    """Pairs, ms with the times of plain, us a pair more, times faster than the peer; empty where not measured."""
    if row is None:
        return [None] * 4
    more, faster = row.get("us_a_pair_beyond"), row.get("times_faster_than_ipctk")
    return [round(row["pairs"]), f"{text(row['step_ms'])} ({row['over_plain']:.2f})",
            None if more is None else f"{more:.2f}", None if faster is None else f"{faster:.0f}"]  # fmt: skip
