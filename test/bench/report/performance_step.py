# SPDX-License-Identifier: Apache-2.0
"""Table of docs/performance.md about how far a step may go."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept, by
from hpccd_ros.bench.report import text


def steps(result: Kept) -> list[str]:
    """A line for each scene: all contacts, and what part of it the other questions take."""
    lines = []
    beside_peer = any("ipctk_ms" in row for row in result.rows)
    for mine in by(result.rows, "scene"):
        of = {row["query"]: row for row in mine}
        every = of["all"]
        lines.append(
            [
                mine[0]["scene"],
                round(every["contacts"]),
                f"{every['earliest']:.4g}",
                every["step_ms"],
                *(
                    f"{text(of[query]['step_ms'])} ({of[query]['over_all']:.2f})"
                    for query in ("first", "step", "trial")
                ),
                text(of["trial"].get("listing_ms")),
                *([f"{of['step']['times_faster_than_ipctk']:,.0f}"] if beside_peer else []),
            ]
        )
    columns = [
        "scene",
        "contacts",
        "earliest at",
        "all, ms",
        "first, ms (/ all)",
        "`collision_free_step`, ms (/ all)",
        "trial steps, ms (/ all)",
        "listing, ms",
        *(["step x ipctk"] if beside_peer else []),
    ]
    return markdown.table(columns, lines)
