# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about the topic stop."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept

_SILENT = {
    "silence": "no frame any more; from the last one",
    "publisher killed": "mesh publisher killed (SIGKILL)",
    "publisher held up": "mesh publisher held up (SIGSTOP)",
    "node killed": "node killed (SIGKILL)",
    "node held up": "node held up (SIGSTOP)",
}


def approaches(result: Kept) -> list[str]:
    (row,) = (r for r in result.rows if r["what"] == "approaches")
    counts = {
        "random approaches": row["trials"],
        "steps, each judged by brute force": row["steps"],
        "steps that come near": row["near"],
        "of these without stop": row["missed"],
        "rises of stop": row["rises"],
        "of these later than a frame": row["late"],
        "steps that do not come near, with stop": row["false"],
        "ms from the frame to stop: median, p95, p99, most": ", ".join(
            f"{row[f'{key}_ms']:.1f}" for key in ("median", "p95", "p99", "most")
        ),
        "ms of a frame": f"{row['frame_ms']:.0f}",
    }
    return markdown.table(["what", "count"], [[what, count] for what, count in counts.items()])


def silences(result: Kept) -> list[str]:
    lines = [
        [_SILENT[r["what"]], r["trials"], *(f"{r[f'{key}_ms']:.0f}" for key in ("median", "p95", "most", "timeout"))]
        for r in result.rows
        if r["what"] in _SILENT
    ]
    return markdown.table(["what ended", "trials", "ms until stop: median", "p95", "most", "`stop_timeout`, ms"], lines)


def costs(result: Kept) -> list[str]:
    lines = [
        [r["scene"], r["triangles"], f"{r['near']} of {r['steps']}", r["look_ms"], r["contacts_ms"], r["distances_ms"]]
        for r in result.rows
        if r["what"] == "cost"
    ]
    columns = ["scene", "triangles", "steps that come near", "stop, ms", "all contacts, ms", "smallest distances, ms"]
    return markdown.table(columns, lines)
