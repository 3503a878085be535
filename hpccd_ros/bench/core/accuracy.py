# SPDX-License-Identifier: Apache-2.0
"""What each tier of accuracy costs, and where it errs.

  hpccd bench accuracy                        the files of HPCCD_DATA and two generated scenes, then the sweeps
  hpccd bench accuracy cloth-ball --simd auto,scalar
  hpccd bench accuracy cloth-drop --parts scenes         whole scenes only
  hpccd bench accuracy --parts distance       separation, proximity, intersections
  hpccd bench accuracy run.mcap --steps 0 --choose "misses<1e-4, late<1e-3"
                                              the cheapest setting for what you recorded

Scenes may be recordings of `hpccd record`, or of the node itself: nothing else tells so well what you need. They are
asked for plain contacts; separations that were set in the node are left out.

--choose tests tiers, backends and what --ask names on the scenes, shows all of them and the front (the settings that
none beats in everything), and names the cheapest one that keeps the bounds, to be copied into a program or a start of
the node. What may be bounded, as shares, the worst scene counting:

  misses      of the true contacts, those missed            late   how much later a time is than true (step = 1)
  inventions  of the reported contacts, those not true      early  how much earlier
                                                            error  the larger of both

It takes the more accurate of settings that are equally fast to 5 %. To ask for less than all contacts (--ask) is a
choice of the modelling: wrong answers then count against what is asked. Name several where each of them would do.

Scenes: ms a step of each tier in turn, contacts missed and invented, error of times of contact, and who decided the
candidate pairs. Truth is what the file says; for scenes without it, the tier "exact", which the tests compare with
rational arithmetic. Sweeps: elementary queries at scales from 1e-150 to 1e148 and at distances from the origin up to
1e12 times their size, ordinary and degenerate ones, and hard ones as `make fuzz` makes them, against rational
arithmetic. Distance: separation, proximity and intersections on the scenes of HPCCD_DATA/distance, whose truth is
known, and on hard queries.
"""

from __future__ import annotations

from hpccd_core.options import ACCURACIES, SIMD
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command
from hpccd_ros.bench.core import accuracy_choice, accuracy_distance, accuracy_sweep, choice, measure, settings
from hpccd_ros.bench.core.variants import BACKENDS, Variant, usable
from hpccd_ros.bench.report import progress, table
from hpccd_ros.bench.report.machine import cores
from hpccd_ros.bench.sources import data_folder

PARTS = ("scenes", "sweeps", "distance")

# Stats of the core by who decided, in the order in which a pair meets them.
DECIDED = {
    "slabs": "rejected_slabs",
    "coplanarity": "rejected_coplanarity",
    "projection": "rejected_projection",
    "roots": "rejected_roots",
    "proven": "proven_contacts",
    "tolerance": "by_tolerance",
    "integers": "by_integers",
}


def configure(parser):
    command.configure(parser, default=("data", "cloth-drop", "n-body-like-lr"), steps=2)
    parser.add_argument(
        "--parts", metavar="NAME,...", help=f"of {', '.join(PARTS)} (default: all; with --choose: scenes)"
    )
    parser.add_argument(
        "--choose", metavar="BOUNDS", help=f"name the cheapest setting that keeps these bounds: {choice.EXAMPLE}"
    )
    parser.add_argument("--tiers", default=",".join(ACCURACIES), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument(
        "--backend", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu; with --choose: those that work here)"
    )
    what = tuple(asked.name for asked in settings.ASKED)
    parser.add_argument(
        "--ask",
        default=settings.ALL,
        metavar="NAME,...",
        help=f"for which contacts scenes are asked: {', '.join(what)} (default: %(default)s)",
    )
    parser.add_argument("--simd", default="auto", metavar="NAME,...", help=f"of {', '.join(SIMD)}")
    parser.add_argument(
        "--sweep-queries",
        type=int,
        default=2000,
        metavar="N",
        help="queries of each kind at each point of the sweeps; 0: none (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the sweeps (default: %(default)s)")
    command.threads_option(parser)


def run(args) -> int:
    bounds = choice.parse(args.choose) if args.choose is not None else []
    parts = command.listed("--parts", args.parts, PARTS) if args.parts else ["scenes"] if bounds else [*PARTS]
    if bounds and "scenes" not in parts:
        raise UserError(f"--parts {args.parts}: --choose needs the scenes; add scenes, or leave --parts out")
    asked = settings.asked(command.listed("--ask", args.ask, [a.name for a in settings.ASKED]))
    report, sources = command.begin(args) if "scenes" in parts else (command.begin_report(args), [])
    report.note(measure.NOTE)
    tiers = command.listed("--tiers", args.tiers, ACCURACIES)
    names = command.listed("--backend", args.backend, BACKENDS) if args.backend else BACKENDS if bounds else ["cpu"]
    backends, refused = usable("backend", names)
    if args.backend:
        command.skipped(report, "backend", refused)
    if not backends:
        raise UserError(f"--backend {args.backend}: none of these works here; see `hpccd info`")
    sets, refused = usable("simd", command.listed("--simd", args.simd, SIMD))
    command.skipped(report, "instruction set", refused)
    for source in sources:
        _measure_scene(report, source, asked, _options(tiers, backends, sets, args), args)
    if sources:
        _print_scenes(report.rows)
    if bounds:
        accuracy_choice.choose(report, bounds)
    if "distance" in parts:
        _measure_distance(report, tiers, backends, sets, args)
    if "sweeps" in parts and args.sweep_queries > 0:
        for part in (accuracy_sweep.adversarial, accuracy_sweep.sweep):
            for row in part(tiers, args.sweep_queries, args.seed):
                report.add(part=part.__name__, **row)
        _print_adversarial([row for row in report.rows if row["part"] == "adversarial"], tiers)
        _print_first_errors([row for row in report.rows if row["part"] == "sweep"], tiers)
    _check(report)
    return command.end(args, report)


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


def _measure_scene(report, source, asked, compared, args):
    variants = {
        (*key, what): Variant(" ".join((*key, what.name)), {**options, **what.options})
        for what in asked
        for key, options in compared.items()
    }
    series = measure.measure(source, [measure.CoreRunner(v) for v in variants.values()], args.repeat, args.steps)
    known = {step: _truth(source.step(step)) for step in next(iter(series.values())).by_step}
    errors_of = _errors(source, variants, known)
    for (backend, simd, tier, what), variant in variants.items():
        one, errors = series[variant.name], errors_of[variant.name]
        balanced = series.get(f"{backend} {simd} balanced {what.name}")
        stats = one.stats()
        report.add(
            part="scene",
            scene=source.name,
            backend=backend,
            simd=simd,
            accuracy=tier,
            asked=what.name,
            threads=args.threads or cores(),
            truth="file" if source.step(next(iter(known))).truth else "exact tier",
            contacts=one.contacts(),
            reported=sum(sample[0].contacts for sample in one.by_step.values()),
            true=sum(e.true for e in errors),
            missed=sum(e.missed for e in errors),
            invented=sum(e.invented for e in errors),
            toc_worst=max(e.toc_worst for e in errors),
            toc_p99=max(e.toc_p99 for e in errors),
            latest=max(e.latest for e in errors),
            earliest=max(e.earliest for e in errors),
            **one.times().as_row(),
            step_ms=one.sequence_ms() / len(one.by_step),
            over_balanced=one.sequence_ms() / balanced.sequence_ms() if balanced else None,
            candidates=one.candidates(),
            decided={
                name: sum(stats.get(f"{kind}_{key}", 0) for kind in ("vf", "ee")) for name, key in DECIDED.items()
            },
        )


def _truth(step):
    if step.truth:
        return step.truth
    exact = Variant("truth", {"accuracy": "exact", "backend": "cpu"}).detector(step)
    found = exact.detect(step.vertices_t0, step.vertices_t1)
    return {key: getattr(found, key) for key in ("vf", "vf_toc", "ee", "ee_toc")}


def _errors(source, variants, known):
    """Of each variant, by name, the errors in each step."""
    errors = {variant.name: [] for variant in variants.values()}
    with progress.bar(f"{source.name}: against the truth", len(known) * len(variants)) as bar:
        for number, true in known.items():
            step = source.step(number)
            for (*_, what), variant in variants.items():
                found = measure.detect(variant.detector(step), step)
                errors[variant.name].append(what.errors(found, true))
                bar.step(variant.name)
    return errors


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


def _print_scenes(rows):
    table.show(
        "tiers on whole scenes",
        [
            "scene",
            "backend",
            "simd",
            "accuracy",
            "asked",
            "ms a step",
            "/ balanced",
            "contacts",
            "missed",
            "invented",
            "toc worst",
            "toc p99",
        ],
        [
            [
                r["scene"],
                r["backend"],
                r["simd"],
                r["accuracy"],
                r["asked"],
                r["step_ms"],
                r["over_balanced"],
                round(r["contacts"]),
                r["missed"],
                r["invented"],
                r["toc_worst"],
                r["toc_p99"],
            ]
            for r in rows
        ],
        "missed, invented, toc: against the truth of the file, or else against the tier exact",
    )
    table.show(
        "who decided the candidate pairs of an average step",
        ["scene", "backend", "accuracy", "candidates", *DECIDED],
        [
            [
                r["scene"],
                r["backend"],
                r["accuracy"],
                round(r["candidates"]),
                *(round(n) for n in r["decided"].values()),
            ]
            for r in rows
            if r["simd"] in ("auto", rows[0]["simd"]) and r["asked"] == rows[0]["asked"]
        ],
        "slabs to roots: dropped, proven: contacts, by error bounds (fast: as single precision says); the rest: the "
        "tier's fallback",
    )


def _print_adversarial(rows, tiers):
    table.show(
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
        table.show(
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
