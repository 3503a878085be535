# SPDX-License-Identifier: Apache-2.0
"""The time of each tier, and its missed and spurious contacts and errors of times.

  hpccd bench accuracy run.mcap --steps 0     every step of a recording
  hpccd bench accuracy run.mcap --choose "misses<1e-4, late<1e-3"
                                              the cheapest setting that is accurate enough for this recording
  hpccd bench accuracy run.mcap --picture trade.png

Recordings are asked for plain contacts: separations, thickness, planes and ignored neighbours of the node are left out.
The truth is that of the file; for scenes without it, the tier "exact", which the tests compare with rational
arithmetic.

--choose tests tiers, backends and the reports of --ask, prints all settings and names the cheapest one within the
bounds, as it is written in a program or for the node. These may be bounded, as shares, the worst scene counting:

  misses      of the true contacts, those missed (false negatives)
  spurious    of the reported contacts, those that are none (false positives)
  late, early how much later or earlier a time is than true (step = 1)
  error       the larger of both
  deviation   how far a coarse surface is from the mesh, as a share of the scene's diagonal

With a bound on deviation, coarse meshes (--detail) are tried too. Their faces are not those of the meshes, so they are
judged by --ask meshes, which different meshes touch, and when first, or any_meshes, whether any two do; no mesh is
tested against itself. With exact and conservative, coarse meshes miss none and are never late; they may be early or
spurious.

Of settings that are equally fast to 5 % it takes the more accurate one. To ask for less than all contacts (--ask) is a
choice of the model: errors then count against what is asked. Name several where each of them would do.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from hpccd_core.detail_levels import simplifier
from hpccd_core.options import ACCURACIES, SIMD
from hpccd_core.whole_file import whole_file
from hpccd_ros.base.errors import UserError
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
COLUMNS = {key: key for key in ("scene", "backend", "simd", "accuracy", "asked", "detail")}
COLUMNS |= {"ms a step": "step_ms", "/ balanced": "over_balanced", "contacts": "contacts", "missed": "missed"}
COLUMNS |= {"spurious": "invented", "toc worst": "toc_worst", "toc p99": "toc_p99", "deviation": "deviation"}
# Of the picture.
FLOOR = 1e-17
MARKERS = dict(zip((asked.name for asked in choice.ASKED), "o^vsDPX", strict=True))
NAMES = {name: f"{name} (number: detail)" for name in choice.OF_MESHES}
FILLS = dict(zip(measure.BACKENDS, ("full", "left", "none"), strict=True))
DETAILS = "0.3,0.1,0.03"  # tried where a bound on deviation is named


def configure(parser):
    command.configure(parser, default=("data", "cloth-drop", "n-body-like-lr"), steps=2)
    what = ", ".join(asked.name for asked in choice.ASKED)
    add = parser.add_argument
    add("--choose", metavar="BOUNDS", help=f"name the cheapest setting within these bounds: {choice.EXAMPLE}")
    add("--tiers", default=",".join(ACCURACIES), metavar="NAME,...", help="default: %(default)s")
    add("--backend", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu; with --choose: those that work here)")
    add("--ask", default=choice.ALL, metavar="NAME,...", help=f"contacts to ask for: {what} (default: all)")
    add("--detail", metavar="RATIO,...", help=f"parts of the faces that stay (default: with a deviation: {DETAILS})")
    add("--simd", default="auto", metavar="NAME,...", help=f"of {', '.join(SIMD)}")
    add(
        "--picture",
        metavar="FILE",
        help="draw time against error, and the Pareto front, into a .png, .pdf or .svg file",
    )


def run(args) -> Report:
    bounds = choice.parse(args.choose) if args.choose is not None else []
    names = command.listed("--ask", args.ask, [a.name for a in choice.ASKED])
    asked = [a for a in choice.ASKED if a.name in names]
    tiers = command.listed("--tiers", args.tiers, ACCURACIES)
    parts = details(args.detail or (DETAILS if any(b.quantity == "deviation" for b in bounds) else ""))
    if parts and not any(a.of_meshes for a in asked):
        asked.append(next(a for a in choice.ASKED if a.of_meshes))
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
        one_mesh = len(source.first().meshes) == 1
        variants = {
            (backend, simd, tier, what.name, detail): what
            for what in asked
            if not (what.of_meshes and one_mesh)
            for backend in backends
            for simd in (sets if backend == "cpu" else ["auto"])
            for tier in tiers
            for detail in (choice.FULL, *(parts if what.of_meshes else ()))
        }
        if variants:
            _measure(report, source, variants, args)
        else:
            report.note(f"{source.name}: has one mesh; which different meshes touch is not asked")
    if not report.rows:
        raise UserError("nothing to measure: --ask names questions about different meshes, and no scene has two")
    check(report)
    caption = "missed, spurious, toc: against the truth of the file, or else against the tier exact"
    show("tiers", COLUMNS, report.rows, caption)
    if bounds:
        choice.choose(report, bounds)
    if args.picture is not None:
        draw(report.rows, Path(args.picture))
    return report


def details(text: str) -> list[float]:
    """Parts of the faces, each in (0, 1), as the text names them. UserError for others, or if meshes cannot be made
    coarse here."""
    found: list[float] = []
    for word in (word.strip() for word in text.split(",") if word.strip()):
        try:
            found.append(float(word))
        except ValueError:
            found.append(math.nan)
        if not 0 < found[-1] < 1:
            raise UserError(f"--detail {text}: {word!r} must be a number above 0 and below 1, as in 0.1")
    if found:
        try:
            simplifier()
        except ImportError as error:
            raise UserError(f"--detail {text}: {error}") from error
    return found


def _measure(report, source, variants, args):
    runners = {}
    for variant, what in variants.items():
        options = dict(zip(("backend", "simd", "accuracy"), variant, strict=False)) | {"threads": args.threads}
        options |= {} if variant[-1] == choice.FULL else {"detail": variant[-1]}
        runners[variant] = measure.Runner(variant, {**options, **what.options}, scene=what.change)
    series = measure.measure(source, list(runners.values()), args.repeat, args.steps)
    steps = {number: source.step(number) for number in next(iter(series.values())).by_step}
    known = {number: step.truth or _exact(step) for number, step in steps.items()}
    for variant, what in variants.items():
        backend, simd, tier, name, detail = variant
        one, errors, deviations = series[variant], [], [0.0]
        for k, true in known.items():
            detector = runners[variant].detector(steps[k])
            found = measure.detect(detector, steps[k])
            faces = None if detail == choice.FULL else detector.faces
            errors.append(what.errors(found, true, steps[k], faces))
            if detail != choice.FULL:
                diagonal = np.linalg.norm(np.ptp(steps[k].vertices_t0.astype(float), axis=0))
                deviations.append(float(found.bounds.max(initial=0.0) / diagonal))
        balanced = series.get((backend, simd, "balanced", name, choice.FULL))
        stats, row = one.stats(), one.row()
        report.add(
            part="scene",
            **{"scene": source.name, "backend": backend, "simd": simd, "accuracy": tier, "asked": name},
            **{"detail": detail, "deviation": max(deviations)},
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
        coarse = r["detail"] != choice.FULL
        text = f"{r['scene']}: {r['accuracy']}{', detail {:g}'.format(r['detail']) if coarse else ''}: {what}"
        if coarse:  # none missed, none late
            if r["accuracy"] in ("exact", "conservative") and (r["missed"] or r["latest"] > 1e-12):
                report.failure(f"{text}, latest by {r['latest']:g}")
            continue
        if r["accuracy"] == "exact" and (r["missed"] or r["invented"] or r["toc_worst"] > 1e-12):
            report.failure(text)
        if r["accuracy"] == "conservative" and (r["missed"] or r["latest"] > 0):
            report.failure(f"{text}, latest by {r['latest']:g}")


def draw(rows: list[dict], path: Path) -> None:
    """Plot, for each scene, the time of each setting against its worst error: the share of missed or of spurious
    contacts, the error of a time in steps, or the deviation as a share of the diagonal. Both axes are logarithmic; what
    has no error is drawn at FLOOR. Settings that ask for the same have one marker, and a line: their Pareto front.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import LogLocator, NullLocator

    from hpccd_core.picture.contacts import as_bytes

    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    down = -(-len(scenes) // 4)
    across = -(-len(scenes) // down)
    page = Figure(figsize=(1.5 + 3 * across, 0.9 + 2.6 * down), layout="constrained")
    FigureCanvasAgg(page)
    axes = page.subplots(down, across, sharey=True, squeeze=False).ravel()
    gray = {"color": "gray", "linestyle": "none"}
    marks = {tier: Line2D([], [], color=f"C{i}", marker="o", linestyle="none") for i, tier in enumerate(ACCURACIES)}
    for backend in sorted({row["backend"] for row in rows} - {"cpu"}):
        marks[f"on {backend}"] = Line2D([], [], marker="o", fillstyle=FILLS[backend], **gray)
    for asked in (a.name for a in choice.ASKED if any(row["asked"] == a.name for row in rows)):
        marks[NAMES.get(asked, asked)] = Line2D([], [], marker=MARKERS[asked], **gray)
    marks["Pareto front"] = Line2D([], [], color="gray", linewidth=1)
    for axis, scene in zip(axes, scenes, strict=False):
        # The least time of a step is disturbed less by other programs than the median.
        mine = [row | {"step_ms": row.get("least_ms", row["step_ms"])} for row in rows if row["scene"] == scene]
        found = choice.outcomes(mine)
        for asked in (a.name for a in choice.ASKED):
            mine = [o for o in found if o.setting.asked == asked]
            _draw_settings(axis, mine)
        axis.set(xscale="log", yscale="log", ylim=(FLOOR / 5, 50))
        axis.set_title(scene, fontsize=9)
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_locator(NullLocator())
        axis.yaxis.set_major_locator(LogLocator(numticks=10))
        axis.tick_params(labelsize=8)
        axis.grid(True, which="major", alpha=0.3)
    for axis in axes[len(scenes) :]:
        axis.set_axis_off()
    page.supxlabel("ms a step, the least of all rounds", fontsize=9)
    page.supylabel(f"largest of missed, spurious, error of a time, deviation ({FLOOR:g}: none)", fontsize=9)
    page.legend(marks.values(), marks, loc="outside right center", fontsize=8)
    try:
        with whole_file(path, overwrite=True) as draft:
            draft.write_bytes(as_bytes(page, draft.suffix, dpi=150))
    except (OSError, ValueError) as error:
        raise UserError(f"--picture {path}: cannot be written: {error}") from error


def _draw_settings(axis, found: list[choice.Outcome]) -> None:
    """Those that ask for the same, and the line through their Pareto front."""
    # The deviation of a coarse mesh is far above all other errors: its marks of all tiers would cover each other.
    best = max((ACCURACIES.index(o.setting.accuracy) for o in found), default=0)
    found = [o for o in found if o.setting.detail == choice.FULL or o.setting.accuracy == ACCURACIES[best]]
    details = sorted({o.setting.detail for o in found})
    for o in found:
        setting, colour = o.setting, f"C{ACCURACIES.index(o.setting.accuracy)}"
        look = {"marker": MARKERS[setting.asked], "fillstyle": FILLS[setting.backend], "markersize": 6}
        axis.plot(o.ms, _worst(o), color=colour, alpha=0.8, linestyle="none", **look)
        if setting.detail != choice.FULL:
            line = details.index(setting.detail)  # labels of marks side by side lie one above the other
            up = -12 - 8 * line if setting.asked == choice.OF_MESHES[-1] else 5 + 8 * line
            place = {"textcoords": "offset points", "xytext": (0, up), "fontsize": 7, "ha": "center"}
            axis.annotate(f"{setting.detail:g}", (o.ms, _worst(o)), **place)
    least, line = math.inf, []
    for o in sorted(found, key=lambda o: (o.ms, _worst(o))):
        if _worst(o) < least:
            least = _worst(o)
            line.append(o)
    axis.plot([o.ms for o in line], [_worst(o) for o in line], color="gray", linewidth=1, zorder=0)


def _worst(o: choice.Outcome) -> float:
    return max(FLOOR, *(o.values[name] for name in ("misses", "spurious", "error", "deviation")))
