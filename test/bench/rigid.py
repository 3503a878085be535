# SPDX-License-Identifier: Apache-2.0
"""Meshes that move by poses and by joints: are their contacts found, how good are the bounds, what does a step cost.

  python -m bench rigid                       100,000 random pairs by screws, as many by joints; bounds; cost
  python -m bench rigid --queries 4000 --parts truth
  python -m bench rigid --parts cost --turns 1,10 --tolerances 1e-2,1e-4

truth: a vertex and a face, or two edges, that move by random screws (from next to nothing to half a turn, far from the
origin, about axes near and far) or joints (up to eight that turn, slide or are fixed; some against each other), most of
them shifted so that they come 1e-9 to 1e-3 of their size nearer or less near than the distance asked for. Each answer
is held against branch and bound over time on the true motion. "missed": reported free though they come that near;
"late": reported later than that; "beyond": reported though farther apart than the distance and twice the bound; "open":
neither proven. Where any of these is not 0 the command fails. "in excess" is what is reported without coming that near,
"worst": how much farther apart they were at most, over the bound.
bounds: how far a vertex really is from its straight line, over the bound, for random motions of about that turn.
cost: a step of a scene with a cloth and rigid meshes, moved by poses or joints: everything from poses to contacts, the
cloth with itself in a detector of its own, which is asked once a step. Beside it one detect() of all of it with the
vertices of rigid meshes on straight lines, their positions given. On a machine that others use look at the least times.
"""

from __future__ import annotations

import numpy as np
from oracle import rigid_tightness
from oracle.rigid_answers import Verdict, ask, judge
from oracle.rigid_queries import KINDS, MOTIONS, random_queries

from bench import lab, rigid_cost
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables

PARTS = ("truth", "bounds", "cost")
_BATCH = 1000  # queries at a time: bounds memory
_COUNTS = ("queries", "touching", "apart", "reported", "missed", "late", "beyond", "open", "excess")


def configure(parser):
    what = parser.add_argument_group("what is measured")
    what.add_argument("--parts", default=",".join(PARTS), metavar="NAME,...", help="default: %(default)s")
    what.add_argument(
        "--queries",
        type=int,
        default=100_000,
        metavar="N",
        help="of truth, for screws and for joints each (default: %(default)s)",
    )
    what.add_argument("--seed", type=int, default=1, metavar="N", help="of truth and bounds (default: %(default)s)")
    what.add_argument(
        "--turns",
        default="1,5,20",
        metavar="DEG,...",
        help="of cost: degrees of the body or of each joint (default: %(default)s)",
    )
    what.add_argument(
        "--tolerances",
        default="1e-2,1e-3,1e-4",
        metavar="D,...",
        help="of cost; the radius of the ball is 0.5 (default: %(default)s)",
    )
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
                    answers = ask(queries)
                    verdicts.append(judge(queries, answers))
                    seconds += answers.seconds
                    parts += float(answers.parts.sum())
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
    if of["truth"]:
        shown = ("motion", "kind", *(name for name in _COUNTS if name != "apart"), "worst_excess")
        tables.show(
            "random motions against the truth",
            [{"excess": "in excess", "worst_excess": "worst"}.get(name, name) for name in shown],
            [[row[name] for name in shown] for row in of["truth"]],
            "touching: proven to come within the distance, which at 0 cannot be proven; worst: excess over the bound, "
            "of at most 2",
        )
    if of["bounds"]:
        tables.show(
            "true deviation over the bound",
            ["motion", "turn, rad", "median", "5 %", "largest"],
            [[row["motion"], row["turn"], row["median"], row["low"], row["largest"]] for row in of["bounds"]],
        )
    if of["cost"]:
        tables.show(
            "a step moved by poses beside the same on straight lines",
            [
                "scene",
                "turn, deg",
                "tolerance",
                "parts",
                "bound",
                "straight",
                "moved",
                "/",
                "least: straight",
                "moved",
                "/",
                "outside",
                "contacts",
                "moved",
            ],
            [
                [
                    row["scene"],
                    row["turn"],
                    f"{row['tolerance']:g}",
                    row["parts"],
                    row["bound"],
                    row["linear_ms"],
                    row["moved_ms"],
                    row["over_linear"],
                    row["least_linear_ms"],
                    row["least_moved_ms"],
                    row["least_over_linear"],
                    row["least_outside_ms"],
                    row["linear_contacts"],
                    row["contacts"],
                ]
                for row in of["cost"]
            ],
            "ms: medians of the rounds, in turn, then the least; outside: of the core; bound: of the pair that has the "
            "greatest",
        )
