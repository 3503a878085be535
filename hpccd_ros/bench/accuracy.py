# SPDX-License-Identifier: Apache-2.0
"""The time of each tier, and its missed and spurious contacts and errors of times.

  hpccd bench accuracy run.mcap --steps 0     every step of a recording
  hpccd bench accuracy run.mcap --choose "misses<1e-4, late<1e-3"
                                              the cheapest setting that is accurate enough for this recording
  hpccd bench accuracy run.mcap --picture trade.png

Recordings are asked for plain contacts; separations that were set in the node are left out. The truth is that of the
file; for scenes without it, the tier "exact", which the tests compare with rational arithmetic.

--choose tests tiers, backends and the reports of --ask, prints all settings and names the cheapest one within the
bounds, as it is written in a program or for the node. These may be bounded, as shares, the worst scene counting:

  misses      of the true contacts, those missed (false negatives)
  spurious    of the reported contacts, those that are none (false positives)
  late, early how much later or earlier a time is than true (step = 1)
  error       the larger of both

Of settings that are equally fast to 5 % it takes the more accurate one. To ask for less than all contacts (--ask) is a
choice of the model: errors then count against what is asked. Name several where each of them would do.
"""

from __future__ import annotations

from pathlib import Path

from hpccd_core.options import ACCURACIES, SIMD
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.whole_file import whole_file
from hpccd_ros.bench import choice, command, measure
from hpccd_ros.bench.report import Report, cores, show

# Stats of the core by the stage that decided a pair, in the order in which a pair meets them.
DECIDED = {
    "kdop": "rejected_kdop",
    "coplanarity": "rejected_coplanarity",
    "projection": "rejected_projection",
    "roots": "rejected_roots",
    "proven": "proven_contacts",
    "tolerance": "by_tolerance",
    "integers": "by_integers",
}
COLUMNS = {key: key for key in ("scene", "backend", "simd", "accuracy", "asked")}
COLUMNS |= {"ms a step": "step_ms", "/ balanced": "over_balanced", "contacts": "contacts", "missed": "missed"}
COLUMNS |= {"spurious": "invented", "toc worst": "toc_worst", "toc p99": "toc_p99"}


def configure(parser):
    command.configure(parser, default=("data", "cloth-drop", "n-body-like-lr"), steps=2)
    what = ", ".join(asked.name for asked in choice.ASKED)
    add = parser.add_argument
    add("--choose", metavar="BOUNDS", help=f"name the cheapest setting within these bounds: {choice.EXAMPLE}")
    add("--tiers", default=",".join(ACCURACIES), metavar="NAME,...", help="default: %(default)s")
    add("--backend", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu; with --choose: those that work here)")
    add("--ask", default=choice.ALL, metavar="NAME,...", help=f"contacts to ask for: {what} (default: all)")
    add("--simd", default="auto", metavar="NAME,...", help=f"of {', '.join(SIMD)}")
    add("--picture", metavar="FILE", help="draw time against errors into a .png, .pdf or .svg file")


def run(args) -> Report:
    bounds = choice.parse(args.choose) if args.choose is not None else []
    names = command.listed("--ask", args.ask, [a.name for a in choice.ASKED])
    asked = [a for a in choice.ASKED if a.name in names]
    tiers = command.listed("--tiers", args.tiers, ACCURACIES)
    which = args.backend or (",".join(measure.BACKENDS) if bounds else "cpu")
    backends, rejected = command.usable("backend", which, measure.BACKENDS)
    sets, rejected_sets = command.usable("simd", args.simd, SIMD)
    if args.picture is not None:
        if Path(args.picture).suffix not in (".png", ".pdf", ".svg"):
            raise UserError(f"--picture {args.picture}: name a .png, .pdf or .svg file")
        command.require_writable("--picture", Path(args.picture))
    report, found = command.begin(args)
    report.note(measure.NOTE)
    if args.backend:
        command.skipped(report, "backend", rejected)
    command.skipped(report, "instruction set", rejected_sets)
    for source in found:
        variants = {
            (backend, simd, tier, what.name): what
            for what in asked
            for backend in backends
            for simd in (sets if backend == "cpu" else ["auto"])
            for tier in tiers
        }
        _measure(report, source, variants, args)
    check(report)
    caption = "missed, spurious, toc: against the truth of the file, or else against the tier exact"
    show("tiers", COLUMNS, report.rows, caption)
    if bounds:
        choice.choose(report, bounds)
    if args.picture is not None:
        draw(report.rows, Path(args.picture))
    return report


def _measure(report, source, variants, args):
    runners = {}
    for variant, what in variants.items():
        options = dict(zip(("backend", "simd", "accuracy"), variant, strict=False)) | {"threads": args.threads}
        runners[variant] = measure.Runner(variant, {**options, **what.options})
    series = measure.measure(source, list(runners.values()), args.repeat, args.steps)
    steps = {number: source.step(number) for number in next(iter(series.values())).by_step}
    known = {number: step.truth or _exact(step) for number, step in steps.items()}
    for (backend, simd, tier, name), what in variants.items():
        one, runner = series[backend, simd, tier, name], runners[backend, simd, tier, name]
        errors = [what.errors(measure.detect(runner.detector(steps[k]), steps[k]), true) for k, true in known.items()]
        balanced = series.get((backend, simd, "balanced", name))
        stats, row = one.stats(), one.row()
        report.add(
            part="scene",
            **{"scene": source.name, "backend": backend, "simd": simd, "accuracy": tier, "asked": name},
            threads=args.threads or cores(),
            truth="file" if next(iter(steps.values())).truth else "exact tier",
            reported=sum(sample[0].contacts for sample in one.by_step.values()),
            **{key: sum(getattr(e, key) for e in errors) for key in ("true", "missed", "invented")},
            **{key: max(getattr(e, key) for e in errors) for key in ("toc_worst", "toc_p99", "latest", "earliest")},
            over_balanced=row["step_ms"] / balanced.times()["step_ms"] if balanced else None,
            decided={key: stats.get(f"vf_{of}", 0) + stats.get(f"ee_{of}", 0) for key, of in DECIDED.items()},
            **row,
        )


def _exact(step):
    found = measure.detect(measure.Runner("truth", {"accuracy": "exact", "backend": "cpu"}).detector(step), step)
    return {key: getattr(found, key) for key in ("vf", "vf_toc", "ee", "ee_toc")}


def check(report: Report) -> None:
    """The promises of the tiers, on all steps that were measured."""
    for r in report.rows:
        what = f"missed {r['missed']}, spurious {r['invented']}, off by {r['toc_worst']:g}"
        text = f"{r['scene']}: {r['accuracy']}: {what}"
        if r["accuracy"] == "exact" and (r["missed"] or r["invented"] or r["toc_worst"] > 1e-12):
            report.failure(text)
        if r["accuracy"] == "conservative" and (r["missed"] or r["latest"] > 0):
            report.failure(f"{text}, latest by {r['latest']:g}")


def draw(rows: list[dict], path: Path) -> None:
    """Plot the time of each setting against its share of wrong contacts and its worst error of times.

    Zero has no place on a logarithmic axis: it is drawn at the value that the label of the axis names. Filled markers
    report all contacts, hollow ones fewer.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from hpccd_ros.picture.contacts import as_bytes

    page = Figure(figsize=(10, 4), layout="constrained")
    FigureCanvasAgg(page)
    panels = (
        ("missed and spurious contacts, share", 1e-7, lambda o: o.wrong),
        ("worst error of times, in steps", 1e-17, lambda o: o.values["error"]),
    )
    marks = {}
    for axis, (label, floor, value) in zip(page.subplots(1, 2), panels, strict=True):
        for o in choice.outcomes(rows):
            setting, colour = o.setting, f"C{ACCURACIES.index(o.setting.accuracy)}"
            mark = "osD"[measure.BACKENDS.index(setting.backend)]
            inside = colour if setting.asked == choice.ALL else "none"
            point = axis.loglog(o.ms, max(value(o), floor), mark, color=colour, markerfacecolor=inside, alpha=0.8)
            if setting.asked == choice.ALL:
                marks[f"{setting.accuracy}, {setting.backend}"] = point[0]
        axis.set_xlabel("ms a step")
        axis.set_ylabel(f"{label} (0 at {floor:g})")
    page.legend(marks.values(), marks, loc="outside right center", fontsize=8)
    try:
        with whole_file(path, overwrite=True) as draft:
            draft.write_bytes(as_bytes(page, draft.suffix, dpi=150))
    except (OSError, ValueError) as error:
        raise UserError(f"--picture {path}: cannot be written: {error}") from error
