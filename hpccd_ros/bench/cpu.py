# SPDX-License-Identifier: Apache-2.0
"""ms a step of each scene (average, median, 95th percentile), and the stages that they divide into.

  hpccd bench cpu n-body-like-lr            a generated scene, in under a minute
  hpccd bench cpu run.mcap --steps 0        every step of a recording
  hpccd bench cpu part.obj                  a mesh file, through which a copy of it moves
  hpccd bench cpu run.mcap --report all,first,any
                                            the time saved where not every contact is needed

An average step is the load of a simulation; plan an interactive one for the 95th percentile.
"""

from __future__ import annotations

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command, measure
from hpccd_ros.bench.report import Report, cores, show
from hpccd_ros.bench.sources import TABLE_1

COLUMNS = ("scene", "variant", "triangles", "contacts", "average_ms", "median_ms", "p95_ms", "first_ms")


def configure(parser):
    command.configure(parser, default=("data", *TABLE_1), steps=12)
    add = parser.add_argument
    add("--backend", default="cpu", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu)")
    add("--report", default="all,first", metavar="NAME,...", help="of all, first, any (default: %(default)s)")
    command.tier_option(parser)


def run(args) -> Report:
    modes = command.listed("--report", args.report, ("all", "first", "any"))
    names = command.listed("--backend", args.backend, measure.BACKENDS)
    backends, refused = measure.usable("backend", names, accuracy=args.accuracy)
    if not backends:
        raise UserError(f"--backend {args.backend}: none of these works here; see `hpccd info`")
    report, found = command.begin(args)
    report.note(measure.NOTE)
    command.skipped(report, "backend", refused)
    for source in found:
        options = {"accuracy": args.accuracy, "threads": args.threads}
        runners = [
            measure.Runner(f"{backend} {mode}", {**options, "backend": backend, "report": mode})
            for backend in backends
            for mode in modes
        ]
        series = measure.measure(source, runners, args.repeat, args.steps)
        for mode in modes:
            of_mode = {f"{b} {mode}": series[f"{b} {mode}"] for b in backends}
            # "any" may find another contact on another backend, but not on the same one.
            for group in [{name: one} for name, one in of_mode.items()] if mode == "any" else [of_mode]:
                for text in measure.disagreements(group):
                    report.failure(f"{source.name}: report={mode}: contacts differ between calls or backends: {text}")
        triangles = source.first().triangles
        for name, one in series.items():
            backend, mode = name.split()
            asked = {"backend": backend, "report": mode, "accuracy": args.accuracy, "threads": args.threads or cores()}
            report.add(scene=source.name, variant=name, **asked, triangles=triangles, **one.row())
    show(
        f"ms a step, {args.accuracy}, {args.threads or cores()} threads",
        [head.removesuffix("_ms") for head in COLUMNS],
        [[row[key] for key in COLUMNS] for row in report.rows],
        "contacts: of an average step; first: the first call of a new detector",
    )
    stages = list(dict.fromkeys(stage for row in report.rows for stage in row["stages_ms"] if stage != "total"))
    show(
        "where the time goes, ms of an average step",
        ["scene", "variant", *stages],
        [[r["scene"], r["variant"], *(r["stages_ms"].get(s) for s in stages)] for r in report.rows],
    )
    return report
