# SPDX-License-Identifier: Apache-2.0
"""Fig. 6 and Fig. 7 of Kim et al. 2009: time and speed-up over one thread against the number of threads, for each
method on each scene, and the speed-up of the components of section 6.2.

  python -m bench scaling                        1, 2, 4, ... threads up to all cores; generated and data scenes
  python -m bench scaling n-body-like-lr --threads-list 1,2,3,4 --methods default,naive

Methods: default (what a Detector does unless told otherwise), published (sections 3 and 4 of the paper), naive
(section 3.2: one shared queue) and front (Tang et al. 2009, with which section 6.3 compares). The speed-up of a method
is over itself with one thread; parallel efficiency is the speed-up divided by the number of threads. All variants must
find the same contacts: the hashes are compared. Beside them stands what the machine gives ("independent"): the same
step by as many detectors of one thread each, all at once, which share nothing.
"""

from __future__ import annotations

from bench import command
from bench.core import measure
from bench.core.independent import METHOD as INDEPENDENT
from bench.core.independent import IndependentRunner
from bench.core.variants import Variant, usable
from hpccd_core.options import METHODS
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import TABLE_1

# The components of section 6.2, by the stages of Detector.profile.
COMPONENTS = {
    "update": ("bounds", "refit", "build"),
    "traversal and tests": ("traverse", "elementary"),
    "rest": ("contacts", "other", "outside"),
}


def configure(parser):
    command.configure(parser, default=("data", *TABLE_1), steps=6)
    parser.add_argument(
        "--methods",
        default=",".join(METHODS),
        metavar="NAME,...",
        help="those this build lacks are left out, and named (default: %(default)s)",
    )
    parser.add_argument("--threads-list", metavar="N,...", help="default: 1, 2, 4, ... and all cores")
    parser.add_argument("--backend", default="cpu", choices=("cpu", "hybrid"), help="default: %(default)s")
    command.tier_option(parser)


def run(args) -> int:
    methods = command.listed("--methods", args.methods, METHODS)
    counts = _thread_counts(args.threads_list)
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    methods, refused = usable("method", methods, accuracy=args.accuracy, backend=args.backend)
    command.skipped(report, "method", refused)
    if not methods:
        raise UserError(f"nothing to measure: {'; '.join(refused.values())}")
    if max(counts) > cores():
        report.note(f"more threads than the {cores()} cores: no speed-up can be expected beyond them")
    for source in sources:
        variants = {
            (method, n): Variant(
                f"{method}, {n} threads",
                {"accuracy": args.accuracy, "backend": args.backend, "threads": n, "method": method},
            )
            for method in methods
            for n in counts
        }
        runners = [measure.CoreRunner(variant) for variant in variants.values()]
        independent = _independent(args, methods, counts)
        series = measure.measure(source, [*runners, *independent.values()], args.repeat, args.steps)
        for text in measure.disagreements(list(series.values())):
            report.failure(f"{source.name}: contacts differ between methods or numbers of threads: {text}")
        for method in methods:
            alone = series[variants[method, counts[0]].name] if counts[0] == 1 else None
            for n in counts:
                report.add(**_row(source, method, n, series[variants[method, n].name], alone, args))
        for n, runner in independent.items():
            alone = series[variants["default", 1].name]
            report.add(**_row(source, INDEPENDENT, n, series[runner.name], alone, args))
            runner.close()
    _print(report)
    return command.end(args, report)


def _independent(args, methods, counts):
    """By number of detectors; none where nothing tells how long one takes on its own."""
    if args.backend != "cpu" or "default" not in methods or 1 not in counts:
        return {}
    return {n: IndependentRunner(n, {"accuracy": args.accuracy, "backend": "cpu"}) for n in counts if n > 1}


def _thread_counts(text):
    if text is None:
        doubling = [1 << k for k in range(cores().bit_length()) if 1 << k <= cores()]
        return sorted({*doubling, cores()})
    return command.numbers("--threads-list", text, int)


def _row(source, method, threads, series, alone, args):
    step = source.step(next(iter(series.by_step)))
    stages = series.stages()
    row = {
        "scene": source.name,
        "method": method,
        "backend": args.backend,
        "threads": threads,
        "accuracy": args.accuracy,
        "triangles": step.triangles,
        "steps": len(series.by_step),
        "contacts": series.contacts(),
        **series.times().as_row(),
        "sequence_ms": series.sequence_ms(),
        "stages_ms": stages,
    }
    if alone:
        at_once = threads if method == INDEPENDENT else 1
        speedup = at_once * alone.sequence_ms() / series.sequence_ms()
        row |= {"speedup": speedup, "efficiency": speedup / threads}
    if alone and stages:
        before, after = components(alone.stages()), components(stages)
        row["component_speedup"] = {name: before[name] / after[name] for name in COMPONENTS if after[name] > 0}
    return row


def components(stages: dict[str, float]) -> dict[str, float]:
    """ms of each component."""
    return {name: sum(stages.get(stage, 0.0) for stage in parts) for name, parts in COMPONENTS.items()}


def _print(report):
    given = {(r["scene"], r["threads"]): r["speedup"] for r in report.rows if r["method"] == INDEPENDENT}

    def of_given(row):
        most = given.get((row["scene"], row["threads"]))
        return row["speedup"] / most if most else None

    tables.show(
        f"speed-up over one thread ({report.rows[0]['accuracy']})",
        ["scene", "method", "threads", "median ms", "p95 ms", "speed-up", "efficiency", "of independent", *COMPONENTS],
        [
            [
                r["scene"],
                r["method"],
                r["threads"],
                r["median_ms"],
                r["p95_ms"],
                r.get("speedup"),
                r.get("efficiency"),
                of_given(r),
                *(r.get("component_speedup", {}).get(name) for name in COMPONENTS),
            ]
            for r in report.rows
        ],
        "median and p95 over all steps and rounds; speed-up of the sequence of steps, then of its components; "
        "independent: as many detectors of one thread each at once, which share nothing: what the machine gives",
    )
