# SPDX-License-Identifier: Apache-2.0
"""The node over DDS, as a process of its own: latency from publish to contacts less the core's time, beside an echo
that moves messages of the same types and sizes in and out (in turn, in one run); the loop of a solver that asks
~/detect how far it may go and waits for the answer, beside the same call in process; the highest rate without drops;
and what happens at twice that rate: latest frames answered, every drop counted, memory flat.

  python -m bench ros                           cloth-ball (the file in HPCCD_DATA, else the generated one), cloth-drop
  python -m bench ros cloth-drop --repeat 1000
  python -m bench ros data --seconds 0          latency and loop alone

A step is played there and back again; its meshes are sent as one, in single precision. Fails where contacts or
steps differ from the core's own, a frame is unaccounted for, or the latency exceeds twice that of the echo (--limit).
"""

from __future__ import annotations

import json
import os
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from bench import lab
from bench.lab import bar
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench import sources

NAMESPACE = "/bench"
LARGE, SMALL = "cloth-ball", "cloth-drop"


def configure(parser):
    lab.configure(parser, (LARGE, SMALL), steps=1, rounds=300)
    lab.tier_option(parser, default="exact")
    parser.add_argument(
        "--seconds",
        type=float,
        default=20.0,
        metavar="S",
        help="length of the runs at the highest rate and at twice that; 0: none (default: %(default)s)",
    )
    parser.add_argument(
        "--limit",
        type=float,
        default=2.0,
        metavar="X",
        help="most times the echo's latency, medians (default: %(default)s)",
    )


def run(args) -> lab.Report:
    if args.seconds < 0 or not args.limit > 0:
        raise UserError(f"--seconds {args.seconds}, --limit {args.limit}: must not be negative")
    data = sources.data_folder(args.data)
    if not args.sources and not (data and (data / f"{LARGE}.npz").is_file()):
        args.sources = [f"{LARGE}-like", SMALL]
    # A domain of its own, unless the user names one: other nodes would take part of the machine.
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    report, found = lab.begin(args)
    for source in found:
        for k in source.spread(args.steps):
            if (step := source.step(k)) is None:
                report.note(f"{source.name}, step {k}: a change of topology without motion, passed over")
                continue
            with tempfile.TemporaryDirectory(prefix="hpccd-bench-") as folder:
                _measure(report, args, source.name, step, Path(folder))
    if not report.rows:
        raise UserError("none of the steps has a motion; take more with --steps")
    _tables(report)
    return report


def _measure(report, args, name, step, folder: Path) -> None:
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from bench.ros import node_process, step_loop, timed_node
    from bench.ros.link import MESH, Link
    from hpccd_ros.demo.children import Children
    from hpccd_ros.middleware import environment

    options = {"accuracy": args.accuracy, "threads": args.threads}
    parameters = {**options, "meshes": [MESH], "diagnostics_period": 0.5, "max_contacts": 0}
    os.environ[timed_node.VARIABLE] = str(folder / "times.json")
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("simulator", namespace=NAMESPACE, start_parameter_services=False)
    link = Link(node, step, options)
    row = {
        "scene": name,
        "triangles": link.triangles,
        "contacts": link.contacts,
        "accuracy": args.accuracy,
        "mb_in": link.bytes_in / 1e6,
        "mb_out": link.bytes_out / 1e6,
    }
    try:
        with Children(folder) as children:
            child = node_process.start(children, folder, NAMESPACE, parameters, "bench.ros.timed_node")
            children.start("echo", "bench.ros.echo", NAMESPACE)
            status = node_process.NodeStatus(node, NAMESPACE)
            link.connect(children.check)
            _turns(link, args.repeat, name)
            lanes = {lane.name: (dict(lane.sent), dict(lane.came)) for lane in (link.node, link.echo)}
            loop = step_loop.measure(node, link, name, args.repeat, children.check)
            if args.seconds:
                median = float(np.median(link.node.latencies_ms()))
                _rates(report, args, row, link, status, child.process.pid, children.check, 1e3 / median)
            if children.end(child) != 0:
                children.check()
        times = json.loads((folder / "times.json").read_text(encoding="utf-8"))
    finally:
        link.close()
        node.destroy_node()
        rclpy.try_shutdown()
    if link.wrong:
        report.failure(f"{name}: contacts of {len(link.wrong)} steps differ from the core's own")
    latency = _latency(row, lanes, {entry[0]: entry[1:5] for entry in times})
    rates = len(report.rows) - (2 if args.seconds else 0)  # they stand at the end
    report.rows[rates:rates] = [latency, {"what": "step loop", **row, **loop}]
    if loop["wrong"]:
        report.failure(f"{name}: {loop['wrong']} collision-free steps of ~/detect differ from the core's own")
    if latency["ratio"] > args.limit:
        ratio = f"{latency['ratio']:.2f} times as long as the echo, more than {args.limit:g}"
        report.failure(f"{name}: beside its core the node takes {ratio}")


def _turns(link, rounds: int, name: str) -> None:
    for _ in range(5):
        link.round(link.node)
        link.round(link.echo)
    for lane in (link.node, link.echo):
        lane.clear()
    with bar(f"{name}: latency", rounds) as done:
        for _ in range(rounds):
            link.round(link.node)
            link.round(link.echo)
            done()


def _latency(row: dict, lanes: dict, times: dict) -> dict:
    """Percentiles of what the node adds to its core, of the echo, and of the parts of the former."""
    (sent, came), (echo_sent, echo_came) = lanes["node"], lanes["echo"]
    steps = sorted(came)
    begin, end = (np.array([of[s] for s in steps]) for of in (sent, came))
    received, detected, published, core = np.array([times[s] for s in steps]).T
    echo = 1e3 * np.array([echo_came[s] - at for s, at in echo_sent.items()])
    added = 1e3 * (end - begin) - core
    parts = {
        "in": received - begin,
        "hand over": detected - received - core / 1e3,
        "answer": published - detected,
        # The reader may be faster than the return of the writer's call.
        "out": end - published,
    }
    out = {"what": "latency", **row, "rounds": len(steps)}
    for who, ms in (("node", added), ("echo", echo), ("core", core), ("whole", 1e3 * (end - begin))):
        for key, q in (("median", 50), ("p95", 95), ("p99", 99)):
            out[f"{who}_{key}_ms"] = float(np.percentile(ms, q))
        out[f"{who}_mean_ms"] = float(np.mean(ms))
    for key in ("median", "p95", "p99"):
        out["ratio" if key == "median" else f"ratio_{key}"] = out[f"node_{key}_ms"] / out[f"echo_{key}_ms"]
    out["parts_ms"] = {part: 1e3 * float(np.median(s)) for part, s in parts.items()}
    out["parts_mean_ms"] = {part: 1e3 * float(np.mean(s)) for part, s in parts.items()}
    return out


def _rates(report, args, row, link, status, pid, alive, guess) -> None:
    from bench.ros import rates

    run = partial(rates.trial, link, status, pid, alive)
    with bar(f"{row['scene']}: rate", 12) as done:
        rate = rates.sustained(run, guess, done)
        # What held for a few seconds need not hold for many.
        while (steady := run(rate, args.seconds)).dropped + steady.middleware and rate > guess / 8:
            done()
            rate /= rates.FINER
        link.hold = 2
        double = run(2 * rate, args.seconds)
    for what, found in (("sustained rate", steady), ("twice that rate", double)):
        report.add(
            what=what,
            **row,
            rate_hz=found.rate,
            sent=found.sent,
            answered=found.answered,
            dropped=found.dropped,
            middleware=found.middleware,
            unaccounted=found.unaccounted,
            last_answered=found.last_answered,
            **{f"{key}_ms": ms for key, ms in zip(("median", "p95", "p99"), found.latency, strict=True)},
            memory_begin_mb=found.memory[0],
            memory_end_mb=found.memory[1],
            memory_most_mb=found.memory[2],
            memory_change_percent=found.memory_change,
        )
        if found.unaccounted:
            report.failure(f"{row['scene']}, {what}: {found.unaccounted} frames are not accounted for")
        if not found.last_answered:
            report.failure(f"{row['scene']}, {what}: the last frame was not answered")


def _tables(report) -> None:
    from bench.ros import step_loop

    latency = [row for row in report.rows if row["what"] == "latency"]
    tables.show(
        "publish to contacts, ms: the node less its core, and an echo of the same bytes, in turn",
        ["scene", "MB in", "MB out", "contacts", "core", "node", "p95", "p99", "echo", "p95", "p99", "node / echo"],
        [
            [
                r["scene"],
                r["mb_in"],
                r["mb_out"],
                r["contacts"],
                r["core_median_ms"],
                *(r[f"{who}_{key}_ms"] for who in ("node", "echo") for key in ("median", "p95", "p99")),
                r["ratio"],
            ]
            for r in latency
        ],
    )
    tables.show(
        "where it goes, ms (medians)",
        ["scene", *latency[0]["parts_ms"]],
        [[r["scene"], *r["parts_ms"].values()] for r in latency],
    )
    step_loop.show([row for row in report.rows if row["what"] == "step loop"])
    rates = [row for row in report.rows if "rate_hz" in row]
    if rates:
        tables.show(
            "at a fixed rate",
            [
                "scene",
                "run",
                "Hz",
                "sent",
                "answered",
                "dropped",
                "lost by DDS",
                "unaccounted",
                "latency ms",
                "p95",
                "memory MB",
                "change %",
            ],
            [
                [
                    r["scene"],
                    r["what"],
                    r["rate_hz"],
                    r["sent"],
                    r["answered"],
                    r["dropped"],
                    r["middleware"],
                    r["unaccounted"],
                    r["median_ms"],
                    r["p95_ms"],
                    r["memory_end_mb"],
                    r["memory_change_percent"],
                ]
                for r in rates
            ],
        )
