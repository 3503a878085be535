# SPDX-License-Identifier: Apache-2.0
"""The topic stop over DDS, as a StopListener hears it: random approaches of two deforming meshes, each step judged by
brute force; silence after each of them; mesh publisher and node killed and held up. And what it costs beside contacts.

  python -m bench stop                          1,000 approaches and silences, 20 ends of each kind: quarter of an hour
  python -m bench stop --trials 20 --ends 2

Fails where stop misses a step that comes near, rises more than a frame after it, or more than --margin after the
time-out of what has ended.
"""

from __future__ import annotations

import os
import signal
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

from bench import lab
from bench.lab import bar
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables

NAMESPACE = "/bench_stop"
PERCENTILES = (("median", 50), ("p95", 95), ("p99", 99), ("most", 100))


def configure(parser):
    what = parser.add_argument_group("what is measured")
    what.add_argument("--trials", type=int, default=1000, metavar="N", help="approaches (default: %(default)s)")
    what.add_argument(
        "--ends",
        type=int,
        default=20,
        metavar="N",
        help="ends of each kind of publisher and node (default: %(default)s)",
    )
    what.add_argument("--rate", type=float, default=20.0, metavar="HZ", help="frames a second (default: %(default)s)")
    what.add_argument("--stop-timeout", type=float, default=0.5, metavar="S", help="(default: %(default)s)")
    what.add_argument(
        "--margin",
        type=float,
        default=0.1,
        metavar="S",
        help="most that stop may rise after the time-out (default: %(default)s)",
    )
    what.add_argument("--seed", type=int, default=18, help="of the approaches (default: %(default)s)")
    lab.configure(parser, leave_out=("data", "size", "threads", "repeat"))


def run(args) -> lab.Report:
    if args.trials < 1 or args.ends < 0 or not args.rate > 0 or not args.stop_timeout > 2 / args.rate:
        raise UserError("--trials, --rate: must be above 0; --ends: not negative; --stop-timeout: above two frames")
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    report = lab.begin(args)[0]
    with tempfile.TemporaryDirectory(prefix="hpccd-bench-") as folder:
        _measure(report, args, Path(folder))
    _costs(report)
    _tables(report)
    return report


def _measure(report, args, folder: Path) -> None:
    import rclpy
    import stop_scene
    from rclpy.signals import SignalHandlerOptions

    from bench.ros import node_process
    from bench.ros.stop_link import Ears
    from hpccd_ros import client
    from hpccd_ros.demo.children import Children

    parameters = {
        "meshes": list(stop_scene.MESHES),
        "stop_distance": stop_scene.DISTANCE,
        "stop_timeout": args.stop_timeout,
    }
    client.prepare_environment()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("watching", namespace=NAMESPACE, start_parameter_services=False)
    ears = None
    try:
        with Children(folder) as children:
            start = partial(node_process.start, children, folder, NAMESPACE, parameters)
            ears = Ears(node, args.stop_timeout)
            child = start()
            _approaches(report, args, node, ears, children)
            if args.ends:
                _ends(report, args, ears, children, child, start)
    finally:
        if ears is not None:
            ears.close()
        node.destroy_node()
        rclpy.try_shutdown()


def _approaches(report, args, node, ears, children) -> None:
    from bench.ros import node_process, stop_trials
    from bench.ros.stop_link import PATIENCE, Sender

    status = node_process.NodeStatus(node, NAMESPACE)
    sender = Sender(node)
    children.wait(sender.heard, "the node listens", PATIENCE)
    sender.topologies()
    with bar("approaches", args.trials) as done:
        found = stop_trials.approaches(sender, ears, args.trials, args.rate, args.seed, done)
    with bar("truth", len(found.frames) - 1) as done:
        judged = stop_trials.judge(found, ears, args.rate, args.stop_timeout, done)
    report.add(
        what="approaches",
        trials=args.trials,
        steps=judged.steps,
        near=judged.near,
        rises=len(judged.rises),
        late=judged.late,
        missed=judged.missed,
        false=judged.false,
        frame_ms=1e3 / args.rate,
        look_ms=float(status.values.get("stop", {}).get("look_ms", "nan")),
        **_percentiles(judged.rises),
    )
    if judged.missed or judged.late:
        report.failure(f"stop missed {judged.missed} steps that come near, and rose late {judged.late} times")
    _silence(report, args, "silence", found.silences)


def _ends(report, args, ears, children, child, start) -> None:
    from bench.ros import stop_trials
    from hpccd_ros.demo.children import Child

    nodes: list[Child] = [child]

    def begin_source() -> Child:
        return children.start("source", "bench.ros.stop_source", NAMESPACE, str(args.rate))

    sources: list[Child] = [begin_source()]

    def replace(kept: list[Child], begin) -> None:
        kept[0].process.wait()
        children.forget(kept[0])
        kept[0] = begin()

    def goes_on(kept: list[Child]) -> None:
        time.sleep(0.2)
        kept[0].process.send_signal(signal.SIGCONT)

    for what, kept, number, after in (
        ("publisher killed", sources, signal.SIGKILL, partial(replace, sources, begin_source)),
        ("publisher held up", sources, signal.SIGSTOP, partial(goes_on, sources)),
        ("node killed", nodes, signal.SIGKILL, partial(replace, nodes, start)),
        ("node held up", nodes, signal.SIGSTOP, partial(goes_on, nodes)),
    ):
        with bar(what, args.ends) as done:
            taken = stop_trials.ended(ears, lambda kept=kept: kept[0].process, number, args.ends, after, done)
        _silence(report, args, what, taken)


def _costs(report) -> None:
    from bench.ros import stop_cost

    with bar("cost", len(stop_cost.SCENES)) as done:
        for row in stop_cost.rows(done):
            report.add(**row)


def _silence(report, args, what: str, taken: list[float]) -> None:
    beyond = max(taken) - args.stop_timeout
    report.add(
        what=what, trials=len(taken), timeout_ms=1e3 * args.stop_timeout, beyond_ms=1e3 * beyond, **_percentiles(taken)
    )
    if beyond > args.margin:
        report.failure(f"{what}: stop rose {1e3 * beyond:.0f} ms after the time-out")


def _percentiles(seconds: list[float]) -> dict[str, float]:
    ms = 1e3 * np.array(seconds or [float("nan")])
    return {f"{key}_ms": float(np.percentile(ms, q)) for key, q in PERCENTILES}


def _tables(report) -> None:
    costs = [row for row in report.rows if row["what"] == "cost"]
    first, *others = [row for row in report.rows if row["what"] != "cost"]
    tables.show(
        "approaches: from the frame that ends a step which comes near to stop, ms",
        ["trials", "steps", "near", "rises", "median", "p95", "p99", "most", "of a frame", "late", "missed", "false"],
        [
            [
                first[k]
                for k in (
                    "trials",
                    "steps",
                    "near",
                    "rises",
                    "median_ms",
                    "p95_ms",
                    "p99_ms",
                    "most_ms",
                    "frame_ms",
                    "late",
                    "missed",
                    "false",
                )
            ]
        ],
    )
    tables.show(
        "from the end of what went before to stop, ms",
        ["what", "trials", "median", "p95", "most", "stop_timeout", "beyond it"],
        [
            [r[k] for k in ("what", "trials", "median_ms", "p95_ms", "most_ms", "timeout_ms", "beyond_ms")]
            for r in others
        ],
    )
    tables.show(
        "what it costs, ms a step (medians)",
        ["scene", "triangles", "steps", "near", "stop", "contacts", "distances"],
        [
            [r[k] for k in ("scene", "triangles", "steps", "near", "look_ms", "contacts_ms", "distances_ms")]
            for r in costs
        ],
    )
