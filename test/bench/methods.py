# SPDX-License-Identifier: Apache-2.0
"""The methods and the instruction sets compared, with all threads and with one. None changes a contact.

  python -m bench methods                        default, published, naive, front; scalar, avx2, avx512, neon
  python -m bench methods cloth-ball --repeat 11

Node pairs and candidates show whether a method does less work, or the same work in less time.
"""

from __future__ import annotations

from bench import lab
from hpccd_core import _core
from hpccd_core.options import METHODS, SIMD
from hpccd_ros.bench.measure import Runner

COLUMNS = {
    "scene": "scene",
    "variant": "variant",
    "threads": "threads",
    "ms a step": "step_ms",
    "time / default": "over_base",
    "node pairs": lab.whole("node_pairs"),
    "candidates": lab.whole("candidates"),
}


def configure(parser):
    lab.configure(parser, ("data", "n-body-like-lr", "cloth-drop"), steps=6)
    parser.add_argument("--methods", default=",".join(METHODS), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument("--simd", metavar="NAME,...", help="default: all that are usable here")
    lab.tier_option(parser)


def run(args) -> lab.Report:
    methods = lab.listed("--methods", args.methods, METHODS)
    sets = lab.listed("--simd", args.simd, SIMD) if args.simd else _core.simd_levels()
    sets, rejected = lab.usable("simd", sets, accuracy=args.accuracy)
    result, sources = lab.begin(args)
    lab.skipped(result, "instruction set", rejected)
    threads = args.threads or lab.cores()
    variants = {"default": {}} | {m: {"method": m} for m in methods}
    variants |= {simd: {"simd": simd} for simd in sets}
    variants |= {f"{simd}, 1 thread": {"simd": simd, "threads": 1} for simd in sets}
    base = {"accuracy": args.accuracy, "backend": "cpu", "threads": threads}
    for source in sources:
        runners = [Runner(name, {**base, **options}) for name, options in variants.items()]
        asked = {r.name: {"variant": r.name, "threads": r.options["threads"]} for r in runners}
        lab.compare(result, args, source, runners, "default", asked)
    lab.show(f"methods and instruction sets ({args.accuracy})", COLUMNS, result.rows, "counts of an average step")
    return result
