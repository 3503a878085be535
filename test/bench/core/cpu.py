# SPDX-License-Identifier: Apache-2.0
"""Table 1 of Kim et al. 2009: ms a frame (average, median, 95th percentile) of each scene, with all threads, and how
they divide among the components of section 6.2. With --peer, the same steps by ipctk in turn, and the ratio.

  python -m bench cpu                            scenes of Table 1's sizes, and the files of HPCCD_DATA
  python -m bench cpu run.mcap --steps 0         every step of a recording
  python -m bench cpu data --peer ipctk          cloth-ball, n-body, ... side by side with ipctk (pip install ipctk)
  python -m bench cpu n-body-like-lr --report all,first,any
                                             what is saved where not every contact is needed

An average step is what a simulation sees; the 95th percentile is what an interactive one must plan for.
"""

from __future__ import annotations

from bench import command
from bench.core import measure
from bench.core.peer_ipctk import NOTE as PEER_NOTE
from bench.core.peer_ipctk import PeerRunner
from bench.core.variants import BACKENDS, Variant, usable
from bench.report.paper import TABLE_1_MS
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import TABLE_1, Step


def configure(parser):
    command.configure(parser, default=("data", *TABLE_1), steps=12)
    parser.add_argument("--backend", default="cpu", metavar="NAME,...", help="of cpu, hybrid, gpu (default: cpu)")
    parser.add_argument(
        "--report", default="all,first", metavar="NAME,...", help="of all, first, any (default: %(default)s)"
    )
    command.tier_option(parser)
    command.threads_option(parser)
    parser.add_argument("--peer", choices=("ipctk",), help="run this peer on the same steps, in turn")


def run(args) -> int:
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    modes = command.listed("--report", args.report, ("all", "first", "any"))
    backends, refused = usable("backend", command.listed("--backend", args.backend, BACKENDS), accuracy=args.accuracy)
    command.skipped(report, "backend", refused)
    if args.peer:
        report.note(PEER_NOTE)
    for source in sources:
        options = {"accuracy": args.accuracy, "threads": args.threads}
        variants = [
            Variant(
                f"{backend} {mode}",
                {**options, "backend": backend, "report": mode},
                Step.as_one_mesh if args.peer else None,
            )
            for backend in backends
            for mode in modes
        ]
        runners = [measure.CoreRunner(variant) for variant in variants]
        if args.peer:
            runners.append(PeerRunner(args.threads or cores()))
        series = measure.measure(source, runners, args.repeat, args.steps)
        _check(report, source, series, backends, modes)
        for runner in runners:
            report.add(**_row(source, series[runner.name], args, runner.name))
        _compare(report.rows, source, modes)
    _print(report, args)
    return command.end(args, report)


def _row(source, series, args, name):
    step = source.step(next(iter(series.by_step)))
    core = name != "ipctk"
    return {
        "scene": source.name,
        "variant": name,
        "backend": name.split()[0],
        "report": name.split()[1] if core else "earliest",
        "accuracy": args.accuracy if core else None,
        "threads": args.threads or cores(),
        "triangles": step.triangles,
        "steps": len(series.by_step),
        "contacts": series.contacts(),
        **series.times().as_row(),
        "sequence_ms": series.sequence_ms(),
        "first_ms": series.first.ms,
        "stages_ms": series.stages(),
        "candidates": series.candidates(),
    }


def _compare(rows, source, modes):
    """How many times faster each variant is than the peer, and than the first mode of its backend."""
    here = [row for row in rows if row["scene"] == source.name]
    peer = next((row for row in here if row["variant"] == "ipctk"), None)
    for row in here:
        if row is peer:
            continue
        base = next(r for r in here if r["variant"] == f"{row['backend']} {modes[0]}")
        row["times_faster_than_" + modes[0]] = base["sequence_ms"] / row["sequence_ms"]
        if peer:
            row["times_faster_than_ipctk"] = peer["sequence_ms"] / row["sequence_ms"]


def _check(report, source, series, backends, modes):
    for mode in modes:
        # "any" may answer with another contact on another backend, but not on this one.
        groups = (
            [[series[f"{b} {mode}"]] for b in backends]
            if mode == "any"
            else [[series[f"{b} {mode}"] for b in backends]]
        )
        for group in groups:
            for text in measure.disagreements(group):
                report.failure(f"{source.name}: report={mode}: contacts differ between calls or backends: {text}")


def _print(report, args):
    peer = any(row["variant"] == "ipctk" for row in report.rows)
    rows = [
        [
            row["scene"],
            row["variant"],
            row["triangles"],
            row["contacts"],
            row["average_ms"],
            row["median_ms"],
            row["p95_ms"],
            row["first_ms"],
            TABLE_1_MS.get(row["scene"]),
            *([row.get("times_faster_than_ipctk")] if peer else []),
        ]
        for row in report.rows
    ]
    tables.show(
        f"ms a step, {args.accuracy}, {args.threads or cores()} threads (Table 1)",
        [
            "scene",
            "variant",
            "triangles",
            "contacts",
            "average",
            "median",
            "p95",
            "first call",
            "2009",
            *(["x ipctk"] if peer else []),
        ],
        rows,
        "2009: the paper's machine (4 cores, 2 GPUs) on its own scene; first call: with a new detector",
    )
    stages = list(dict.fromkeys(s for r in report.rows for s in r["stages_ms"]))
    tables.show(
        "where the time goes, ms of an average step (section 6.2)",
        ["scene", "variant", *stages],
        [[r["scene"], r["variant"], *(r["stages_ms"].get(s) for s in stages)] for r in report.rows],
    )
