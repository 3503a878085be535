# SPDX-License-Identifier: Apache-2.0
"""The topic stop over DDS, received by a StopListener: random approaches of two deforming meshes, each step compared
with brute force; silence after each; mesh publisher and node killed or suspended. Also its cost compared with contacts.

  python -m bench stop                          1,000 approaches and silences, 20 ends of each kind: quarter of an hour
  python -m bench stop --trials 20 --ends 2

Fails if stop misses a step closer than stop_distance, rises more than one frame after it, or more than --margin after
the time-out of a source that ended.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable
from functools import partial

import numpy as np
import stop_scene
from hpccd.msg import MeshTopology, MeshVertices

from bench import dds, lab
from hpccd_ros import client
from hpccd_ros.bench import sources
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

NAMESPACE = "/bench_stop"
PATIENCE = 120.0  # s
PERCENTILES = dds.PERCENTILES | {"most": 100}
BEFORE_SILENCE = 0.9  # of the time-out: what rises later may have risen by silence
COST_SCENES, DISTANCES_EACH = ("cloth-drop", "cloth-ball-like"), 30  # steps
APPROACHES = {key: key for key in ("trials", "steps", "near", "rises")} | {key: f"{key}_ms" for key in PERCENTILES}
APPROACHES |= {"of a frame": "frame_ms"} | {key: key for key in ("late", "missed", "false")}
ENDS = {"what": "what", "trials": "trials"} | {key: f"{key}_ms" for key in ("median", "p95", "most")}
ENDS |= {"stop_timeout": "timeout_ms", "beyond it": "beyond_ms"}
COSTS = {key: key for key in ("scene", "triangles", "steps", "near")}
COSTS |= {"stop": "look_ms", "contacts": "contacts_ms", "distances": "distances_ms"}


def configure(parser):
    add = parser.add_argument_group("what is measured").add_argument
    ends = "ends of each kind of publisher and node (default: %(default)s)"
    margin = "most that stop may rise after the time-out (default: %(default)s)"
    add("--trials", type=int, default=1000, metavar="N", help="approaches (default: %(default)s)")
    add("--ends", type=int, default=20, metavar="N", help=ends)
    add("--rate", type=float, default=20.0, metavar="HZ", help="frames a second (default: %(default)s)")
    add("--stop-timeout", type=float, default=0.5, metavar="S", help="(default: %(default)s)")
    add("--margin", type=float, default=0.1, metavar="S", help=margin)
    add("--seed", type=int, default=18, help="of the approaches (default: %(default)s)")
    lab.configure(parser, leave_out=("data", "size", "threads", "repeat"))


def run(args) -> lab.Report:
    if args.trials < 1 or args.ends < 0 or not args.rate > 0 or not args.stop_timeout > 2 / args.rate:
        raise lab.UserError("--trials, --rate: must be above 0; --ends: not negative; --stop-timeout: above two frames")
    report = lab.begin(args)[0]
    timeout = args.stop_timeout
    parameters = {"meshes": list(stop_scene.MESHES), "stop_distance": stop_scene.DISTANCE, "stop_timeout": timeout}
    with dds.session("watching", NAMESPACE) as session:
        ears = Ears(session, args.stop_timeout)
        try:
            start = partial(session.start_node, parameters)
            child = start()
            _approaches(report, args, session, ears)
            if args.ends:
                _ends(report, args, session, ears, child, start)
        finally:
            ears.close()
    with lab.bar("cost", len(COST_SCENES)) as done:
        for source in sources.resolve(COST_SCENES, None, COST_SCENES):
            for apart in (False, True):
                report.add(what="cost", **_cost(source, apart))
            done()
    first, *others = (row for row in report.rows if row["what"] != "cost")
    lab.show("approaches: from the frame that ends a near step to stop, ms", APPROACHES, [first])
    lab.show("from the end of what went before to stop, ms", ENDS, others)
    costs = [row for row in report.rows if row["what"] == "cost"]
    lab.show("what it costs, ms a step (medians)", COSTS, costs)
    return report


class Sender:
    """Publishes frames of the scene through `node`."""

    def __init__(self, node):
        topology, vertices, meshes = client.topology_topic, client.vertices_topic, stop_scene.MESHES
        self._topologies = [node.create_publisher(MeshTopology, topology(m), client.TOPOLOGY_QOS) for m in meshes]
        self._vertices = [node.create_publisher(MeshVertices, vertices(m), client.VERTICES_QOS) for m in meshes]

    def heard(self) -> bool:
        """Whether each publisher has a reader."""
        return all(p.get_subscription_count() for p in (*self._topologies, *self._vertices))

    def topologies(self) -> None:
        for publisher, faces in zip(self._topologies, stop_scene.FACES, strict=True):
            publisher.publish(client.topology_message(faces, n_vertices=int(faces.max()) + 1))

    def frame(self, frame: stop_scene.Frame, stamp_ns: int) -> float:
        """When its last message was handed to DDS, s of time.monotonic()."""
        messages = [client.vertices_message(positions, stamp_ns=stamp_ns) for positions in frame]
        for publisher, message in zip(self._vertices, messages, strict=True):
            at = time.monotonic()
            publisher.publish(message)
        return at


class Ears:
    """A StopListener, spun by a thread of its own; what it said, and since when."""

    def __init__(self, session: dds.Session, stop_timeout: float):
        self.changes: list[tuple[float, bool]] = [(time.monotonic(), True)]

        def note(listener) -> None:
            self.changes.append((time.monotonic(), listener.stop))

        self.listener = client.StopListener(session.node, stop_timeout=stop_timeout, on_change=note)
        self._executor, self._ended = session.executor, threading.Event()
        self._thread = threading.Thread(target=self._spin, name="ears", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def close(self) -> None:
        self._ended.set()
        self._thread.join()

    def at(self, when: float) -> bool:
        """The value published then."""
        return next(said for since, said in reversed(self.changes) if since <= when)

    def rise(self, begin: float) -> float | None:
        """When it was first true from `begin` on; None: never."""
        if self.at(begin):
            return begin
        return next((since for since, said in self.changes if begin < since and said), None)

    def until(self, stop: bool) -> float:
        """Wait until it reads so; when that was. It is read each half of a millisecond. UserError where it does not."""
        deadline = time.monotonic() + PATIENCE
        while self.listener.stop != stop:
            if time.monotonic() > deadline:
                raise lab.UserError(f"stop was not {stop} within {PATIENCE:.0f} s: {self.listener.reason}")
            time.sleep(0.0005)
        return time.monotonic()


def _approaches(report, args, session: dds.Session, ears: Ears) -> None:
    """Frames at a fixed rate; after each trial none, until stop is true."""
    status, sender = dds.NodeStatus(session), Sender(session.node)
    session.children.wait(sender.heard, "the node listens", PATIENCE)
    sender.topologies()
    random, frames, sent, silences = np.random.default_rng(args.seed), [], [], []

    def send(frame: stop_scene.Frame, at: float) -> None:
        time.sleep(max(0.0, at - time.monotonic()))
        frames.append(frame)
        sent.append(sender.frame(frame, len(frames)))

    with lab.bar("approaches", args.trials) as done:
        for _ in range(args.trials):
            first, *others = stop_scene.trial(random)
            send(first, 0.0)
            time.sleep(1 / args.rate)
            while ears.listener.stop:  # after the silence, and at the beginning
                send(first, 0.0)
                time.sleep(1 / args.rate)
            begin = time.monotonic()
            for k, frame in enumerate(others):
                send(frame, begin + k / args.rate)
            time.sleep(1 / args.rate)
            silences.append(ears.until(True) - sent[-1])
            done()
    truth = []
    with lab.bar("truth", len(frames) - 1) as done:
        for start, end in zip(frames, frames[1:], strict=False):
            truth.append(stop_scene.near(start, end))
            done()
    judged = judge(truth, sent, ears, 1 / args.rate, args.stop_timeout)
    look = float(status.values.get("stop", {}).get("look_ms", "nan"))
    rises = judged.pop("rise_s")
    row = {**judged, "frame_ms": 1e3 / args.rate, "look_ms": look, **_percentiles(rises)}
    report.add(what="approaches", trials=args.trials, **row)
    if judged["missed"] or judged["late"]:
        wrong = f"stop missed {judged['missed']} near steps, and rose late {judged['late']} times"
        report.failure(wrong)
    _silence(report, args, "silence", silences)


def judge(truth: list[bool], sent: list[float], ears: Ears, period: float, timeout: float) -> dict:
    """truth: which steps are near; the first frame ends none. rise_s: from the frame with which a step ends that comes
    near, after one that did not, to stop; late: those that took longer than a frame. missed: steps that come near
    without stop being true before the silence of what follows would make it so. false: of steps that do not, and
    follow one that did not, those with stop true a frame later."""
    rises, late, missed, false, before = [], 0, 0, 0, True
    for near, at, following in zip(truth, sent[1:], [*sent[2:], float("inf")], strict=True):
        risen = ears.rise(at)
        if near and (risen is None or risen - at > BEFORE_SILENCE * timeout):
            missed += 1
        elif near and not before:
            rises.append(risen - at)
            late += risen - at > period
        # A silence follows the last frame of a trial: what is said then is another matter.
        false += not near and not before and ears.at(min(following, at + period))
        before = near
    counts = {"steps": len(truth), "near": sum(truth), "rises": len(rises), "late": late, "missed": missed}
    return {**counts, "false": false, "rise_s": rises}


def _ends(report, args, session: dds.Session, ears: Ears, node, start_node: Callable) -> None:
    """Signals to publisher and node, while stop is false; each is replaced, or goes on."""
    children = session.children

    def start_source():
        return children.start("source", "bench.stop", NAMESPACE, str(args.rate))

    running = {"publisher": start_source(), "node": node}
    for who, start in (("publisher", start_source), ("node", start_node)):
        for how, number in (("killed", signal.SIGKILL), ("held up", signal.SIGSTOP)):
            random, taken = np.random.default_rng(args.ends), []
            with lab.bar(f"{who} {how}", args.ends) as done:
                for _ in range(args.ends):
                    ears.until(False)
                    time.sleep(random.uniform(0.05, 0.3))  # anywhere between two frames, and between two repetitions
                    ears.until(False)
                    began = time.monotonic()
                    running[who].process.send_signal(number)
                    taken.append(ears.until(True) - began)
                    if number == signal.SIGKILL:
                        running[who].process.wait()
                        children.forget(running[who])
                        running[who] = start()
                    else:
                        time.sleep(0.2)
                        running[who].process.send_signal(signal.SIGCONT)
                    done()
            _silence(report, args, f"{who} {how}", taken)


def _silence(report, args, what: str, taken: list[float]) -> None:
    beyond = max(taken) - args.stop_timeout
    times = {"timeout_ms": 1e3 * args.stop_timeout, "beyond_ms": 1e3 * beyond, **_percentiles(taken)}
    report.add(what=what, trials=len(taken), **times)
    if beyond > args.margin:
        report.failure(f"{what}: stop rose {1e3 * beyond:.0f} ms after the time-out")


def _percentiles(seconds: list[float]) -> dict[str, float]:
    return dds.percentiles("", 1e3 * np.array(seconds), PERCENTILES)


def _cost(source: sources.Source, apart: bool) -> dict:
    """Median ms of a look at a step, of its contacts and of its smallest distances, in this process and without DDS,
    for a distance of a median edge. apart: the first mesh is moved so far up that nothing is near; else nearly all
    steps are. The topologies of the source do not change."""
    steps = [source.step(k) for k in range(source.n_steps)]
    meshes = steps[0].meshes
    builder = SceneBuilder(tuple(MeshSettings(m.name, m.static, m.self_collision) for m in meshes))
    topologies = tuple(Topology(0, m.n_vertices, m.faces) for m in meshes)
    names, ends = tuple(m.name for m in meshes), np.cumsum([m.n_vertices for m in meshes])[:-1]
    frames = []
    for k, xyz in enumerate([steps[0].vertices_t0, *(step.vertices_t1 for step in steps)]):
        xyz = xyz.copy()
        xyz[: ends[0]] += apart * 2 * np.ptp(steps[0].vertices_t0)
        frames.append(SceneFrame(k, k, "", topologies, tuple(np.split(xyz, ends)), names, 0.0))
    edges = [
        np.linalg.norm(xyz[t.faces] - xyz[np.roll(t.faces, 1, axis=1)], axis=2).ravel()
        for t, xyz in zip(topologies, frames[0].vertices, strict=True)
    ]
    options = Options(backend="cpu")
    look, detector = Nearness(builder, options, float(np.median(np.concatenate(edges)))), StepDetector(builder, options)
    taken: dict[str, list[float]] = {"look": [], "contacts": [], "distances": []}
    near = 0
    for k, (start, end) in enumerate(zip(frames, frames[1:], strict=False)):
        began = time.perf_counter()
        near += look.within(start, end)[0] is not None
        taken["look"].append(1e3 * (time.perf_counter() - began))
        taken["contacts"].append(detector.detect(start, end).detect_ms)
        if k % DISTANCES_EACH == 1:
            began = time.perf_counter()
            detector.distances(end)
            taken["distances"].append(1e3 * (time.perf_counter() - began))
    scene = source.name + (", moved apart" if apart else "")
    counts = {"triangles": sum(len(t.faces) for t in topologies), "steps": len(steps), "near": near}
    return {"scene": scene, **counts, **{f"{what}_ms": float(np.median(ms)) for what, ms in taken.items()}}


def source_process(namespace: str, rate: float) -> None:
    """A publisher to be killed, with nothing near in its frames."""
    stop = threading.Event()
    with dds.helper("source", namespace, stop.set) as node:
        sender = Sender(node)
        sender.topologies()
        frame = stop_scene.trial(np.random.default_rng(0))[0]
        while not stop.wait(1 / rate):
            sender.frame(frame, time.time_ns())


if __name__ == "__main__":
    source_process(sys.argv[1], float(sys.argv[2]))
