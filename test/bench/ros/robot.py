# SPDX-License-Identifier: Apache-2.0
"""A robot beside a cloth over DDS: the scene arm-and-cloth streamed at a rate, the arm as its joint states; how many
steps are answered, and how long after the frame was sent: in all, in the detection, in its core, and beside the core.
The table, which stands still, is sent once, as node.md asks for.

  python -m bench robot                         1,501 frames at 250 a second: 6 s of motion
  python -m bench robot --rate 500 --threads 1
  python -m bench robot --backend gpu
  python -m bench robot --distances             with the smallest distance of each pair of meshes, beside contacts

Fails where a frame is not accounted for.
"""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from bench import lab
from bench.lab import BACKENDS, bar, usable
from hpccd_ros import scenes
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables

NAMESPACE = "/bench_robot"
SCENE = "arm-and-cloth"
PATIENCE = 60.0  # s
SETTLE = 1.0  # s, until the last answers have come
PERCENTILES = (("median", 50), ("p95", 95), ("p99", 99))
PARTS = ("whole", "detection", "core", "around", "added")


def configure(parser):
    what = parser.add_argument_group("what is measured")
    what.add_argument("--rate", type=float, default=250.0, metavar="HZ", help="frames a second (default: %(default)s)")
    what.add_argument("--frames", type=int, default=1501, metavar="N", help="of the scene (default: %(default)s)")
    what.add_argument("--distances", action="store_true", help="ask for the smallest distances, too")
    what.add_argument("--backend", default="cpu", choices=BACKENDS, help="default: %(default)s")
    lab.tier_option(what, default="exact")
    lab.configure(parser, rounds=3, leave_out=("data", "size"))


def run(args) -> lab.Report:
    if not args.rate > 0 or args.frames < 3 or args.repeat < 1:
        raise UserError("--rate: must be above 0; --frames: at least 3; --repeat: at least 1")
    _, refused = usable("backend", [args.backend], accuracy=args.accuracy)
    if refused:
        raise UserError(f"--backend {args.backend}: {refused[args.backend]}")
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    report = lab.begin(args)[0]
    scene = scenes.make(SCENE, frames=args.frames, progress=True)
    for number in range(args.repeat):
        with tempfile.TemporaryDirectory(prefix="hpccd-bench-") as folder:
            row = report.add(
                what="stream", round=number, scene=SCENE, rate_hz=args.rate, **_measured(args, scene, folder)
            )
        if row["unaccounted"]:
            report.failure(f"{row['unaccounted']} frames are not accounted for")
    columns = [f"{part} {key}" for part in PARTS for key, _ in PERCENTILES]
    tables.show(
        f"{SCENE} at {args.rate:g} frames a second: ms from before a frame is sent to its answer",
        ["answers", "a second", "dropped", *columns],
        [
            [r["answers"], r["answers_hz"], r["dropped"], *(r[f"{p}_{k}_ms"] for p in PARTS for k, _ in PERCENTILES)]
            for r in report.rows
        ],
        caption="detection: with joints, bounds and cuts; core: its calls alone; around: whole less detection; added: "
        "whole less core",
    )
    return report


def _measured(args, scene, folder: str) -> dict:
    import rclpy
    from hpccd.msg import ContactArray
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    from bench.ros import node_process, timed_node
    from hpccd_ros.demo.children import Children
    from hpccd_ros.middleware import environment, qos, topic_names
    from hpccd_ros.scenes.messages import node_parameters

    parameters = {
        **node_parameters(scene),
        "backend": args.backend,
        "threads": args.threads,
        "accuracy": args.accuracy,
        "distances": args.distances,
        "diagnostics_period": 0.5,
        "frame_queue": 2,
    }
    os.environ[timed_node.VARIABLE] = str(Path(folder) / "times.json")
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("simulator", namespace=NAMESPACE, start_parameter_services=False)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    came: list[tuple[float, bytes]] = []
    listener = threading.Thread(target=executor.spin, daemon=True)
    try:
        with Children(Path(folder)) as children:
            child = node_process.start(children, Path(folder), NAMESPACE, parameters, "bench.ros.timed_node")
            status = node_process.NodeStatus(node, NAMESPACE)
            # Raw: to read the answers while frames are sent would delay these.
            node.create_subscription(
                ContactArray,
                topic_names.CONTACTS,
                lambda data: came.append((time.monotonic(), data)),
                qos.keep_last(args.frames),
                raw=True,
            )
            listener.start()
            sent = _sent(node, scene, args.rate, children, status)
            time.sleep(SETTLE)
            heard = status.heard
            children.wait(lambda: status.heard > heard + 0.1, "the node tells its counts", PATIENCE)
            unaccounted, dropped = status.unaccounted(), status.count("dropped.cloth.overload")
            if children.end(child) != 0:
                children.check()
        times = json.loads((Path(folder) / "times.json").read_text(encoding="utf-8"))
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
    asked = {"frames": args.frames, "distances": args.distances, "backend": args.backend}
    told = _percentiles(sent, came, {entry[0]: entry[1:] for entry in times})
    return {**told, "dropped": dropped, "unaccounted": unaccounted, **asked}


def _sent(node, scene, rate: float, children, status) -> list[float]:
    """When each frame was, s of CLOCK_MONOTONIC."""
    from hpccd_ros.middleware import qos, topic_names
    from hpccd_ros.middleware.listeners import await_acknowledged
    from hpccd_ros.middleware.message_types import message_class
    from hpccd_ros.scenes import messages

    player = messages.Player(scene)
    publishers = {
        topic.name: node.create_publisher(
            message_class(topic.type_name), topic.name, qos.TOPOLOGY if topic.latched else qos.vertices("reliable", 10)
        )
        for topic in messages.topics(scene)
    }
    children.wait(
        lambda: all(publisher.get_subscription_count() for publisher in publishers.values()), "the node", PATIENCE
    )
    began_ns = time.time_ns()
    once = {topic_names.vertices(mesh.name) for mesh in scene.sent_meshes if mesh.static}
    frames = []
    for frame in scene.frames():
        messages_of_frame = player.messages(frame, began_ns + round(frame.index * 1e9 / rate))
        frames.append([message for message in messages_of_frame if not (frames and message.topic in once)])
    # A robot that is known only after the first frame makes another scene, which begins with the second.
    latched = {topic.name for topic in messages.topics(scene) if topic.latched}
    for message in frames[0]:
        if message.topic in latched:
            publishers[message.topic].publish(message.data)
    frames[0] = [message for message in frames[0] if message.topic not in latched]
    children.wait(
        lambda: "waits for its description" not in status.texts.get("frames", "waits for its description"),
        "the node knows the robot",
        PATIENCE,
    )
    sent, begin = [], 0.0
    with bar(f"{SCENE} at {rate:g} a second", len(frames)) as done:
        for number, frame in enumerate(frames):
            if number < 2:  # the node has its first frame before the clock runs
                begin = time.monotonic() + SETTLE * (1 - number) - number / rate
            if (left := begin + number / rate - time.monotonic()) > 0:
                time.sleep(left)
            sent.append(time.monotonic())
            for message in frame:
                publishers[message.topic].publish(message.data)
            if number == 0:
                await_acknowledged(publishers.values(), PATIENCE)
                time.sleep(SETTLE)
            done()
    return sent


def _percentiles(sent: list[float], came: list[tuple[float, bytes]], times: dict) -> dict:
    from hpccd.msg import ContactArray
    from rclpy.serialization import deserialize_message

    answers = [(at, deserialize_message(data, ContactArray)) for at, data in came]
    steps = [message.step for _, message in answers]
    if len(steps) < 2:
        raise UserError("the node answered nothing")
    whole = 1e3 * np.array([at - sent[message.step] for at, message in answers])
    detection, core = np.array([times[step][3:5] for step in steps]).T
    of = {"whole": whole, "detection": detection, "core": core, "around": whole - detection, "added": whole - core}
    return {
        "answers": len(steps),
        "answers_hz": (len(steps) - 1) / (came[-1][0] - came[0][0]),
        "contacts": float(np.median([message.total for _, message in answers])),
        "parts": int(max(message.parts for _, message in answers)),
        **{f"{part}_{key}_ms": float(np.percentile(of[part], q)) for part in PARTS for key, q in PERCENTILES},
    }
