# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about distance queries."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept, by
from hpccd_ros.bench.report import text


def by_distance(result: Kept) -> list[str]:
    """Separation and proximity, a line for each scene and distance."""
    lines = []
    for mine in by(result.rows, "scene"):
        plain = next(r for r in mine if r["query"] == "plain")
        of = {(r["query"], r["distance"]): r for r in mine}
        for d in sorted({r["distance"] for r in mine if r["distance"] is not None}):
            lines.append(
                [
                    plain["scene"],
                    f"{d:g}",
                    round(plain["pairs"]),
                    plain["step_ms"],
                    *(cell for query in ("separation", "proximity") for cell in _cells(of.get((query, d)))),
                ]
            )
    columns = [
        "scene",
        "d",
        "contacts",
        "plain, ms",
        "separation: pairs",
        "ms (/ plain)",
        "us a pair more",
        "x ipctk",
        "proximity: pairs",
        "ms (/ plain)",
        "us a pair more",
        "x ipctk",
    ]
    return markdown.table(columns, lines)


def of_a_snapshot(result: Kept) -> list[str]:
    """Intersections and smallest distances, a line for each scene."""
    lines = []
    for mine in by(result.rows, "scene"):
        of = {r["query"]: r for r in mine if r["distance"] is None}
        pairs, ms, _, faster = _cells(of.get("intersections"))
        lines.append([mine[0]["scene"], of["plain"]["step_ms"], pairs, ms, faster, *_cells(of.get("distances"))[:2]])
    columns = [
        "scene",
        "plain, ms",
        "intersections",
        "ms (/ plain)",
        "x ipctk",
        "pairs of meshes",
        "smallest distances: ms (/ plain)",
    ]
    return markdown.table(columns, lines)


def on_scenes(result: Kept) -> list[str]:
    """Missed and invented pairs, and the worst error of a value, of each tier."""
    rows = [r for r in result.rows if r["part"] == "distance" and r["simd"] == "auto"]

    def cell(row):
        worst = f", {row['value_worst']:.0e}" if row["value_worst"] else ""
        return f"{row['missed']} + {row['invented']}{worst}"

    lines = [
        [
            mine[0]["scene"],
            mine[0]["query"],
            "" if mine[0]["distance"] is None else f"{mine[0]['distance']:.5g}",
            mine[0]["true"],
            *map(cell, mine),
        ]
        for mine in by(rows, "scene", "query", "distance")
    ]
    tiers = [f"`{r['accuracy']}`" for r in by(rows, "scene", "query", "distance")[0]]
    return markdown.table(["missed + invented", "query", "d", "pairs", *tiers], lines)


def hard_queries(result: Kept) -> list[str]:
    rows = [r for r in result.rows if r["part"] == "hard distance"]
    tiers = list(dict.fromkeys(r["accuracy"] for r in rows))
    lines = []
    for mine in by(rows, "query"):
        by_tier = by(mine, "accuracy")
        wrong = (" + ".join(f"{sum(r[key] for r in of_one):,}" for key in ("missed", "invented")) for of_one in by_tier)
        lines.append([mine[0]["query"], sum(r["n"] for r in by_tier[0]), *wrong])
    return markdown.table(["missed + invented", "queries", *(f"`{tier}`" for tier in tiers)], lines)


def _cells(row: dict | None) -> list:
    """Pairs, ms with the times of plain, us a pair more, times faster than the peer; empty where not measured."""
    if row is None:
        return [None] * 4
    more, faster = row.get("us_a_pair_beyond"), row.get("times_faster_than_ipctk")
    return [
        round(row["pairs"]),
        f"{text(row['step_ms'])} ({row['over_plain']:.2f})",
        None if more is None else f"{more:.2f}",
        None if faster is None else f"{faster:.0f}",
    ]
