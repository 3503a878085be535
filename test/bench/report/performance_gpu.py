# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about the GPU and hybrid backends."""

from __future__ import annotations

from bench.report import markdown
from bench.report.results import Kept, by, whole_scene
from hpccd_ros.bench.report import text


def _part(result: Kept, part: str) -> list[dict]:
    return [row for row in result.rows if row["part"] == part]


def backends(result: Kept) -> list[str]:
    lines = [
        [
            r["scene"],
            f"`{r['accuracy']}`",
            r["cpu_median_ms"],
            r["hybrid_median_ms"],
            r["median_ms"],
            r["p95_ms"],
            r["floor_pcie_ms"],
            r["floor_arithmetic_ms"],
        ]
        for r in _part(result, "frame")
    ]
    columns = ["scene", "accuracy", "CPU, ms", "hybrid, ms", "GPU, ms", "GPU, p95", "floor: PCIe", "floor: arithmetic"]
    return markdown.table(columns, lines)


def device_stages(result: Kept) -> list[str]:
    rows = [r for r in _part(result, "frame") if r["accuracy"] == "exact"]
    stages = dict.fromkeys(s for r in rows for s in r["stages_ms"] if s.startswith("gpu/"))
    lines = [[f"`{s}`", *(r["stages_ms"].get(s) for r in rows)] for s in stages]
    return markdown.table(["stage of `detector.profile`, ms", *(r["scene"] for r in rows)], lines)


def hybrid(result: Kept) -> list[str]:
    """ms and, in brackets, times one CPU thread with the published method."""
    shown = {
        "published, CPU, 1 thread": ("published", 1, 0),
        "hybrid, 4": ("published", 4, 1),
        "default, CPU, 4 threads": ("default", 4, 0),
        "hybrid, 4 ": ("default", 4, 1),
        "CPU, 8": ("default", 8, 0),
        "hybrid, 8": ("default", 8, 1),
    }
    return _by_threads(result, shown)


def second_gpu(result: Kept) -> list[str]:
    shown = {
        f"{method}, {n} threads, {g} GPU{'' if g == 1 else 's'}": (method, n, g)
        for method, n in (("published", 4), ("default", 4), ("default", 16))
        for g in (1, 2)
    }
    return _by_threads(result, shown)


def _by_threads(result: Kept, shown: dict[str, tuple[str, int, int]]) -> list[str]:
    lines = []
    for mine in by(_part(result, "threads and GPUs"), "scene"):
        of = {(r["method"], r["threads"], r["gpus"]): r for r in mine}
        cells = (f"{text(of[key]['median_ms'])} ({of[key]['speedup']:.3g})" for key in shown.values())
        lines.append([mine[0]["scene"], *cells])
    return markdown.table(["ms (times as fast)", *(head.strip() for head in shown)], lines)


def segments(result: Kept) -> list[str]:
    rows = [r for r in _part(result, "segment size") if r["threads"] == 4]
    sizes = sorted({r["segment_pairs"] for r in rows})
    lines = [
        [
            f"{mine[0]['scene']}, {mine[0]['method']}",
            *(next(r["median_ms"] for r in mine if r["segment_pairs"] == n) for n in sizes),
        ]
        for mine in by(rows, "scene", "method")
    ]
    return markdown.table(["ms by pairs in a segment", *map(str, sizes)], lines)


def tiers(result: Kept) -> list[str]:
    all_contacts = [r for r in result.rows if whole_scene(r) and r.get("asked", "all") == "all"]
    lines = [
        [
            f"{mine[0]['scene']}, `{mine[0]['backend']}`",
            *(r["step_ms"] for r in mine),
            " + ".join(str(sum(r[key] for r in mine)) for key in ("missed", "invented")),
        ]
        for mine in by(all_contacts, "scene", "backend")
    ]
    tiers = dict.fromkeys(r["accuracy"] for r in result.rows)
    return markdown.table(["ms a step", *(f"`{t}`" for t in tiers), "missed + invented"], lines)
