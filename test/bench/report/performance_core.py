# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/performance.md about the core on CPUs."""

from __future__ import annotations

from bench.report import markdown, paper
from bench.report.results import Kept, by, whole_scene
from bench.report.timing import slope
from hpccd_ros.bench.report import text

# Of the methods, in the order of the columns.
METHODS = ("default", "published", "naive", "front", "independent")


def peer(result: Kept) -> list[str]:
    rows = []
    for mine in by(result.rows, "scene"):
        every, first, peer = (next(r for r in mine if r["variant"] == v) for v in ("cpu all", "cpu first", "ipctk"))
        rows.append(
            [
                every["scene"],
                every["triangles"],
                every["contacts"],
                every["median_ms"],
                first["median_ms"],
                peer["median_ms"],
                f"{every['times_faster_than_ipctk']:.0f}",
            ]
        )
    columns = [
        "scene",
        "triangles",
        "contacts",
        "hpccd, all contacts, ms",
        'hpccd, `report="first"`, ms',
        "ipctk, ms",
        "times faster",
    ]
    return markdown.table(columns, rows)


def sequences(result: Kept) -> list[str]:
    rows = [
        [
            r["scene"],
            r["triangles"],
            round(r["contacts"]),
            r["average_ms"],
            r["median_ms"],
            r["p95_ms"],
            r["stages_ms"].get("build", 0.0),
            paper.TABLE_1_MS[r["scene"]],
        ]
        for r in result.rows
        if r["scene"] in paper.TABLE_1_MS and r["variant"] == "cpu all"
    ]
    columns = ["scene", "triangles", "contacts a step", "average ms", "median", "p95", "of it building", "2009"]
    return markdown.table(columns, rows)


def scaling(*results: Kept) -> list[str]:
    """Speed-up with the most threads, by method, and the ms that it leads from and to."""
    rows = [r for result in results for r in result.rows]
    most = max(r["threads"] for r in rows)

    def cell(mine, method):
        of = {r["threads"]: r for r in mine if r["method"] == method}
        if most not in of:
            return None
        ms = f" ({text(of[1]['median_ms'])} to {text(of[most]['median_ms'])} ms)" if 1 in of else ""
        return f"{of[most]['speedup']:.2f}{ms}"

    lines = [[mine[0]["scene"], *(cell(mine, method) for method in METHODS)] for mine in by(rows, "scene")]
    return markdown.table(["scene", *(f"`{m}`" for m in METHODS[:-1]), "independent detectors"], lines)


def many_cores(*results: Kept) -> list[str]:
    rows = [r for result in results for r in result.rows]

    def speedup(mine, method, threads):
        found = [r["speedup"] for r in mine if (r["method"], r["threads"]) == (method, threads)]
        return f"{found[0]:.2f}" if found else None

    lines = [
        [
            mine[0]["scene"],
            *(speedup(mine, "default", n) for n in (4, 8, 16)),
            speedup(mine, "independent", 8),
            *(speedup(mine, "naive", n) for n in (4, 8, 16)),
        ]
        for mine in by(rows, "scene")
    ]
    columns = ["scene", "4 threads", "8", "16", "8 independent detectors", "`naive`: 4", "8", "16"]
    return markdown.table(columns, lines)


def methods(result: Kept) -> list[str]:
    shown = ("default", "published", "naive", "front", "avx2", "scalar")

    def line(mine, name, value):
        return [f"{mine[0]['scene']}: {name}", *(value(next(r for r in mine if r["variant"] == v)) for v in shown)]

    lines = []
    for mine in by(result.rows, "scene"):
        lines.append(line(mine, "ms", lambda r: r["sequence_ms"] / r["steps"]))
        lines.append(line(mine, "node pairs", lambda r: round(r["node_pairs"])))
        lines.append(line(mine, "candidate pairs", lambda r: round(r["candidates"])))
    return markdown.table(["4 threads", *(f"`{v}`" for v in shown[:4]), "AVX2 only", "scalar only"], lines)


def size(result: Kept) -> list[str]:
    lines = []
    for mine in by(result.rows, "scene", "threads"):
        triangles = [r["triangles"] for r in mine]
        power = {key: slope(triangles, [r[key] for r in mine]) for key in ("step_ms", "contacts")}
        lines.append(
            [
                mine[0]["scene"],
                mine[0]["threads"],
                " to ".join(f"{n:,}" for n in (triangles[0], triangles[-1])),
                " to ".join(text(mine[k]["step_ms"]) for k in (0, -1)),
                f"{power['step_ms']:.2f}",
                f"{power['contacts']:.2f}",
            ]
        )
    columns = ["scene", "threads", "triangles", "ms a step", "power of time", "power of contacts"]
    return markdown.table(columns, lines)


def memory(result: Kept) -> list[str]:
    mega = 2**20
    lines = [
        [
            r["scene"],
            r["triangles"],
            r["contacts"],
            r["detector_bytes"] / mega,
            round(r["detector_bytes_per_triangle"]),
            r["process_bytes"] / mega,
        ]
        for r in result.rows
    ]
    return markdown.table(["scene", "triangles", "contacts", "detector, MB", "bytes a triangle", "process, MB"], lines)


def ropes(result: Kept) -> list[str]:
    lines = [[r["way"], r["edges"], r["triangles"], r["contacts"], r["ms"], r["bytes"] / 1e6] for r in result.rows]
    return markdown.table(["as", "edges", "triangles", "contacts", "ms a step", "detector, MB"], lines)


def worlds(*results: Kept) -> list[str]:
    lines = [
        [
            r["scene"],
            r["triangles"],
            r["worlds"],
            r["one_call_ms"],
            f"{r['of_all_threads']:.2f}",
            r["one_thread_ms"],
            r["one_detector_ms"],
            r.get("detectors_ms"),
            round(r["bytes_a_world"]),
        ]
        for result in results
        for r in result.rows
    ]
    columns = [
        "scene",
        "triangles",
        "worlds",
        "one call, ms",
        "of all threads",
        "1 thread, ms",
        "one detector",
        "a detector each",
        "bytes a world",
    ]
    return markdown.table(columns, lines)


def options(result: Kept) -> list[str]:
    scenes = by(result.rows, "scene")
    names = dict.fromkeys(r["option"] for r in result.rows)

    def cell(mine, name):
        found = [r for r in mine if r["option"] == name]
        return found and (text(found[0]["step_ms"]) if name == "full" else f"{found[0]['over_full']:.2f}") or None

    lines = [["full, ms" if n == "full" else n, *(cell(mine, n) for mine in scenes)] for n in names]
    return markdown.table(["option", *(mine[0]["scene"] for mine in scenes)], lines)


def tiers(result: Kept) -> list[str]:
    """ms and worst error of toc."""
    rows = [r for r in result.rows if whole_scene(r) and r["simd"] == "auto"]

    def cell(row):
        early = " early" if row["latest"] == 0 and row["toc_worst"] > 0 else ""
        return f"{text(row['step_ms'])}, {row['toc_worst']:.0e}{early}".replace("e-0", "e-").replace(", 0e+00", ", 0")

    lines = [
        [
            mine[0]["scene"],
            *map(cell, mine),
            " + ".join(str(sum(r[key] for r in mine)) for key in ("missed", "invented")),
        ]
        for mine in by(rows, "scene")
    ]
    return markdown.table(["scene", *(f"`{r['accuracy']}`" for r in by(rows, "scene")[0]), "missed + invented"], lines)


def wrong_answers(result: Kept) -> list[str]:
    tiers = list(dict.fromkeys(r["accuracy"] for r in result.rows))
    kinds = {
        "ordinary, scale 1e-150 to 1e148, offset to 1e12": lambda r: r.get("queries") == "ordinary",
        "degenerate, the same": lambda r: r.get("queries") == "degenerate",
        "hard, as `make fuzz` makes them": lambda r: r["part"] == "adversarial",
    }
    lines = []
    for kind, belongs in kinds.items():
        by_tier = [[r for r in result.rows if belongs(r) and r["accuracy"] == tier] for tier in tiers]
        wrong = (" + ".join(f"{sum(r[key] for r in mine):,}" for key in ("missed", "invented")) for mine in by_tier)
        lines.append([kind, sum(r["n"] for r in by_tier[0]), *wrong])
    return markdown.table(["queries: missed + invented", "of", *(f"`{tier}`" for tier in tiers)], lines)


def decided(result: Kept) -> list[str]:
    rows = [r for r in result.rows if whole_scene(r) and (r["accuracy"], r["simd"]) == ("exact", "auto")]
    keys = ("slabs", "coplanarity", "projection", "roots", "proven", "integers")
    heads = [
        "scene",
        "candidate pairs",
        "k-DOPs",
        "coplanarity",
        "projections",
        "roots",
        "contacts by bounds",
        "by integers",
    ]
    return markdown.table(
        heads, [[r["scene"], round(r["candidates"]), *(round(r["decided"][k]) for k in keys)] for r in rows]
    )
