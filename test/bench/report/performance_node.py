# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about the node over DDS."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept

PERCENTILES = ("median", "p95", "p99")


def latency(result: Kept) -> list[str]:
    lines = [
        [
            r["scene"],
            f"{r['mb_in']:.2g}, {r['mb_out']:.2g}",
            r["contacts"],
            r["core_median_ms"],
            *(", ".join(f"{r[f'{who}_{key}_ms']:.1f}" for key in PERCENTILES) for who in ("node", "echo")),
            f"{r['ratio']:.2f}",
        ]
        for r in result.rows
        if r["what"] == "latency"
    ]
    columns = [
        "scene",
        "MB in, out",
        "contacts",
        "core, ms",
        "node without its core, ms: median, p95, p99",
        "echo, ms: median, p95, p99",
        "node / echo",
    ]
    return markdown.table(columns, lines)


def step_loop(result: Kept) -> list[str]:
    lines = [
        [
            r["scene"],
            r["triangles"],
            f"{r['mb_sent']:.2g}",
            *(", ".join(f"{r[f'{who}_{key}_ms']:.2f}" for key in PERCENTILES) for who in ("loop", "core", "more")),
        ]
        for r in result.rows
        if r["what"] == "step loop"
    ]
    columns = [
        "scene",
        "triangles",
        "MB sent",
        "asked over DDS, ms: median, p95, p99",
        "the same call in process, ms: median, p95, p99",
        "DDS more, ms: median, p95, p99",
    ]
    return markdown.table(columns, lines)


def rates(result: Kept) -> list[str]:
    names = {"sustained rate": "highest rate without drops", "twice that rate": "twice that"}
    lines = [
        [
            f"{r['scene']}, {names[r['what']]}",
            f"{r['rate_hz']:.0f}",
            f"{r['sent']:,} = {r['answered']:,} + {r['dropped'] + r['middleware']:,}",
            f"{r['median_ms']:.2g}, {r['p95_ms']:.2g}",
            f"{r['memory_end_mb']:.0f} MB, {r['memory_change_percent']:+.1f} %",
        ]
        for r in result.rows
        if r["what"] in names
    ]
    columns = ["run", "frames a second", "sent = answered + dropped", "latency, ms: median, p95", "memory"]
    return markdown.table(columns, lines)


def soak(result: Kept) -> list[str]:
    last = result.rows[-1]
    counts = {
        "vertex messages sent": last["sent"],
        "received by the node": last["received"],
        "lost by DDS, and counted": last["middleware"],
        "answered": last["answered"],
        "dropped, and counted": last["dropped"],
        "changes of topology": last["topologies"],
        "answers computed again, all equal": last["checked"],
        "requests to `~/detect`, all answered": last["requests"],
        "wrong vertex messages sent": sum(last["wrong_sent"].values()),
        "wrong topologies sent": sum(last["topologies_wrong"].values()),
        "ends of a publisher, by SIGTERM and SIGKILL": f"{last['publisher_ended']}, {last['publisher_killed']}",
    }
    return markdown.table(["what", "count"], [[what, count] for what, count in counts.items()])
