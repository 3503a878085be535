# SPDX-License-Identifier: Apache-2.0
"""Where each tier errs: hard elementary queries and distance queries, against rational arithmetic. (Of whole scenes:
`hpccd bench accuracy`.)

  python -m bench accuracy                        sweeps, then distance queries
  python -m bench accuracy --parts distance

Sweeps: elementary queries at scales from 1e-150 to 1e148 and at distances from the origin up to 1e12 times their size,
ordinary and degenerate ones, and hard ones as `make fuzz` makes them. Distance: separation, proximity and intersections
on the scenes of HPCCD_DATA/distance, whose truth is known, and on hard queries.
"""

from __future__ import annotations

from bench import accuracy_distance, accuracy_sweep, lab
from bench.lab import BACKENDS, usable
from hpccd_core.options import ACCURACIES, SIMD
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import measure
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import data_folder

PARTS = ("sweeps", "distance")


def configure(parser):
    parser.add_argument("--parts", default=",".join(PARTS), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument("--tiers", default=",".join(ACCURACIES), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument("--backend", default="cpu", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu)")
    parser.add_argument("--simd", default="auto", metavar="NAME,...", help=f"of {', '.join(SIMD)}")
    parser.add_argument(
        "--sweep-queries",
        type=int,
        default=2000,
        metavar="N",
        help="queries of each kind at each point of the sweeps; 0: none (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the sweeps (default: %(default)s)")
    lab.configure(parser, leave_out=("size",))


def run(args) -> lab.Report:
    parts = lab.listed("--parts", args.parts, PARTS)
    report = lab.begin(args)[0]
    report.note(measure.NOTE)
    tiers = lab.listed("--tiers", args.tiers, ACCURACIES)
    backends, refused = usable("backend", lab.listed("--backend", args.backend, BACKENDS))
    lab.skipped(report, "backend", refused)
    if not backends:
        raise UserError(f"--backend {args.backend}: none of these works here; see `hpccd info`")
    sets, refused = usable("simd", lab.listed("--simd", args.simd, SIMD))
    lab.skipped(report, "instruction set", refused)
    if "distance" in parts:
        _measure_distance(report, tiers, backends, sets, args)
    if "sweeps" in parts and args.sweep_queries > 0:
        for part in (accuracy_sweep.adversarial, accuracy_sweep.sweep):
            for row in part(tiers, args.sweep_queries, args.seed):
                report.add(part=part.__name__, **row)
        _print_adversarial([row for row in report.rows if row["part"] == "adversarial"], tiers)
        _print_first_errors([row for row in report.rows if row["part"] == "sweep"], tiers)
    _check(report)
    return report


def _options(tiers, backends, sets, args) -> dict[tuple[str, str, str], dict]:
    """Of the detectors that are compared, by backend, instruction set and tier."""
    return {
        (backend, simd, tier): {"backend": backend, "accuracy": tier, "threads": args.threads, "simd": simd}
        for backend in backends
        for simd in (sets if backend == "cpu" else ["auto"])
        for tier in tiers
    }


def _measure_distance(report, tiers, backends, sets, args):
    data = data_folder(args.data)
    folder = data / "distance" if data and (data / "distance").is_dir() else None
    compared = {" ".join(key): options for key, options in _options(tiers, backends, sets, args).items()}
    if folder is None:
        report.note("distance queries on scenes skipped: they need HPCCD_DATA, and the folder distance in it")
    for source, known in accuracy_distance.scenes(folder) if folder else ():
        for row in accuracy_distance.on_scene(source, known, compared, args.repeat):
            named = dict(zip(("backend", "simd", "accuracy"), row.pop("variant").split(), strict=True))
            report.add(part="distance", threads=args.threads or cores(), **row, **named)
    for row in accuracy_distance.hard(tiers, max(0, args.sweep_queries), args.seed, folder):
        report.add(part="hard distance", **row)
    by_part = [[row for row in report.rows if row["part"] == part] for part in ("distance", "hard distance")]
    accuracy_distance.show(*by_part, tiers)


def _check(report):
    """The promises of the tiers, on everything that was measured here."""
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


def _print_adversarial(rows, tiers):
    tables.show(
        "hard queries: missed + invented of all (rational arithmetic is the truth)",
        ["generator", "queries", "contacts", *tiers],
        [
            [name, first["n"], first["true"], *(f"{r['missed']} + {r['invented']}" for r in mine)]
            for name, mine in _groups(rows, "generator")
            for first in mine[:1]
        ],
    )


def _print_first_errors(rows, tiers):
    """For each sweep the share of wrong answers at the ends and in the middle."""
    for name in ("scale", "offset"):
        mine = [r for r in rows if r["sweep"] == name]
        tables.show(
            f"share of wrong answers against {name}",
            [name, "queries", *tiers],
            [
                [f"{at:g}", family, *(r["wrong_share"] for r in mine if (r["at"], r["queries"]) == (at, family))]
                for family in ("ordinary", "degenerate")
                for at in dict.fromkeys(r["at"] for r in mine)
            ],
        )


def _groups(rows, key):
    return [(value, [r for r in rows if r[key] == value]) for value in dict.fromkeys(r[key] for r in rows)]
