# SPDX-License-Identifier: Apache-2.0
"""A robot beside a cloth over DDS: the scene arm-and-cloth at a fixed rate, with the arm as joint states. Reports the
number of results and the latency from the frame to its result: total, detection, core, and overhead of the node.
The static table is sent once, as docs/meshes.md describes.

  python -m bench robot                         1,501 frames at 250 a second: 6 s of motion
  python -m bench robot --rate 500 --threads 1
  python -m bench robot --backend gpu
  python -m bench robot --distances             with the smallest distance of each pair of meshes, besides contacts

Fails if a frame is not accounted for.
"""

from __future__ import annotations

import threading
import time

import numpy as np
from hpccd.msg import ContactArray
from rclpy.serialization import deserialize_message

from bench import dds, lab
from hpccd_ros import scenes
from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.middleware.listeners import await_acknowledged
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.scenes import messages

SCENE = "arm-and-cloth"
PATIENCE = 60.0  # s
SETTLE = 1.0  # s, until the last results have come
PARTS = ("whole", "detection", "core", "around", "added")
COLUMNS = {"results": "answers", "a second": "answers_hz", "dropped": "dropped"}
COLUMNS |= dds.columns(**{part: part for part in PARTS})


def configure(parser):
    add = parser.add_argument_group("what is measured").add_argument
    add("--rate", type=float, default=250.0, metavar="HZ", help="frames a second (default: %(default)s)")
    add("--frames", type=int, default=1501, metavar="N", help="of the scene (default: %(default)s)")
    add("--distances", action="store_true", help="ask for the smallest distances, too")
    add("--backend", default="cpu", choices=lab.BACKENDS, help="default: %(default)s")
    lab.tier_option(parser, default="exact")
    lab.configure(parser, rounds=3, leave_out=("data", "size"))


def run(args) -> lab.Report:
    if not args.rate > 0 or args.frames < 3 or args.repeat < 1:
        raise lab.UserError("--rate: must be above 0; --frames: at least 3; --repeat: at least 1")
    lab.require_backend(args, accuracy=args.accuracy)
    report = lab.begin(args)[0]
    scene = scenes.make(SCENE, frames=args.frames, progress=True)
    for number in range(args.repeat):
        row = report.add(what="stream", round=number, scene=SCENE, rate_hz=args.rate, **_measured(args, scene))
        if row["unaccounted"]:
            report.failure(f"{row['unaccounted']} frames are not accounted for")
    lab.show(
        f"{SCENE} at {args.rate:g} frames a second: ms from before a frame is sent to its result",
        COLUMNS,
        report.rows,
        "detection: with joints, bounds and cuts; core: its calls alone; around: whole less detection; added: "
        "whole less core",
    )
    return report


def _measured(args, scene) -> dict:
    asked = {key: getattr(args, key) for key in ("backend", "distances")}
    parameters = {**messages.node_parameters(scene), **asked, "threads": args.threads, "accuracy": args.accuracy}
    came: list[tuple[float, bytes]] = []
    with dds.session("simulator", "/bench_robot") as session:
        child = session.start_node({**parameters, "diagnostics_period": 0.5, "frame_queue": 2}, "bench.dds")
        status = dds.NodeStatus(session)

        def take(data: bytes) -> None:
            came.append((time.monotonic(), data))

        # Raw: to read the results while frames are sent would delay these.
        session.node.create_subscription(ContactArray, topic_names.CONTACTS, take, qos.keep_last(args.frames), raw=True)
        threading.Thread(target=session.executor.spin, daemon=True).start()
        sent = _sent(session, scene, args.rate, status)
        time.sleep(SETTLE)
        heard = status.heard
        session.children.wait(lambda: status.heard > heard + 0.1, "the node tells its counts", PATIENCE)
        counted = {"dropped": status.count("dropped.cloth.overload"), "unaccounted": status.unaccounted()}
        if session.children.end(child) != 0:
            session.children.check()
        times = session.times()
    results = [(at, deserialize_message(data, ContactArray)) for at, data in came]
    if len(results) < 2:
        raise lab.UserError("the node sent no results")
    whole = 1e3 * np.array([at - sent[message.step] for at, message in results])
    detection, core = np.array([times[message.step][3:5] for _, message in results]).T
    parts = zip(PARTS, (whole, detection, core, whole - detection, whole - core), strict=True)
    return {
        "answers": len(results),  # the name in kept results
        "answers_hz": (len(results) - 1) / (came[-1][0] - came[0][0]),
        "contacts": float(np.median([message.total for _, message in results])),
        "parts": int(max(message.parts for _, message in results)),
        **{key: ms for part, of in parts for key, ms in dds.percentiles(f"{part}_", of).items()},
        **counted,
        "frames": args.frames,
        **asked,
    }


def _sent(session: dds.Session, scene, rate: float, status: dds.NodeStatus) -> list[float]:
    """When each frame was, s of CLOCK_MONOTONIC."""
    player, topics, wait = messages.Player(scene), messages.topics(scene), session.children.wait
    reliable = qos.vertices("reliable", 10)
    publishers = {
        t.name: session.node.create_publisher(
            message_class(t.type_name), t.name, qos.TOPOLOGY if t.latched else reliable
        )
        for t in topics
    }
    wait(lambda: all(publisher.get_subscription_count() for publisher in publishers.values()), "the node", PATIENCE)
    began_ns = time.time_ns()
    once = {topic_names.vertices(mesh.name) for mesh in scene.sent_meshes if mesh.static}
    frames: list[list[messages.Message]] = []
    for frame in scene.frames():
        of_frame = player.messages(frame, began_ns + round(frame.index * 1e9 / rate))
        frames.append([message for message in of_frame if not (frames and message.topic in once)])
    # A robot that is known only after the first frame makes another scene, which begins with the second.
    latched = {topic.name for topic in topics if topic.latched}
    for message in frames[0]:
        if message.topic in latched:
            publishers[message.topic].publish(message.data)
    frames[0] = [message for message in frames[0] if message.topic not in latched]
    unknown = "waits for its description"
    wait(lambda: unknown not in status.texts.get("frames", unknown), "the node knows the robot", PATIENCE)
    sent, begin = [], 0.0
    with lab.bar(f"{SCENE} at {rate:g} a second", len(frames)) as done:
        for number, frame in enumerate(frames):
            if number < 2:  # the node has its first frame before the clock runs
                begin = time.monotonic() + SETTLE * (1 - number) - number / rate
            time.sleep(max(0.0, begin + number / rate - time.monotonic()))
            sent.append(time.monotonic())
            for message in frame:
                publishers[message.topic].publish(message.data)
            if number == 0:
                await_acknowledged(publishers.values(), PATIENCE)
                time.sleep(SETTLE)
            done()
    return sent
