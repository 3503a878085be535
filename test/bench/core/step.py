# SPDX-License-Identifier: Apache-2.0
"""What it costs to know how far one may go: all contacts, the first ones, the collision-free step, and trial steps from
a start that is known. With --peer, the earliest time of ipctk in turn.

  python -m bench step                        the files of HPCCD_DATA, twisted rods, pieces that swarm
  python -m bench step cloth-ball --peer ipctk   side by side with ipctk (pip install ipctk)
  python -m bench step run.mcap --steps 8
  python -m bench step data --backend gpu --arrays device   positions lie on the GPU (torch or cupy)

all: detect() with report="all"; first: with report="first"; step: collision_free_step(). Of these no call begins where
the one before did: two starts take turns, the step as it is and the same shifted by a sixteenth of its size, so that a
detector cannot use what it knows of a start. trial: collision_free_step() as a line search asks, from one start all the
time: the whole step, three quarters and half of it, and one turned by 5 degrees, in turn, after a few that are not
timed, of which the second lists what is near: "listing". "/ all" is the time over that of all. A step with contacts at
its start ends at once: look at "earliest".
"""

from __future__ import annotations

import statistics

from bench import command
from bench.core import measure, peer_ipctk
from bench.core.device_arrays import to_device
from bench.core.step_queries import ALL, QUERIES, StepRunner, contradictions
from bench.core.variants import BACKENDS, usable
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import Step

SCENES = ("rod-twist-like", "n-body-like-lr")
PEER = peer_ipctk.PeerRunner.name


def configure(parser):
    command.configure(parser, default=("data", *SCENES), steps=4)
    parser.add_argument("--backend", default="cpu", choices=BACKENDS, help="default: %(default)s")
    parser.add_argument(
        "--arrays", choices=("host", "device"), default="host", help="where the positions lie (default: %(default)s)"
    )
    command.tier_option(parser, default="exact")
    command.threads_option(parser)
    parser.add_argument("--peer", choices=(PEER,), help="ask this peer for the earliest time of the same, in turn")


def run(args) -> int:
    if args.arrays == "device" and (args.backend != "gpu" or args.peer):
        raise UserError("--arrays device: needs --backend gpu, and no --peer: only a device reads them there")
    _, refused = usable("backend", [args.backend], accuracy=args.accuracy)
    if refused:
        raise UserError(f"--backend {args.backend}: {refused[args.backend]}")
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    if args.peer:
        report.note(peer_ipctk.NOTE)
    options = {"accuracy": args.accuracy, "backend": args.backend, "threads": args.threads}
    change = Step.as_one_mesh if args.peer else to_device if args.arrays == "device" else None
    for source in sources:
        runners = [StepRunner(query, options, change) for query in QUERIES]
        peers = [peer_ipctk.PeerRunner(args.threads or cores())] if args.peer else []
        series = measure.measure(source, [*runners, *peers], args.repeat, args.steps)
        for text in contradictions(runners, args.accuracy):
            report.failure(f"{source.name}: {text}")
        for runner in runners:
            report.add(**_row(source, runner, series, args))
    _print(report, args)
    return command.end(args, report)


def _row(source, runner, series, args):
    one, every, peer = series[runner.query], series[ALL], series.get(PEER)
    step = source.step(next(iter(one.by_step)))
    row = {
        "scene": source.name,
        "query": runner.query,
        "backend": args.backend,
        "arrays": args.arrays,
        "accuracy": args.accuracy,
        "threads": args.threads or cores(),
        "triangles": step.triangles,
        "steps": len(one.by_step),
        "contacts": one.contacts(),
        "earliest": sum(runner.earliest.values()) / len(runner.earliest),
        **one.times().as_row(),
        "step_ms": one.step_ms(),
        "least_ms": one.least_ms(),
        "over_all": one.step_ms() / every.step_ms(),
        "least_over_all": one.least_ms() / every.least_ms(),
        "stages_ms": one.stages(),
    }
    if runner.listing_ms:
        row |= {"listing_ms": statistics.median(runner.listing_ms)}
    if peer and runner.query != ALL:
        row |= {
            "ipctk_ms": peer.step_ms(),
            "ipctk_least_ms": peer.least_ms(),
            "times_faster_than_ipctk": peer.step_ms() / one.step_ms(),
        }
    return row


def _print(report, args):
    tables.show(
        f"how far a step may go, {args.accuracy}, {args.backend}, {args.threads or cores()} threads",
        [
            "scene",
            "query",
            "contacts",
            "earliest",
            "ms",
            "least",
            "/ all",
            "least",
            "listing",
            *(["ipctk ms", "x ipctk"] if args.peer else []),
        ],
        [
            [
                row["scene"],
                row["query"],
                row["contacts"] if row["query"] in ("all", "first") else None,
                row["earliest"],
                row["step_ms"],
                row["least_ms"],
                row["over_all"],
                row["least_over_all"],
                row.get("listing_ms"),
                *([row.get("ipctk_ms"), row.get("times_faster_than_ipctk")] if args.peer else []),
            ]
            for row in report.rows
        ],
        "ms: an average step, the median over the rounds, then the least; earliest: time, an average over the steps",
    )
