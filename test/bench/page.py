# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md: its text is written by hand, its tables are made from the kept results: `python -m bench.page`.

A table is between `<!-- NAME -->` and `<!-- end -->`, under the command, machine and commit of each of its results.
"""

from __future__ import annotations

import dataclasses
import json
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from bench import lab
from hpccd_ros.bench import accuracy
from hpccd_ros.bench.report import text

ROOT = Path(__file__).resolve().parents[2]
RESULTS, PAGE = ROOT / "test" / "bench" / "results", ROOT / "docs" / "performance.md"
TRADE = "accuracy-trade-2-cores"  # drawn in docs/figures/trade.png
TABLE = re.compile(r"(<!-- (?P<name>[a-z-]+) -->\n).*?(<!-- end -->)", re.DOTALL)
TIERS = ("fast", "balanced", "conservative", "exact")
STOPS, LEAST = ("median", "p95", "p99", "most"), "least_over_linear"


@dataclasses.dataclass(frozen=True)
class Table:
    """columns: as for lab.show. rows: of the rows of all results, those of the table."""

    results: tuple[str, ...]
    columns: lab.Columns
    rows: Callable[[list[dict]], Iterable[dict]] = lambda rows: rows


def only(**wanted) -> Callable[[list[dict]], list[dict]]:
    return lambda rows: [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]


def by(*keys: str) -> Callable[[list[dict]], list[dict]]:
    """One row for each value of the first key: its first row, and under the values of the other keys the others."""

    def pivot(rows):
        lines: dict = {}
        for row in rows:
            line = lines.setdefault(row[keys[0]], dict(row))
            line[tuple(row[key] for key in keys[1:])] = row
        return lines.values()

    return pivot


def cell(*place, shown: Callable[[dict], object]) -> Callable[[dict], object]:
    """A column of `by`: what `shown` makes of the row at this place, or nothing."""
    return lambda row: shown(row[place]) if place in row else None


def over(key: str, ratio: str) -> Callable[[dict], str]:
    return lambda row: f"{text(row[key])} ({row[ratio]:.2f})"


def joined(*keys: str, digits: int = 1, between: str = ", ") -> Callable[[dict], str]:
    return lambda row: between.join(f"{row[key]:.{digits}f}" for key in keys)


def wrong(rows: list[dict]) -> str:
    return " + ".join(f"{sum(row[key] for row in rows):,}" for key in ("missed", "invented"))


def _counts(columns: lab.Columns) -> Callable[[list[dict]], list[dict]]:
    """The columns of the last row as lines."""
    return lambda rows: [
        {"what": what, "count": count} for what, count in zip(columns, lab.cells(columns, rows[-1:])[0], strict=True)
    ]


def _scaling(row: dict) -> str:
    return f"{row['speedup']:.2f} ({text(row['median_ms'])} ms)"


def _tier(row: dict) -> str:
    early = " early" if row["latest"] == 0 and row["toc_worst"] > 0 else ""
    return f"{text(row['step_ms'])}, {row['toc_worst']:.0e}{early}".replace("e-0", "e-").replace(", 0e+00", ", 0")


def _whole_scenes(rows: list[dict]) -> list[dict]:
    rows = only(part="scene", simd="auto")(rows)
    return [{**line, "wrong": wrong(only(scene=line["scene"])(rows))} for line in by("scene", "accuracy")(rows)]


def _wrong_results(rows: list[dict]) -> list[dict]:
    kinds = {
        "ordinary, scale 1e-150 to 1e148, offset to 1e12": only(queries="ordinary"),
        "degenerate, the same": only(queries="degenerate"),
        "hard, as `make fuzz` makes them": only(part="adversarial"),
        **{f"{q}, hard": only(part="hard distance", query=q) for q in ("separation", "proximity", "intersections")},
    }
    lines = []
    for kind, belongs in kinds.items():
        mine = {tier: only(accuracy=tier)(belongs(rows)) for tier in TIERS}
        lines.append(
            {"kind": kind, "of": sum(row["n"] for row in mine["exact"]), **{t: wrong(r) for t, r in mine.items()}}
        )
    return lines


def _robots(rows: list[dict]) -> list[dict]:
    """The round with the median latency of each machine and backend."""
    groups: dict = {}
    for row in rows:
        groups.setdefault((row["result"], row["backend"]), []).append(row)
    return [sorted(group, key=lambda r: r["whole_median_ms"])[len(group) // 2] for group in groups.values()]


def _with_gpu(rows: list[dict]) -> list[dict]:
    """The scenes beside the peer, with the median of the GPU from another result."""
    lines = by("scene", "variant")([row for row in rows if "variant" in row])
    return [{**line, "gpu_ms": only(scene=line["scene"], way="gpu")(rows)[0]["median_ms"]} for line in lines]


def _same(*keys: str) -> lab.Columns:
    return {key: key for key in keys}


def _whole(**heads: str) -> lab.Columns:
    return {head.replace("_", " "): lab.whole(key) for head, key in heads.items()}


def _to(digits: int, **heads: str) -> lab.Columns:
    return {head.replace("_", " "): joined(key, digits=digits) for head, key in heads.items()}


def _mib(**heads: str) -> lab.Columns:
    return {f"{head}, MiB": lambda row, key=key: row[key] / 2**20 for head, key in heads.items()}


def _triples(digits: int, **heads: str) -> lab.Columns:
    """median, p95, p99 of each."""
    keys = {head: [f"{of}_{p}_ms" for p in ("median", "p95", "p99")] for head, of in heads.items()}
    return {f"{head.replace('_', ' ')}, ms: median, p95, p99": joined(*of, digits=digits) for head, of in keys.items()}


def _of_motions(rows):
    return by("key", "way")([{**row, "key": (row["scene"], row["number"])} for row in rows])


def _beside_peers(rows):
    """A line for each query and kind of points or pair of meshes: ms of each way, still and deforming, and the wrong
    signs of all meshes."""
    lines: dict = {}
    for row in rows:
        if row["part"] not in ("points", "curves"):
            continue
        curves = row["part"] == "curves"
        key = ("intersection curves", row["mesh"]) if curves else (row["query"], row["points"])
        line = lines.setdefault(key, {"query": key[0], "of": key[1]})
        way = row["way"].partition(",")[0]
        if row["mesh"] != "overlapping spheres":
            times = line.setdefault((way,), {})
            times[row["state"]] = min(row["median_ms"], times.get(row["state"], row["median_ms"]))
        if not curves and row["state"] == "still" and "," not in row["way"]:
            line[way, "wrong"] = line.get((way, "wrong"), 0) + row["wrong"]
    return lines.values()


def _still_and_deforming(way: str):
    return cell(way, shown=lambda times: ", ".join(text(times[state]) for state in ("still", "deforming")))


SIZE = _same("scene", "triangles", "contacts")
OVER_ALL = {"first": "first (/ all)", "step": "`collision_free_step` (/ all)", "trial": "trial steps (/ all)"}
INSIDE = ("hpccd", "trueform", "open3d", "libigl")
FOR_TWO_SCENES = ("static meshes", "largest mesh ignored by all", "fast between meshes", "as the scene says")
METHODS = {f"`{name}`": name for name in ("default", "published", "naive", "front")}
TABLES = {
    "peer": Table(
        ("peer-h200-4-of-16-cores", "gpu-exact-h200"),
        SIZE
        | _whole(contacts="contacts")
        | {"ipctk, earliest": cell("ipctk", shown=lambda row: row["median_ms"])}
        | {"hpccd, earliest": cell("cpu first", shown=lambda row: row["median_ms"])}
        | {"hpccd, all": "median_ms", "hpccd on the GPU, all": "gpu_ms"},
        _with_gpu,
    ),
    "scaling": Table(
        ("scaling-4-cores",),
        {"scene": "scene"}
        | {head: cell(method, 4, shown=_scaling) for head, method in METHODS.items()}
        | {"independent detectors": cell("independent", 4, shown=lambda row: f"{row['speedup']:.2f}")},
        by("scene", "method", "threads"),
    ),
    "memory": Table(
        ("memory-2-cores",),
        SIZE
        | _mib(detector="detector_bytes")
        | _whole(bytes_per_triangle="detector_bytes_per_triangle")
        | _mib(process="process_bytes"),
    ),
    "worlds-on-cpus": Table(
        ("worlds-2-cores", "worlds-16-cores"),
        _same("scene", "triangles", "threads", "worlds")
        | {"one call, ms": "one_call_ms"}
        | _to(2, thread_efficiency="of_all_threads")
        | {"one detector, ms": "one_detector_ms", "one per world, ms": "detectors_ms"}
        | _whole(bytes_per_world="bytes_a_world"),
    ),
    "distances": Table(
        ("distance-2-cores",),
        {"scene": "scene", "contacts": lab.whole("pairs"), "plain, ms": "step_ms"}
        | {
            f"{query} {part}": cell(query, d, shown=shown)
            for query, d in (("separation", 0.001), ("proximity", 0.001), ("intersections", None), ("distances", None))
            for part, shown in (("pairs", lab.whole("pairs")), ("ms (/ plain)", over("step_ms", "over_plain")))
        },
        by("scene", "query", "distance"),
    ),
    "inside": Table(
        ("inside-2-cores",),
        {"query": "query", "points or meshes": "of"}
        | {f"{name}, ms": _still_and_deforming(name) for name in INSIDE}
        | {
            f"wrong signs: {', '.join(INSIDE)}": lambda row: ", ".join(
                f"{row[name, 'wrong']:,}" for name in INSIDE if (name, "wrong") in row
            )
        },
        _beside_peers,
    ),
    "steps": Table(
        ("step-2-cores",),
        {"scene": "scene", "contacts": lab.whole("contacts")}
        | {"earliest at": lambda row: f"{row['earliest']:.4g}", "all, ms": "step_ms"}
        | {head: cell(query, shown=over("step_ms", "over_base")) for query, head in OVER_ALL.items()}
        | {"ratio to ipctk": cell("step", shown=lambda row: f"{row['times_faster_than_ipctk']:,.0f}")},
        by("scene", "query"),
    ),
    "motions": Table(
        ("motion-2-cores",),
        {"scene": "scene", "step size": lambda row: f"{row['step']:.2g}"}
        | {
            head: cell(way, shown=lambda row: f"{row['mean']:.3f}, {row['smallest_over_step']:.2g}")
            for head, way in {"mean factor, smallest / step size": "motion", "ipctk: the same": "ipctk"}.items()
        }
        | {"ms (/ detect)": cell("motion", shown=over("median_ms", "over_detect"))}
        | {"ipctk, ms": cell("ipctk", shown=lambda row: round(row["median_ms"]))},
        _of_motions,
    ),
    "rigid-cost": Table(
        ("rigid-cost-2-cores",),
        _same("scene", "triangles")
        | {
            "turn, degrees": lambda row: f"{row['turn']:g}",
            "parts": "parts",
            "bound": lambda row: f"{row['bound']:.1e}",
        }
        | {"straight, ms": "least_linear_ms", "moved, ms": "least_moved_ms", "/ straight": joined(LEAST, digits=2)},
        only(part="cost", tolerance=0.001),
    ),
    "robot": Table(
        ("robot-2-cores", "robot-4-of-16-cores", "robot-h100-4-of-16-cores"),
        {"cores": "cores", "core on": "backend", "results": "answers", "dropped": "dropped"}
        | _to(1, results_per_second="answers_hz")
        | {
            f"{name}, ms: median / p95": joined(f"{part}_median_ms", f"{part}_p95_ms", digits=2, between=" / ")
            for name, part in (("frame to result", "whole"), ("detection", "detection"), ("core", "core"))
        },
        _robots,
    ),
    "tiers": Table(
        ("accuracy-4-cores",),
        {"scene": "scene"}
        | {f"`{t}`": cell(t, shown=_tier) for t in TIERS}
        | {"false negatives + false positives": "wrong"},
        _whole_scenes,
    ),
    "wrong-results": Table(
        ("accuracy-4-cores", "accuracy-distance-2-cores"),
        {"queries: false negatives + false positives": "kind", "of": "of"} | {f"`{tier}`": tier for tier in TIERS},
        _wrong_results,
    ),
    "options": Table(
        ("options-2-cores",),
        {"option": "option"}
        | {
            scene: cell(
                scene, shown=lambda r: text(r["step_ms"]) + " ms" if r["option"] == "full" else f"{r['over_base']:.2f}"
            )
            for scene in ("cloth-ball", "cloth-funnel", "n-body", "n-body-like-lr", "cloth-drop")
        },
        lambda rows: by("option", "scene")([row for row in rows if row["option"] not in FOR_TWO_SCENES]),
    ),
    "device-results": Table(
        ("gpu-device-h100",),
        _same("scene", "triangles", "contacts")
        | {"CPU, ms": "cpu_median_ms", "host to host": "host_median_ms", "device to host": "to_host_median_ms"}
        | {"device to device": "median_ms", "graph": "graph_median_ms"}
        | {"bytes per triangle": lambda row: row["bytes"] / row["triangles"]},
        lambda rows: [row for row in rows if row["part"] in ("device", "large") and row["accuracy"] == "exact"],
    ),
    "latency": Table(
        ("ros-4-cores",),
        {"scene": "scene", "MB in, out": lambda row: f"{row['mb_in']:.2g}, {row['mb_out']:.2g}"}
        | {"contacts": "contacts", "core, ms": "core_median_ms"}
        | _triples(1, node_without_core="node", echo="echo")
        | {"node / echo": joined("ratio", digits=2)},
        only(what="latency"),
    ),
    "stop": Table(
        ("stop-2-cores",),
        _same("what", "count"),
        lambda rows: _counts(
            {
                "random approaches": "trials",
                "steps, each decided by brute force": "steps",
                "steps that come closer than stop_distance": "near",
                "of these without stop (false negatives)": "missed",
                "times that stop became true": "rises",
                "of these later than a frame": "late",
                "other steps with stop (false positives)": "false",
                "ms from the frame to stop: median, p95, p99, maximum": joined(*(f"{p}_ms" for p in STOPS)),
            }
        )(only(what="approaches")(rows)),
    ),
    "soak": Table(
        ("soak-4-cores",),
        _same("what", "count"),
        _counts(
            {
                "vertex messages sent": "sent",
                "lost by DDS, all counted": "middleware",
                "results": "answered",
                "dropped, all counted": "dropped",
                "changes of topology": "topologies",
                "results recomputed, all identical": "checked",
                "requests to `~/detect`, all with a response": "requests",
                "invalid vertex messages sent": lambda row: sum(row["wrong_sent"].values()),
                "publishers ended by SIGTERM, by SIGKILL": joined("publisher_ended", "publisher_killed", digits=0),
            }
        ),
    ),
}


def read(results: Path, name: str) -> dict:
    return json.loads((results / f"{name}.json").read_text(encoding="utf-8"))


def made(table: Table, results: Path) -> str:
    """Sources and lines of the table in Markdown."""
    lines, rows = [], []
    for name in table.results:
        kept = read(results, name)
        lines.append(f"{_source(name, kept)}  ")
        rows += [{**row, "result": name, "cores": kept["machine"]["cores"]} for row in kept["rows"]]
    cells = lab.cells(table.columns, table.rows(rows))
    right = [not isinstance(value, str) for value in cells[0]]
    grid = [list(table.columns), ["---:" if number else "---" for number in right]]
    grid += [["" if value is None else _shown(value) for value in row] for row in cells]
    lines[-1] = lines[-1].rstrip()
    return "\n".join([*lines, "", *(f"| {' | '.join(row)} |" for row in grid)])


def _shown(value) -> str:
    small = isinstance(value, float) and 1e-4 <= abs(value) < 0.01
    return f"{value:.2g}" if small else text(value)


def _source(name: str, kept: dict) -> str:
    machine, others = kept["machine"], kept["other_processes_share"]
    gpus = ", ".join(f"{machine['gpus'].count(gpu)} x {gpu}" for gpu in dict.fromkeys(machine["gpus"]))
    where = f"{machine['processor']}, {machine['cores']} cores{', ' if gpus else ''}{gpus}"
    busy = f", other programs used {100 * others:.0f} %" if others > 0.05 else ""
    commit = f"commit {machine['commit'][:7]}, {machine['date'].split()[0]}"
    return f"`{kept['command']}`; {where}{busy}; {commit}; [JSON](../test/bench/results/{name}.json)"


def page(old: str, results: Path = RESULTS) -> str:
    """`old` with its tables made again. KeyError for a table that is not known."""
    return TABLE.sub(lambda m: f"{m[1]}{made(TABLES[m['name']], results)}\n{m[3]}", old)


def main() -> int:
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    accuracy.draw(read(RESULTS, TRADE)["rows"], PAGE.parent / "figures" / "trade.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
