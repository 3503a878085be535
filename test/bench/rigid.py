# SPDX-License-Identifier: Apache-2.0
"""Meshes that move by poses and joints: completeness of contacts, tightness of bounds, cost of a step.

  python -m bench rigid                       100,000 random pairs by screws, as many by joints; bounds; cost
  python -m bench rigid --queries 4000 --parts truth
  python -m bench rigid --parts cost --turns 1,10 --tolerances 1e-2,1e-4

truth: a vertex and a face, or two edges, that move by random screws (from next to nothing to half a turn, far from the
origin, about axes near and far) or joints (up to eight that rotate, slide or are fixed; some against each other). Most
are shifted so that their smallest distance is 1e-9 to 1e-3 of their size above or below the requested distance. Each
result is compared with branch and bound over time on the true motion. "missed": false negatives; "late": reported too
late; "beyond": reported although farther apart than the distance plus twice the bound; "open": neither is proven. The
command fails if any of these is not 0. "in excess": false positives within the bound; "worst": the largest excess
distance, divided by the bound.
bounds: the true distance of a vertex from its straight line, divided by the bound, for random rotations of this angle.
cost: a step of a scene with a cloth and rigid meshes, from poses to contacts; a second detector tests the cloth against
itself, once per step. Compared with one detect() of the whole scene with all vertices on straight lines. On a shared
machine, compare the smallest times.
"""

from __future__ import annotations

import numpy as np
from oracle import rigid_tightness
from oracle.rigid_queries import KINDS, MOTIONS, random_queries
from oracle.rigid_results import Verdict, ask, judge

from bench import lab, rigid_cost
from hpccd_ros.base.errors import UserError

PARTS = ("truth", "bounds", "cost")
_BATCH = 1000  # queries at a time: bounds memory
_COUNTS = ("queries", "touching", "apart", "reported", "missed", "late", "beyond", "open", "excess")


_COST = {"scene": "scene", "turn, deg": "turn", "tolerance": lambda row: f"{row['tolerance']:g}", "parts": "parts"}
_COST |= {"bound": "bound", "straight": "linear_ms", "moved": "moved_ms", "/": "over_linear"}
_COST |= {"least: straight": "least_linear_ms", "least: moved": "least_moved_ms", "least: /": "least_over_linear"}
_COST |= {"outside": "least_outside_ms", "contacts": "linear_contacts", "moved contacts": "contacts"}
TABLES = {
    "truth": (
        "random motions against the truth",
        {key: key for key in ("motion", "kind", *_COUNTS) if key not in ("apart", "excess")}
        | {"in excess": "excess", "worst": "worst_excess"},
        "touching: proven to come within the distance, which at 0 cannot be proven; worst: excess over the bound, "
        "of at most 2",
    ),
    "bounds": (
        "true deviation over the bound",
        {"motion": "motion", "turn, rad": "turn", "median": "median", "5 %": "low", "largest": "largest"},
        "",
    ),
    "cost": (
        "a step moved by poses beside the same on straight lines",
        _COST,
        "ms: medians of the rounds, in turn, then the least; outside: of the core; bound: of the pair that has the "
        "greatest",
    ),
}


def configure(parser):
    add = parser.add_argument_group("what is measured").add_argument
    queries = "of truth, for screws and for joints each (default: %(default)s)"
    turns = "of cost: degrees of the body or of each joint (default: %(default)s)"
    tolerances = "of cost; the radius of the ball is 0.5 (default: %(default)s)"
    add("--parts", default=",".join(PARTS), metavar="NAME,...", help="default: %(default)s")
    add("--queries", type=int, default=100_000, metavar="N", help=queries)
    add("--seed", type=int, default=1, metavar="N", help="of truth and bounds (default: %(default)s)")
    add("--turns", default="1,5,20", metavar="DEG,...", help=turns)
    add("--tolerances", default="1e-2,1e-3,1e-4", metavar="D,...", help=tolerances)
    lab.tier_option(parser, "exact")
    lab.configure(parser, rounds=15, leave_out=("data",))


def run(args) -> lab.Report:
    parts = lab.listed("--parts", args.parts, PARTS)
    turns = lab.numbers("--turns", args.turns, float)
    tolerances = lab.numbers("--tolerances", args.tolerances, float)
    if args.queries < 2:
        raise UserError(f"--queries {args.queries}: at least 2")
    report = lab.begin(args)[0]
    if "truth" in parts:
        _truth(report, args)
    if "bounds" in parts:
        for row in rigid_tightness.rows(args.seed):
            report.add(part="bounds", **row)
    if "cost" in parts:
        for row in rigid_cost.rows(turns, tolerances, args):
            report.add(part="cost", **row)
    _print(report)
    return report


def _truth(report, args):
    each = args.queries // len(KINDS)
    with lab.bar("queries", len(MOTIONS) * len(KINDS) * -(-each // _BATCH)) as done:
        for m, motion in enumerate(MOTIONS):
            for k, kind in enumerate(KINDS):
                verdicts: list[Verdict] = []
                seconds = parts = 0.0
                for batch, begin in enumerate(range(0, each, _BATCH)):
                    rng = np.random.default_rng([args.seed, m, k, batch])
                    queries = random_queries(rng, min(_BATCH, each - begin), kind, motion)
                    results = ask(queries)
                    verdicts.append(judge(queries, results))
                    seconds += results.seconds
                    parts += float(results.parts.sum())
                    done()
                row = report.add(
                    part="truth",
                    motion=motion,
                    kind=kind,
                    **{name: sum(getattr(v, name) for v in verdicts) for name in _COUNTS},
                    worst_excess=max(v.worst_excess for v in verdicts),
                    parts=parts / each,
                    us_a_query=1e6 * seconds / each,
                )
                for name in ("missed", "late", "beyond", "open"):
                    if row[name]:
                        report.failure(f"{motion}, {kind}: {row[name]} {name}")


def _print(report):
    of = {part: [row for row in report.rows if row["part"] == part] for part in PARTS}
    for part, (title, columns, caption) in TABLES.items():
        if of[part]:
            lab.show(title, columns, of[part], caption)
