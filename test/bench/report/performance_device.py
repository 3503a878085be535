# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about positions and results that stay on the GPU."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept

ARITHMETIC = {
    "first_filter": "single precision: signs",
    "sieve": "single precision: where, when",
    "doubles": "doubles",
    "tolerance": "a tolerance",
    "extended": "twice the precision",
    "integers": "integers",
    "cpu": "left to the CPU",
}


def _part(result: Kept, *parts: str) -> list[dict]:
    return [row for row in result.rows if row["part"] in parts]


def ways(result: Kept) -> list[str]:
    lines = [
        [
            r["scene"],
            f"`{r['accuracy']}`",
            r["contacts"],
            r["host_median_ms"],
            r["to_host_median_ms"],
            r["median_ms"],
            r["p95_ms"],
            r.get("graph_median_ms", ""),
        ]
        for r in _part(result, "device")
    ]
    columns = [
        "scene",
        "accuracy",
        "contacts",
        "host to host, ms",
        "device to host",
        "device to device",
        "p95",
        "graph",
    ]
    if not any(r.get("graph_median_ms") for r in _part(result, "device")):  # kept before graphs were measured
        columns, lines = columns[:-1], [line[:-1] for line in lines]
    return markdown.table(columns, lines)


def stages(result: Kept) -> list[str]:
    """Of all contacts at `exact`, each stage beside its floor."""
    rows = [r for r in _part(result, "device", "large") if r["accuracy"] == "exact"]
    rows += [r | {"scene": f"{r['worlds']:,} worlds"} for r in _part(result, "worlds") if "floors" in r][-1:]
    names = dict.fromkeys(s for r in rows for s in r["stages_ms"])
    lines = [[f"`{name}`", *(_beside(r, name) for r in rows)] for name in names]
    lines.append(["all", *(_sums(r) for r in rows)])
    return markdown.table(["stage of `detector.profile`, ms (floor)", *(r["scene"] for r in rows)], lines)


def _beside(row, name) -> str:
    if name not in row["stages_ms"]:
        return ""
    return _with_floor(row["stages_ms"][name], row["floors"].get(name.removeprefix("gpu/"), {}).get("ms", 0.0))


def _sums(row) -> str:
    done = [row["floors"].get(name.removeprefix("gpu/")) for name in row["stages_ms"]]
    return _with_floor(sum(row["stages_ms"].values()), sum(floor["ms"] for floor in done if floor))


def _with_floor(ms: float, floor: float) -> str:
    return markdown.shown(ms) + (f" ({markdown.shown(floor)})" if floor else "")


def decided(result: Kept) -> list[str]:
    rows = [r for r in result.rows if "decided" in r]
    names = [name for name in ARITHMETIC if name == "cpu" or any(r["decided"][name] for r in rows)]
    lines = [[_name(r), r["candidates"], *(r["decided"][name] for name in names)] for r in rows]
    return markdown.table(["scene", "candidate pairs", *(ARITHMETIC[name] for name in names)], lines)


def _name(row) -> str:
    return f"{row['worlds']:,} worlds, `exact`" if "worlds" in row else f"{row['scene']}, `{row['accuracy']}`"


def large(result: Kept) -> list[str]:
    lines = [
        [
            f"{r['triangles']:,}",
            r["contacts"],
            r["cpu_median_ms"],
            r["host_median_ms"],
            r["median_ms"],
            r["p95_ms"],
            r["bytes"] / r["triangles"],
        ]
        for r in _part(result, "large")
    ]
    columns = ["triangles", "contacts", "CPU, ms", "GPU, host to host", "device to device", "p95", "bytes a triangle"]
    return markdown.table(columns, lines)


def worlds(result: Kept) -> list[str]:
    lines = [
        [
            f"{r['query']}, {r['triangles']:,} triangles",
            r["worlds"],
            r["pairs"] / r["worlds"],
            r["cpu_median_ms"],
            r["median_ms"],
            r["p95_ms"],
            r["us_a_world"],
            r["bytes"] / r["worlds"] / r["triangles"],
        ]
        for r in sorted(_part(result, "worlds"), key=lambda r: (r["query"], r["worlds"]))
    ]
    columns = [
        "query of each world",
        "worlds",
        "pairs a world",
        "CPU, ms",
        "GPU, ms",
        "p95",
        "us a world",
        "bytes a triangle",
    ]
    return markdown.table(columns, lines)
