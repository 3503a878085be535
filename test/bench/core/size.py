# SPDX-License-Identifier: Apache-2.0
"""How time and memory grow with the number of triangles: the same motion, meshed coarser and finer.

  python -m bench size                                two scenes at 1/4, 1 and 4 times the triangles
  python -m bench size n-body-like-lr --sizes 0.25,0.5,1,2,4

The exponent p of time ~ triangles^p is the least-squares slope of log time over log triangles; 1 is linear. Contacts
grow like the triangles in these motions once bodies touch, so the steps are taken from the last part of each.
"""

from __future__ import annotations

import dataclasses

from bench import command
from bench.core import measure
from bench.core.variants import Variant
from bench.report.timing import slope
from hpccd_ros import scenes
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import of_scene

DEFAULT = ("cloth-ball-like", "n-body-like-hr")


def configure(parser):
    command.configure(parser, default=DEFAULT, steps=4, size=False)
    parser.add_argument(
        "--sizes",
        default="0.25,1,4",
        metavar="X,...",
        help="factors on the triangles of each scene (default: %(default)s)",
    )
    parser.add_argument(
        "--last-part",
        type=float,
        default=0.5,
        metavar="P",
        help="steps are spread over this last part of the motion, 0 to 1 (default: %(default)s)",
    )
    parser.add_argument("--threads-list", metavar="N,...", help="default: 1 and all cores")
    command.tier_option(parser)


def run(args) -> int:
    sizes = command.numbers("--sizes", args.sizes, float)
    threads = command.numbers("--threads-list", args.threads_list or f"1,{cores()}", int)
    names = args.sources or list(DEFAULT)
    unknown = [name for name in names if name not in scenes.names()]
    if unknown:
        raise UserError(f"{unknown[0]}: not a generated scene, so it has one size only; see `hpccd scene --list`")
    if not 0 < args.last_part <= 1:
        raise UserError(f"--last-part {args.last_part}: must lie above 0 and not above 1")
    report = command.begin_report(args, names)
    report.note(measure.NOTE)
    for name in names:
        for size in sizes:
            source = _last_part(of_scene(name, size), args.last_part)
            runners = [
                measure.CoreRunner(Variant(f"{n} threads", {"accuracy": args.accuracy, "backend": "cpu", "threads": n}))
                for n in threads
            ]
            series = measure.measure(source, runners, args.repeat, args.steps)
            for text in measure.disagreements(list(series.values())):
                report.failure(f"{source.name}: contacts differ between numbers of threads: {text}")
            for n in threads:
                report.add(**_row(name, size, n, source, series[f"{n} threads"], args))
    slopes = [_slope(report.rows, name, n) for name in names for n in threads] if len(sizes) > 1 else []
    _print(report, slopes)
    for entry in slopes:
        report.note(
            "{scene}, {threads} threads: time ~ triangles^{time:.3f}, contacts ~ triangles^{contacts:.3f}".format(
                **entry
            )
        )
    return command.end(args, report)


def _last_part(source, part):
    begin = source.n_steps - max(1, round(part * source.n_steps))
    return dataclasses.replace(source, n_steps=source.n_steps - begin, step=lambda k: source.step(begin + k))


def _row(name, size, threads, source, series, args):
    step = source.step(next(iter(series.by_step)))
    return {
        "scene": name,
        "size": size,
        "threads": threads,
        "accuracy": args.accuracy,
        "triangles": step.triangles,
        "steps": len(series.by_step),
        "contacts": series.contacts(),
        "candidates": series.candidates(),
        **series.times().as_row(),
        "step_ms": series.sequence_ms() / len(series.by_step),
        "bytes_per_triangle": series.stats()["bytes"] / step.triangles,
        "stages_ms": series.stages(),
    }


def _slope(rows, name, threads):
    mine = [row for row in rows if row["scene"] == name and row["threads"] == threads]
    triangles = [row["triangles"] for row in mine]
    return {
        "scene": name,
        "threads": threads,
        "time": slope(triangles, [row["step_ms"] for row in mine]),
        "contacts": slope(triangles, [max(1, row["contacts"]) for row in mine]),
        "candidates": slope(triangles, [max(1, row["candidates"]) for row in mine]),
    }


def _print(report, slopes):
    tables.show(
        f"time and memory against size ({report.rows[0]['accuracy']})",
        [
            "scene",
            "size",
            "threads",
            "triangles",
            "contacts",
            "candidates",
            "ms a step",
            "us / 1000 triangles",
            "bytes / triangle",
        ],
        [
            [
                r["scene"],
                r["size"],
                r["threads"],
                r["triangles"],
                round(r["contacts"]),
                round(r["candidates"]),
                r["step_ms"],
                1e6 * r["step_ms"] / r["triangles"],
                round(r["bytes_per_triangle"]),
            ]
            for r in report.rows
        ],
        "ms a step: the average over the steps of the median over the rounds",
    )
    if slopes:
        tables.show(
            "exponents over the number of triangles (1: linear)",
            ["scene", "threads", "time", "contacts", "candidates"],
            [[s["scene"], s["threads"], s["time"], s["contacts"], s["candidates"]] for s in slopes],
        )
