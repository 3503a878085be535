# SPDX-License-Identifier: Apache-2.0
"""The node as a process over DDS: latency from publish to contacts minus the core's time, compared with an echo of
messages of the same types and sizes (alternating, in one run); a solver that requests ~/detect for its step size,
compared with the same call in process; the highest rate without drops; and behaviour at twice that rate: newest frames
computed, every drop counted, constant memory.

  python -m bench ros                           cloth-ball (the file in HPCCD_DATA, else the generated one), cloth-drop
  python -m bench ros cloth-drop --repeat 1000
  python -m bench ros data --seconds 0          latency and loop alone

A step is played forwards and backwards; its meshes are sent as one, in single precision. Fails if contacts or step
sizes differ from the core's, a frame is unaccounted for, or the latency exceeds twice that of the echo (--limit).
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from hpccd.srv import Detect
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future

import hpccd_core as hc
from bench import dds, lab
from hpccd_ros import client
from hpccd_ros.bench import sources
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware import contact_messages, fields, mesh_messages, qos, stop_signals, topic_names

NAMESPACE, MESH = "/bench", "scene"
LARGE, SMALL = "cloth-ball", "cloth-drop"
# The echo keeps the last two for a late joiner: those of even and of odd steps.
RESULTS = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PARTS_OF_MOTION = (1.0, 0.5, 0.25, 0.75)  # trial steps from each start: what a line search asks
SETTLE = 10.0  # s for the last diagnostics to come
TRIAL = 3.0  # s of a trial in the search of the sustained rate
FINER = 1.1  # ratio of the rates that the search tries
IN, OUT = {"scene": "scene", "MB in": "mb_in", "MB out": "mb_out", "contacts": "contacts"}, {"node / echo": "ratio"}
LATENCY = IN | {"core median": "core_median_ms"} | dds.columns(node="node", echo="echo") | OUT
PARTS = ("in", "hand over", "answer", "out")
LOOP = {"scene": "scene", "MB sent": "mb_sent"}
LOOP |= dds.columns(**{"over DDS": "loop", "in process": "core", "DDS more": "more"})
RATES = {"scene": "scene", "run": "what", "Hz": "rate_hz", **{k: k for k in ("sent", "answered", "dropped")}}
RATES |= {"lost by DDS": "middleware", "unaccounted": "unaccounted", "latency ms": "median_ms", "p95": "p95_ms"}
RATES |= {"memory MB": "memory_end_mb", "change %": "memory_change_percent"}


def configure(parser):
    lab.configure(parser, (LARGE, SMALL), steps=1, rounds=300)
    lab.tier_option(parser, default="exact")
    add = partial(parser.add_argument, type=float)
    runs = "length of the runs at the highest rate and at twice that; 0: none (default: %(default)s)"
    add("--seconds", default=20.0, metavar="S", help=runs)
    add("--limit", default=2.0, metavar="X", help="most times the echo's latency, medians (default: %(default)s)")


def run(args) -> lab.Report:
    if args.seconds < 0 or not args.limit > 0:
        raise lab.UserError(f"--seconds {args.seconds}, --limit {args.limit}: must not be negative")
    data = sources.data_folder(args.data)
    if not args.sources and not (data and (data / f"{LARGE}.npz").is_file()):
        args.sources = [f"{LARGE}-like", SMALL]
    report, found = lab.begin(args)
    for source in found:
        for k in source.spread(args.steps):
            if (step := source.step(k)) is None:
                report.note(f"{source.name}, step {k}: a change of topology without motion, passed over")
            else:
                _measure(report, args, source.name, step)
    if not report.rows:
        raise lab.UserError("none of the steps has a motion; take more with --steps")
    of = {what: [row for row in report.rows if row["what"] == what] for what in ("latency", "step loop")}
    lab.show(
        "publish to contacts, ms: the node less its core, and an echo of the same bytes, in turn",
        LATENCY,
        of["latency"],
    )
    parts = {"scene": "scene", **{part: lambda row, part=part: row["parts_ms"][part] for part in PARTS}}
    lab.show("where it goes, ms (medians)", parts, of["latency"])
    asked = "how far may I go, ms: asked of the node over DDS, and of the core in this process, in turn"
    lab.show(asked, LOOP, of["step loop"])
    if rates := [row for row in report.rows if "rate_hz" in row]:
        lab.show("at a fixed rate", RATES, rates)
    return report


def _measure(report, args, name, step) -> None:
    options = {"accuracy": args.accuracy, "threads": args.threads}
    rates = []
    with dds.session("simulator", NAMESPACE) as session:
        link = Link(session, step, options)
        row = {"scene": name, "triangles": link.triangles, "contacts": link.contacts, "accuracy": args.accuracy}
        row |= {"mb_in": link.bytes_in / 1e6, "mb_out": link.bytes_out / 1e6}
        child = session.start_node(
            {**options, "meshes": [MESH], "diagnostics_period": 0.5, "max_contacts": 0}, "bench.dds"
        )
        session.children.start("echo", "bench.ros", NAMESPACE)
        status = dds.NodeStatus(session)
        link.connect()
        _turns(link, args.repeat, name)
        lanes = {lane.name: (dict(lane.sent), dict(lane.came)) for lane in (link.node, link.echo)}
        loop = _step_loop(link, name, args.repeat)
        if args.seconds:
            trial = partial(_trial, link, status, child.process.pid)
            rates = _rates(link, trial, args.seconds, 1e3 / float(np.median(link.node.latencies_ms())), name)
        if session.children.end(child) != 0:
            session.children.check()
        times = session.times()
    if link.wrong:
        report.failure(f"{name}: contacts of {len(link.wrong)} steps differ from the core's own")
    latency = report.add(**_latency(row, lanes, times))
    report.add(what="step loop", **row, **loop)
    for what, found in rates:
        report.add(what=what, **row, **found)
        if found["unaccounted"]:
            report.failure(f"{name}, {what}: {found['unaccounted']} frames are not accounted for")
        if not found["last_answered"]:
            report.failure(f"{name}, {what}: the last frame has no result")
    if loop["wrong"]:
        report.failure(f"{name}: {loop['wrong']} collision-free steps of ~/detect differ from the core's own")
    if latency["ratio"] > args.limit:
        ratio = f"{latency['ratio']:.2f} times as long as the echo, more than {args.limit:g}"
        report.failure(f"{name}: beside its core the node takes {ratio}")


class Lane:
    """One way to a result. sent, came: time of each step, s of CLOCK_MONOTONIC; position: which was sent."""

    def __init__(self, name: str, publisher):
        self.name, self.publisher, self.step = name, publisher, 0
        self.position: dict[int, int] = {}
        self.sent: dict[int, float] = {}
        self.came: dict[int, float] = {}

    def latencies_ms(self) -> np.ndarray:
        """From before the call of publish() to the begin of the callback, of the steps that were processed."""
        return np.array([1e3 * (at - self.sent[step]) for step, at in self.came.items()])

    def clear(self) -> None:
        """Forget all but the last step, which the next one begins with."""
        self.sent.clear()
        self.came.clear()
        self.position = {self.step: self.position[self.step]}


class Link:
    """The simulator's side: publishes a motion there and back again, to the node and to the echo.

    The vertices are sent in single precision, as one mesh. hold: frames that a position is sent for, one after the
    other: with 2, a node that takes every second frame still sees motion in each step. wrong: steps whose contacts were
    not those of the core.
    """

    def __init__(self, session: dds.Session, step: sources.Step, options: dict):
        self.session, node = session, session.node
        whole = step.as_one_mesh()
        faces = self._faces = whole.meshes[0].faces
        positions = self.positions = [np.asarray(v, np.float32) for v in (step.vertices_t0, step.vertices_t1)]
        self._frames = [mesh_messages.vertices_message(p, 0, frame_id="world") for p in positions]
        self.bytes_in, self.triangles, self.n_vertices = positions[0].nbytes, len(faces), len(positions[0])
        self.detector = hc.Detector(whole.scene(), **options)
        found = [self.detector.detect(positions[1 - k], positions[k]) for k in (0, 1)]
        self._expected, self.contacts = [contacts.hash for contacts in found], len(found[1])
        layout = Layout.of((MESH,), (Topology(0, self.n_vertices, faces),))
        self._results = [ContactArray(step=parity) for parity in (0, 1)]
        for result, contacts in zip(self._results, found, strict=True):
            contact_messages.fill_contacts(result, contacts, layout)
        arrays = ("kind", "mesh_a", "mesh_b", "features_a", "features_b", "toc", "points", "normals")
        arrays = [getattr(self._results[1], array) for array in arrays]
        self.bytes_out = sum(len(values) * values.itemsize for values in arrays)
        self.hold = 1
        self.wrong: list[int] = []
        reliable = qos.vertices("reliable", 10)
        self._topology = node.create_publisher(MeshTopology, topic_names.topology(MESH), qos.TOPOLOGY)
        self._templates = node.create_publisher(ContactArray, "echo/results", RESULTS)
        self.node = Lane("node", node.create_publisher(MeshVertices, topic_names.vertices(MESH), reliable))
        self.echo = Lane("echo", node.create_publisher(MeshVertices, "echo/vertices", reliable))
        # A benchmark must hear every result: deeper than the node's own QoS, which a late reader overruns.
        deep = qos.vertices("reliable", 100)
        node.create_subscription(ContactArray, topic_names.CONTACTS, self._from(self.node), deep)
        node.create_subscription(ContactArray, "echo/contacts", self._from(self.echo), deep)

    def _from(self, lane: Lane) -> Callable[[ContactArray], None]:
        def take(message: ContactArray) -> None:
            lane.came[message.step] = time.monotonic()
            # Stamps are the steps' numbers. Where the position has not changed, there is nothing to compare with.
            start, end = lane.position.get(message.start.nanosec), lane.position.get(message.step)
            if lane is self.node and start is not None and start != end and message.hash != self._expected[end]:
                self.wrong.append(message.step)

        return take

    def connect(self) -> None:
        """Wait for node and echo, give both what they need, and send the frame that the first step begins with."""
        publishers = (self._topology, self._templates, self.node.publisher, self.echo.publisher)
        self.session.spin_until(lambda: all(p.get_subscription_count() for p in publishers), "node and echo")
        self._topology.publish(mesh_messages.topology_message(self._faces, self.n_vertices))
        for result in self._results:
            self._templates.publish(result)
        deadline = time.monotonic() + dds.PATIENCE
        # Nothing tells when a latched message has arrived, so ask until there is a result.
        for lane in (self.node, self.echo):
            while not lane.came:
                self.session.children.check()
                if time.monotonic() > deadline:
                    raise lab.UserError(f"the {lane.name} did not respond within {dds.PATIENCE:.0f} s")
                self.publish(lane)
                self.session.spin(0.2)

    def publish(self, lane: Lane) -> int:
        """Send the next frame; its step."""
        lane.step += 1
        lane.position[lane.step] = at = lane.step // self.hold % 2
        message = self._frames[at]
        message.step = lane.step
        message.header.stamp = fields.ns_to_stamp(lane.step)
        lane.sent[lane.step] = time.monotonic()
        lane.publisher.publish(message)
        return lane.step

    def round(self, lane: Lane) -> None:
        """Send one frame and wait for its result."""
        step = self.publish(lane)
        deadline = time.monotonic() + dds.PATIENCE
        while step not in lane.came:
            if time.monotonic() > deadline:
                raise lab.UserError(f"the {lane.name} returned no result for step {step} within {dds.PATIENCE:.0f} s")
            self.session.executor.spin_once(timeout_sec=1.0)


def _turns(link: Link, rounds: int, name: str) -> None:
    with lab.bar(f"{name}: latency", rounds) as done:
        for turn in range(-5, rounds):
            if turn == 0:
                link.node.clear()
                link.echo.clear()
            link.round(link.node)
            link.round(link.echo)
            if turn >= 0:
                done()


def _latency(row: dict, lanes: dict, times: dict) -> dict:
    """Percentiles of what the node adds to its core, of the echo, and of the parts of the former."""
    (sent, came), (echo_sent, echo_came) = lanes["node"], lanes["echo"]
    steps = sorted(came)
    begin, end = (np.array([of[s] for s in steps]) for of in (sent, came))
    received, detected, published, core = np.array([times[s][:4] for s in steps]).T
    whole, echo = 1e3 * (end - begin), 1e3 * np.array([echo_came[s] - at for s, at in echo_sent.items()])
    # The reader may be faster than the return of the writer's call.
    spans = (received - begin, detected - received - core / 1e3, published - detected, end - published)
    out = {"what": "latency", **row, "rounds": len(steps)}
    for who, ms in (("node", whole - core), ("echo", echo), ("core", core), ("whole", whole)):
        out |= {**dds.percentiles(f"{who}_", ms), f"{who}_mean_ms": float(np.mean(ms))}
    for key in dds.PERCENTILES:
        out["ratio" if key == "median" else f"ratio_{key}"] = out[f"node_{key}_ms"] / out[f"echo_{key}_ms"]
    for key, mean in (("parts_ms", np.median), ("parts_mean_ms", np.mean)):
        out[key] = {part: 1e3 * float(mean(span)) for part, span in zip(PARTS, spans, strict=True)}
    return out


def _step_loop(link: Link, scene: str, rounds: int) -> dict:
    """Percentiles of the node's and the core's time of the same trial steps, in turn; `wrong` results are counted."""
    service = link.session.node.create_client(Detect, "hpccd/detect")
    link.session.spin_until(service.service_is_ready, "service")
    ends = (link.positions, link.positions[::-1])
    motions = [(start, start + np.float32(p) * (end - start)) for start, end in ends for p in PARTS_OF_MOTION]
    found, wrong = [], 0
    with lab.bar(f"{scene}: how far", rounds) as done:
        for turn, (start, end) in zip(range(-len(motions), rounds), itertools.cycle(motions), strict=False):
            began = time.perf_counter()
            future = service.call_async(client.collision_free_step_request({MESH: start}, {MESH: end}))
            sent = time.perf_counter()
            link.session.spin_until(future.done, "result of ~/detect")
            step = client.collision_free_step_from_response(future.result())
            came = time.perf_counter()
            wrong += step != link.detector.collision_free_step(start, end)
            if turn >= 0:
                found.append((came - began, sent - began, time.perf_counter() - came, step))
                done()
    whole, request, core, step = np.array(found).T * [[1e3], [1e3], [1e3], [1]]
    out = {"rounds": rounds, "mb_sent": 2 * link.bytes_in / 1e6, "wrong": wrong}
    for who, ms in (("loop", whole), ("core", core), ("more", whole - core)):
        out |= dds.percentiles(f"{who}_", ms)
    return out | {"request_median_ms": float(np.median(request)), "least_step": float(step.min())}


def _rates(link: Link, trial: Callable, seconds: float, guess: float, name: str) -> list[tuple[str, dict]]:
    """The highest rate of a ladder, by factors around `guess`, at which no frame is dropped; and twice that rate."""
    with lab.bar(f"{name}: rate", 12) as done:

        def clean(rate: float, length: float = TRIAL) -> bool:
            done()
            found.append(trial(rate, length))
            return found[-1]["dropped"] == found[-1]["middleware"] == 0

        found: list[dict] = []
        rate = guess
        if clean(rate):
            while rate < 4 * guess and clean(rate * FINER):
                rate *= FINER
        else:
            while rate > guess / 8:
                rate /= FINER
                if clean(rate):
                    break
        # A result of a few seconds need not hold for many.
        while not clean(rate, seconds) and rate > guess / 8:
            rate /= FINER
        steady = found[-1]
        link.hold = 2
        return [("sustained rate", steady), ("twice that rate", trial(2 * rate, seconds))]


def _trial(link: Link, status: dds.NodeStatus, pid: int, rate: float, seconds: float) -> dict:
    """Send frames for `seconds` at `rate` a second and account for every one of them. Memory: resident MB of the node
    in the first and the last fifth of the time (medians), and the most."""
    lane = link.node
    _settle(link, status)
    before = status.counts()
    lane.clear()
    count = max(2, round(rate * seconds))
    begin = memory_at = time.monotonic() + 0.01
    memory = []
    for k in range(count):
        link.session.spin(begin + k / rate - time.monotonic())
        link.publish(lane)
        if time.monotonic() >= memory_at:
            memory.append(dds.resident_mb(pid))
            memory_at += 0.1
    took = time.monotonic() - begin
    link.session.spin(0.2)
    _settle(link, status)
    after = {key: value - before[key] for key, value in status.counts().items()}
    fifth = max(1, len(memory) // 5)
    first, last = (float(np.median(part)) for part in (memory[:fifth], memory[-fifth:]))
    return {
        "rate_hz": count / took,
        "sent": count,
        "answered": after["answered"],
        "dropped": after["dropped"] - after["middleware"],
        "middleware": after["middleware"],
        # Messages lost at the end of a burst leave no gap in the node's numbers: they must be missing here.
        "unaccounted": count - after["answered"] - after["dropped"],
        "last_answered": lane.step in lane.came,
        **dds.percentiles("", lane.latencies_ms()),
        **{"memory_begin_mb": first, "memory_end_mb": last, "memory_most_mb": max(memory)},
        "memory_change_percent": 100 * (last / first - 1),
    }


def _settle(link: Link, status: dds.NodeStatus) -> None:
    """Until two reports in a row count the same and nothing waits (or SETTLE is over)."""
    deadline, last, heard = time.monotonic() + SETTLE, None, 0.0
    while time.monotonic() < deadline:
        link.session.children.check()
        link.session.spin(0.02)
        if status.heard != heard:
            heard, counts = status.heard, status.counts()
            if counts == last and not counts["waiting"]:
                return
            last = counts


def echo(namespace: str) -> None:
    """The bare cost of ROS: responds to each vertex message at once with contacts that it was given before."""
    stop, results = Future(), {}
    with dds.helper("echo", namespace, lambda: stop.set_result(None)) as node:
        contacts = node.create_publisher(ContactArray, "echo/contacts", qos.CONTACTS)

        def take(message: MeshVertices) -> None:
            result = results.get(message.step % 2)
            if result is not None:
                result.header.stamp, result.step = message.header.stamp, message.step
                contacts.publish(result)

        node.create_subscription(ContactArray, "echo/results", lambda m: results.update({m.step % 2: m}), RESULTS)
        node.create_subscription(MeshVertices, "echo/vertices", take, qos.vertices("reliable", 10))
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        stop_signals.spin(executor, stop)
        executor.shutdown(timeout_sec=1.0)


if __name__ == "__main__":
    echo(sys.argv[1])
