# SPDX-License-Identifier: Apache-2.0
"""ms per step of each scene (average, median, 95th percentile), and of each stage.

  hpccd bench cpu n-body-like-lr            a generated scene, in under a minute
  hpccd bench cpu run.mcap --steps 0        every step of a recording
  hpccd bench cpu part.obj                  a mesh file, with a copy that moves through it
  hpccd bench cpu run.mcap --report all,first,any
                                            the time saved if not every contact is needed

The average predicts the total time of a simulation; use the 95th percentile for interactive programs.
"""

from __future__ import annotations

from hpccd_ros.bench import command, measure
from hpccd_ros.bench.report import Report, cores, show
from hpccd_ros.bench.sources import TABLE_1

COLUMNS = {key.removesuffix("_ms"): key for key in ("scene", "variant", "triangles", "contacts")}
COLUMNS |= {key.removesuffix("_ms"): key for key in ("average_ms", "median_ms", "p95_ms", "first_ms")}


def configure(parser):
    command.configure(parser, default=("data", *TABLE_1), steps=12)
    add = parser.add_argument
    add("--backend", default="cpu", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu)")
    add("--report", default="all,first", metavar="NAME,...", help="of all, first, any (default: %(default)s)")
    command.tier_option(parser)


def run(args) -> Report:
    modes = command.listed("--report", args.report, ("all", "first", "any"))
    backends, rejected = command.usable("backend", args.backend, measure.BACKENDS, accuracy=args.accuracy)
    report, found = command.begin(args)
    report.note(measure.NOTE)
    command.skipped(report, "backend", rejected)
    options, threads = {"accuracy": args.accuracy, "threads": args.threads}, args.threads or cores()
    asked = {f"{backend} {mode}": {"backend": backend, "report": mode} for backend in backends for mode in modes}
    for source in found:
        runners = [measure.Runner(name, options | of) for name, of in asked.items()]
        series = measure.measure(source, runners, args.repeat, args.steps)
        for mode in modes:
            of_mode = {name: one for name, one in series.items() if asked[name]["report"] == mode}
            # "any" may find another contact on another backend, but not on the same one.
            for group in [{name: one} for name, one in of_mode.items()] if mode == "any" else [of_mode]:
                for text in measure.disagreements(group):
                    report.failure(f"{source.name}: report={mode}: contacts differ between calls or backends: {text}")
        triangles = source.first().triangles
        for name, one in series.items():
            of = {**asked[name], **options, "threads": threads, "triangles": triangles}
            report.add(scene=source.name, variant=name, **of, **one.row())
    caption = "contacts: of an average step; first: the first call of a new detector"
    show(f"ms a step, {args.accuracy}, {threads} threads", COLUMNS, report.rows, caption)
    stages = dict.fromkeys(stage for row in report.rows for stage in row["stages_ms"] if stage != "total")
    columns = {stage: lambda row, stage=stage: row["stages_ms"].get(stage) for stage in stages}
    show("where the time goes, ms of an average step", {"scene": "scene", "variant": "variant", **columns}, report.rows)
    return report
