# SPDX-License-Identifier: Apache-2.0
"""What distance queries cost beside plain detection: detection with a separation d and proximity within d, against d;
intersections and smallest distances. With --peer, the same questions to ipctk in turn.

  python -m bench distance                       the files of HPCCD_DATA, twisted rods, a body between rollers
  python -m bench distance cloth-ball --separations 1e-3,1e-2
  python -m bench distance data --peer ipctk     side by side with ipctk (pip install ipctk)
  python -m bench distance run.mcap --queries proximity --steps 8
  python -m bench distance data --backend gpu --arrays device   positions on the GPU (torch or cupy)

Choose d by the scene: in its own units, below its shortest edges. Where none is given, those beyond the median edge of
a scene are left out there: nearly all neighbours are that near. "/ plain" is the time over that of plain detection of
the same step. More pairs take longer by themselves. So where an answer holds more of them than there are contacts (of a
separation: than 1.5 times the contacts), "us a pair more" is what each further one takes of a thread, of the time above
half of plain detection (of a separation: above twice of it). Queries of one snapshot read the end of the step. All run
in turn in one process, each with a detector of its own; on a machine that others use as well, look at the least times.
"""

from __future__ import annotations

import math

import numpy as np

from bench import command
from bench.core import measure, peer_ipctk_distance
from bench.core.device_arrays import to_device
from bench.core.distance_queries import ALLOWED, PLAIN, QUERIES, questions
from bench.core.peer_ipctk_distance import DistancePeer
from bench.core.variants import BACKENDS, usable
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import Step

SCENES = ("rod-twist-like", "armadillo-like")
SEPARATIONS = "1e-5,1e-4,1e-3,1e-2"


def configure(parser):
    command.configure(parser, default=("data", *SCENES), steps=2)
    parser.add_argument(
        "--separations",
        metavar="D,...",
        help="distances, of proximity too, in units of the scene (default: of "
        f"{SEPARATIONS} those up to its median edge)",
    )
    parser.add_argument("--queries", default=",".join(QUERIES), metavar="NAME,...", help="default: %(default)s")
    parser.add_argument("--backend", default="cpu", choices=BACKENDS, help="default: %(default)s")
    parser.add_argument(
        "--arrays", choices=("host", "device"), default="host", help="where the positions lie (default: %(default)s)"
    )
    command.tier_option(parser, default="exact")
    command.threads_option(parser)
    parser.add_argument("--peer", choices=("ipctk",), help="ask this peer the same of the same steps, in turn")


def run(args) -> int:
    distances = _distances(SEPARATIONS if args.separations is None else args.separations)
    queries = command.listed("--queries", args.queries, QUERIES)
    if args.arrays == "device" and (args.backend != "gpu" or args.peer):
        raise UserError("--arrays device: needs --backend gpu, and no --peer: only a device reads them there")
    _, refused = usable("backend", [args.backend], accuracy=args.accuracy)
    if refused:
        raise UserError(f"--backend {args.backend}: {refused[args.backend]}")
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    if args.peer:
        report.note(peer_ipctk_distance.NOTE)
    threads = args.threads or cores()
    options = {"accuracy": args.accuracy, "backend": args.backend, "threads": args.threads}
    for source in sources:
        chosen = distances if args.separations is not None else _up_to_the_median_edge(source, distances, report)
        asked = questions(queries, chosen)
        of_peer = [q for q in asked if q.query in peer_ipctk_distance.QUERIES] if args.peer else []
        change = Step.as_one_mesh if args.peer else to_device if args.arrays == "device" else None
        runners = [measure.CoreRunner(question.variant(options, change), question.ask) for question in asked]
        runners += [DistancePeer(question, threads) for question in of_peer]
        series = measure.measure(source, runners, args.repeat, args.steps)
        for question in asked:
            for text in measure.disagreements([series[question.name]]):
                report.failure(f"{source.name}: {question.name}: answers differ between calls: {text}")
        for question in asked:
            report.add(**_row(source, question, series, args))
    _print(report, args)
    return command.end(args, report)


def _distances(text):
    try:
        found = sorted({float(word) for word in text.split(",")})
    except ValueError as error:
        raise UserError(f"--separations {text}: numbers with commas between, for example 1e-3,1e-2") from error
    if not all(0 < d < math.inf for d in found):
        raise UserError(f"--separations {text}: each distance must be above 0 and finite")
    return found


def _up_to_the_median_edge(source, distances, report):
    step = next(step for step in map(source.step, source.spread(0)) if step is not None)
    edge = _median_edge(step)
    if beyond := [f"{d:g}" for d in distances if d > edge]:
        report.note(
            f"{source.name}: d {', '.join(beyond)} left out, beyond its median edge of {edge:.2g}; "
            "--separations asks for any"
        )
    return [d for d in distances if d <= edge]


def _row(source, question, series, args):
    one, plain, peer = series[question.name], series[PLAIN], series.get(f"ipctk {question.name}")
    threads = args.threads or cores()
    step = source.step(next(iter(one.by_step)))
    row = {
        "scene": source.name,
        "query": question.query,
        "distance": question.distance,
        "backend": args.backend,
        "arrays": args.arrays,
        "accuracy": args.accuracy,
        "threads": threads,
        "triangles": step.triangles,
        "median_edge": _median_edge(step),
        "steps": len(one.by_step),
        "pairs": one.contacts(),
        **one.times().as_row(),
        "step_ms": one.step_ms(),
        "least_ms": one.least_ms(),
        "over_plain": one.step_ms() / plain.step_ms(),
        "least_over_plain": one.least_ms() / plain.least_ms(),
        "stages_ms": one.stages(),
    }
    if question.query in ALLOWED:
        row["us_a_pair_beyond"] = ALLOWED[question.query].us_a_pair_beyond(
            one.step_ms(), one.contacts(), plain.step_ms(), plain.contacts(), threads
        )
    if peer:
        row |= {
            "ipctk_ms": peer.step_ms(),
            "ipctk_least_ms": peer.least_ms(),
            "ipctk_pairs": peer.contacts(),
            "times_faster_than_ipctk": peer.step_ms() / one.step_ms(),
        }
    return row


def _median_edge(step):
    faces, xyz = step.faces(), step.vertices_t1
    return float(np.median(np.linalg.norm(xyz[faces] - xyz[np.roll(faces, 1, axis=1)], axis=2)))


def _print(report, args):
    tables.show(
        f"distance queries, {args.accuracy}, {args.backend}, {args.threads or cores()} threads",
        [
            "scene",
            "query",
            "d",
            "pairs",
            "ms",
            "least",
            "/ plain",
            "least",
            "us a pair more",
            *(["ipctk ms", "x ipctk"] if args.peer else []),
        ],
        [
            [
                row["scene"],
                row["query"],
                "" if row["distance"] is None else f"{row['distance']:g}",
                round(row["pairs"]),
                row["step_ms"],
                row["least_ms"],
                row["over_plain"],
                row["least_over_plain"],
                row.get("us_a_pair_beyond"),
                *([row.get("ipctk_ms"), row.get("times_faster_than_ipctk")] if args.peer else []),
            ]
            for row in report.rows
        ],
        "ms: an average step, the median over the rounds, then the least; pairs of distances: pairs of meshes; "
        "us a pair more: of a thread, beyond the contacts (separation: 1.5 times the contacts)",
    )
