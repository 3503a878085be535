# SPDX-License-Identifier: Apache-2.0
"""Errors of each tier on hard elementary queries and distance queries, compared with rational arithmetic. For whole
scenes, see `hpccd bench accuracy`.

  python -m bench accuracy                        sweeps, then distance queries
  python -m bench accuracy --parts distance

Sweeps: ordinary, degenerate and hard elementary queries (as `make fuzz` generates them), at scales from 1e-150 to 1e148
and at distances from the origin up to 1e12 times their size. Distance: separation, proximity and intersections on the
scenes of HPCCD_DATA/distance, whose truth is known, and on hard queries.
"""

from __future__ import annotations

from bench import accuracy_distance, accuracy_sweep, lab
from hpccd_core.options import ACCURACIES, SIMD
from hpccd_ros.bench import command, measure
from hpccd_ros.bench.sources import data_folder

PARTS = ("sweeps", "distance")


def configure(parser):
    add = parser.add_argument
    queries = "queries of each kind at each point of the sweeps; 0: none (default: %(default)s)"
    add("--parts", default=",".join(PARTS), metavar="NAME,...", help="default: %(default)s")
    add("--tiers", default=",".join(ACCURACIES), metavar="NAME,...", help="default: %(default)s")
    add("--backend", default="cpu", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu)")
    add("--simd", default="auto", metavar="NAME,...", help=f"of {', '.join(SIMD)}")
    add("--sweep-queries", type=int, default=2000, metavar="N", help=queries)
    add("--seed", type=int, default=1, metavar="N", help="of the sweeps (default: %(default)s)")
    lab.configure(parser, leave_out=("size",))


def run(args) -> lab.Report:
    parts = lab.listed("--parts", args.parts, PARTS)
    report = lab.begin(args)[0]
    report.note(measure.NOTE)
    tiers = lab.listed("--tiers", args.tiers, ACCURACIES)
    backends, rejected = command.usable("backend", args.backend, lab.BACKENDS)
    lab.skipped(report, "backend", rejected)
    sets, rejected = command.usable("simd", args.simd, SIMD)
    lab.skipped(report, "instruction set", rejected)
    if "distance" in parts:
        _measure_distance(report, tiers, backends, sets, args)
    if "sweeps" in parts and args.sweep_queries > 0:
        for part in (accuracy_sweep.adversarial, accuracy_sweep.sweep):
            for row in part(tiers, args.sweep_queries, args.seed):
                report.add(part=part.__name__, **row)
        _show_sweeps(report.rows, tiers)
    _check(report)
    return report


def _measure_distance(report, tiers, backends, sets, args):
    data = data_folder(args.data)
    folder = data / "distance" if data and (data / "distance").is_dir() else None
    compared = {
        f"{backend} {simd} {tier}": {"backend": backend, "accuracy": tier, "threads": args.threads, "simd": simd}
        for backend in backends
        for simd in (sets if backend == "cpu" else ["auto"])
        for tier in tiers
    }
    if folder is None:
        report.note("distance queries on scenes skipped: they need HPCCD_DATA, and the folder distance in it")
    for source, known in accuracy_distance.scenes(folder) if folder else ():
        for row in accuracy_distance.on_scene(source, known, compared, args.repeat):
            named = dict(zip(("backend", "simd", "accuracy"), row.pop("variant").split(), strict=True))
            report.add(part="distance", threads=args.threads or lab.cores(), **row, **named)
    for row in accuracy_distance.hard(tiers, max(0, args.sweep_queries), args.seed, folder):
        report.add(part="hard distance", **row)
    by_part = [[row for row in report.rows if row["part"] == part] for part in ("distance", "hard distance")]
    accuracy_distance.show(*by_part, tiers)


def _check(report):
    """Check the guarantees of the tiers on all measured queries."""
    for row in report.rows:
        where = row.get("scene") or row.get("generator") or f"{row['sweep']} {row['at']:g}, {row['queries']}"
        what, off = row.get("query", "contacts"), row.get("toc_worst", row.get("value_worst"))
        wrong = f"missed {row['missed']}, invented {row['invented']}, off by {off:g}"
        text = f"{where}: {what}: {row['accuracy']}: {wrong}"
        if row["accuracy"] == "exact" and (row["missed"] or row["invented"] or off > 1e-12):
            report.failure(text)
        # Distances are promised as by exact. The time of a separation and its truth are each rounded, that of plain
        # contact's truth is rounded down.
        late = {"separation": 1e-15, "proximity": 1e-12}.get(row.get("query"), 0.0)
        if row["accuracy"] == "conservative" and (row["missed"] or row["latest"] > late):
            report.failure(f"{text}, latest by {row['latest']:g}")


def _show_sweeps(rows, tiers):
    """Hard queries; and for each sweep the share of wrong results."""
    lines: dict = {}
    for row in rows:
        if row["part"] in ("adversarial", "sweep"):
            key = tuple(row.get(key) for key in ("generator", "sweep", "queries", "at"))
            line = lines.setdefault(key, dict(row))
            wrong = row["wrong_share"] if row["part"] == "sweep" else f"{row['missed']} + {row['invented']}"
            line[row["accuracy"]] = wrong
    columns, title = {"generator": "generator", "queries": "n", "contacts": "true"}, "hard queries: missed + invented"
    hard = [line for line in lines.values() if line["part"] == "adversarial"]
    of = {tier: tier for tier in tiers}
    lab.show(f"{title} of all (rational arithmetic is the truth)", columns | of, hard)
    for name in ("scale", "offset"):
        mine = [line for line in lines.values() if line.get("sweep") == name]
        columns = {name: lambda row: f"{row['at']:g}", "queries": "queries", **of}
        lab.show(f"share of wrong results against {name}", columns, mine)
