# SPDX-License-Identifier: Apache-2.0
"""The methods and the instruction sets side by side, with all threads and with one: what each brings, and that none
changes a contact.

  python -m bench methods                        default, published, naive, front; scalar, avx2, avx512, neon
  python -m bench methods cloth-ball --repeat 11

Each row is compared with the first one, the default. The number of node pairs visited and of candidates tested tells
whether a method is faster because it does less, or because it does the same in less time.
"""

from __future__ import annotations

from bench import command
from bench.core import measure
from bench.core.variants import Variant, usable
from hpccd_core import _core
from hpccd_core.options import METHODS, SIMD
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores


def configure(parser):
    command.configure(parser, default=("data", "n-body-like-lr", "cloth-drop"), steps=6)
    parser.add_argument("--methods", default=",".join(METHODS), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument("--simd", metavar="NAME,...", help="default: all that are usable here")
    command.tier_option(parser)
    command.threads_option(parser)


def run(args) -> int:
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    methods, refused = usable("method", command.listed("--methods", args.methods, METHODS), accuracy=args.accuracy)
    command.skipped(report, "method", refused)
    sets = command.listed("--simd", args.simd, SIMD) if args.simd else _core.simd_levels()
    sets, refused = usable("simd", sets, accuracy=args.accuracy)
    command.skipped(report, "instruction set", refused)
    threads = args.threads or cores()
    for source in sources:
        base = {"accuracy": args.accuracy, "backend": "cpu"}
        variants = [Variant("default", {**base, "threads": threads})]
        variants += [Variant(m, {**base, "threads": threads, "method": m}) for m in methods if m != "default"]
        for simd in sets:
            variants += [
                Variant(simd, {**base, "threads": threads, "simd": simd}),
                Variant(f"{simd}, 1 thread", {**base, "threads": 1, "simd": simd}),
            ]
        series = measure.measure(source, [measure.CoreRunner(v) for v in variants], args.repeat, args.steps)
        for text in measure.disagreements(list(series.values())):
            report.failure(f"{source.name}: contacts differ between methods or instruction sets: {text}")
        for variant in variants:
            report.add(**_row(source, variant, series, args))
    _print(report)
    return command.end(args, report)


def _row(source, variant, series, args):
    one = series[variant.name]
    scalar = "scalar, 1 thread" if variant.options["threads"] == 1 else "scalar"
    return {
        "scene": source.name,
        "variant": variant.name,
        "threads": variant.options["threads"],
        "accuracy": args.accuracy,
        "steps": len(one.by_step),
        "contacts": one.contacts(),
        "same_contacts": not measure.disagreements([one, series["default"]]),
        **one.times().as_row(),
        "sequence_ms": one.sequence_ms(),
        "over_default": one.sequence_ms() / series["default"].sequence_ms(),
        "times_faster_than_scalar": (
            series[scalar].sequence_ms() / one.sequence_ms() if "simd" in variant.options and scalar in series else None
        ),
        "stages_ms": one.stages(),
        "node_pairs": one.stats().get("node_pairs"),
        "candidates": one.candidates(),
    }


def _print(report):
    tables.show(
        f"methods and instruction sets ({report.rows[0]['accuracy']})",
        [
            "scene",
            "variant",
            "threads",
            "median ms",
            "p95 ms",
            "time / default",
            "x scalar",
            "elementary ms",
            "node pairs",
            "candidates",
            "same contacts",
        ],
        [
            [
                r["scene"],
                r["variant"],
                r["threads"],
                r["median_ms"],
                r["p95_ms"],
                r["over_default"],
                r["times_faster_than_scalar"],
                r["stages_ms"].get("elementary"),
                _whole(r["node_pairs"]),
                _whole(r["candidates"]),
                r["same_contacts"],
            ]
            for r in report.rows
        ],
        "x scalar: over the scalar code with the same number of threads; counts of an average step",
    )


def _whole(count):
    return None if count is None else round(count)
