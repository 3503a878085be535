# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about meshes that move by poses and joints."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept
from hpccd_ros.bench.report import text

FEATURES = {"vf": "vertex-face", "ee": "edge-edge"}


def truth(result: Kept) -> list[str]:
    """A line for each kind of motion and of features."""
    rows = [row for row in result.rows if row["part"] == "truth"]
    lines = [
        [
            row["motion"],
            FEATURES[row["kind"]],
            *(row[name] for name in ("queries", "touching", "reported", "missed", "late", "beyond", "open", "excess")),
            f"{row['worst_excess']:.3f}",
            f"{row['us_a_query']:.0f}",
        ]
        for row in rows
    ]
    columns = [
        "motion",
        "features",
        "queries",
        "come that near",
        "reported",
        "missed",
        "late",
        "beyond twice the bound",
        "not proven",
        "in excess",
        "worst, of the bound",
        "us a query",
    ]
    return markdown.table(columns, lines)


def bounds(result: Kept) -> list[str]:
    """A line for each kind of motion, a column for each turn."""
    rows = [row for row in result.rows if row["part"] == "bounds"]
    turns = list(dict.fromkeys(row["turn"] for row in rows))
    lines = []
    for motion in dict.fromkeys(row["motion"] for row in rows):
        of = {row["turn"]: row for row in rows if row["motion"] == motion}
        lines.append([motion, *(_spread(of[t]) for t in turns)])
    return markdown.table(["true deviation / bound", *(f"{turn:g} rad" for turn in turns)], lines)


def cost(result: Kept) -> list[str]:
    """A line for each scene, turn and tolerance."""
    rows = [row for row in result.rows if row["part"] == "cost"]
    lines = [
        [
            row["scene"],
            row["triangles"],
            f"{row['turn']:g}",
            f"{row['tolerance']:g}",
            row["parts"],
            f"{row['bound']:.1e}",
            text(row["least_linear_ms"]),
            f"{text(row['least_moved_ms'])}",
            f"{row['least_over_linear']:.2f}",
            text(row["least_outside_ms"]),
            row["linear_contacts"],
            row["contacts"],
        ]
        for row in rows
    ]
    columns = [
        "scene",
        "triangles",
        "turn, degrees",
        "tolerance",
        "parts",
        "bound",
        "straight, ms",
        "moved, ms",
        "/ straight",
        "of it outside the core",
        "contacts, straight",
        "moved",
    ]
    return markdown.table(columns, lines)


def _spread(row: dict) -> str:
    return f"{row['median']:.2f} ({row['low']:.2f} to {row['largest']:.3f})"


def stream(*results: Kept) -> list[str]:
    """A line for each round of a robot beside a cloth over DDS."""
    lines = [
        [
            result.machine["cores"],
            row["backend"],
            f"{row['rate_hz']:g}",
            row["answers"],
            row["dropped"],
            f"{row['answers_hz']:.1f}",
            *(
                f"{text(row[f'{part}_median_ms'])} / {text(row[f'{part}_p95_ms'])}"
                for part in ("whole", "detection", "core", "around", "added")
            ),
        ]
        for result in results
        for row in result.rows
    ]
    columns = [
        "cores",
        "core on",
        "frames a second",
        "answers",
        "dropped",
        "answers a second",
        "sent to answer, ms: median / p95",
        "of it detection",
        "of it core",
        "all but the detection",
        "all but the core",
    ]
    return markdown.table(columns, lines)
