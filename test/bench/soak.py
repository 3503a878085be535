# SPDX-License-Identifier: Apache-2.0
"""Minutes or hours of mixed load on a node process: streams of four meshes, one of them with sixteen changes of
topology per run, one from a publisher that is ended or killed and restarted; invalid messages of ten kinds; a misspelt
mesh; valid and invalid requests to ~/detect. Every 25th result (--check-every) is recomputed.

  python -m bench soak                          forty minutes, about a tenth of the machine
  python -m bench soak --minutes 1 --rate 30 --memory-limit 10

During the warm-up the node is stopped (SIGSTOP) until its queues and the publisher's shared memory are full. This
memory then counts as the node's from the beginning.

Fails if the node ends, a result is wrong, counters do not add up, or resident memory changes by more than
--memory-limit between the beginning (after --warm-up) and the end.
"""

from __future__ import annotations

import math
import mmap
import random
import signal
import struct
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import numpy as np
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from hpccd.srv import Detect
from rclpy.duration import Duration

import hpccd_core as hc
from bench import dds, lab
from hpccd_ros import scenes
from hpccd_ros.frames.drops import Reason
from hpccd_ros.middleware import fields, mesh_cdr, mesh_messages, qos, topic_names
from hpccd_ros.scenes.messages import Player

NAMESPACE, STRIP = "/soak", "strip"  # the mesh of the publisher that is restarted
SCENE, SIZE = "breaking-like", 0.02  # 5,036 triangles; sixteen changes of topology in each run of 60 frames
TIER = "balanced"
INPUT_DEPTH = 50  # frames that may wait for the node
HELD_UP_FRAMES = INPUT_DEPTH + 10  # more than may wait
HISTORY = 10_000  # frames that a result may name: what a busy machine holds up comes late
WRONG_EVERY, REQUEST_EVERY, UNKNOWN_EVERY = 7, 20, 50  # frames
QUERIES = ("contacts", "collision_free_step")  # of requests, in turn
SEGMENT = 16 << 20  # bytes of shared memory that a publisher has (config/fastdds*.xml)
MOST_VERTICES = 20_000  # parameter max_vertices of the node
EARLIER = 10_000_000_000  # ns
ROWS = 10  # of the result, evenly over the time


def configure(parser):
    def add(name, default, metavar, text=""):
        text += " (default: %(default)s)"
        what.add_argument(name, type=type(default), default=default, metavar=metavar, help=text.strip())

    what = parser.add_argument_group("what is done")
    add("--minutes", 40.0, "M")
    add("--rate", 10.0, "HZ", "frames a second")
    add("--restart-every", 12.0, "S", "life of the publisher that is restarted, s, on average")
    add("--warm-up", 0.25, "X", "share of the time before memory counts")
    add("--memory-limit", 1.0, "PERCENT", "largest change of resident memory")
    add("--check-every", 25, "N", "compute every Nth result again")
    add("--seed", 0, "N", "of what is random")
    lab.configure(parser, leave_out=("data", "size", "threads", "repeat"))


def run(args) -> lab.Report:
    for name in ("minutes", "rate", "restart_every", "memory_limit", "check_every"):
        if not getattr(args, name) > 0:
            raise lab.UserError(f"--{name.replace('_', '-')} {getattr(args, name)}: must be above 0")
    if not 0 <= args.warm_up < 0.8:
        raise lab.UserError(f"--warm-up {args.warm_up}: a share of the time, from 0 to below 0.8")
    report = lab.begin(args)[0]
    with dds.session("load", NAMESPACE) as session:
        soak = Soak(args, report, session)
        try:
            soak.run()
        finally:
            # Killed publishers leave their segments behind; the tool of Fast DDS removes those without an owner.
            tool = Path(sys.prefix) / "bin" / "fastdds"
            if soak.ends["killed"] and tool.is_file():
                subprocess.run([str(tool), "shm", "clean"], stdout=subprocess.DEVNULL, check=False)
        soak.check()
    last = report.rows[-1]
    rows = [{"what": key, "count": value} for key, value in last.items() if isinstance(value, int)]
    title = f"soak: {args.minutes:g} minutes at {args.rate:g} frames a second"
    lab.show(title, {"what": "what", "count": "count"}, rows, report.notes[0])
    return report


class Load:
    """Publishes every mesh but the strip, in a node of this process, and checks results and replies.

    sent: vertex messages by mesh, wrong ones included. victim: the mesh that wrong messages are sent for. wrong_sent,
    topologies_wrong: by the reason by which the node must count them. counts: of results heard, of these computed again
    (checked), of changes of topology, requests and replies. wrong: texts of results that were not as they must be.
    """

    def __init__(self, node, args):
        self._args = args
        self._scene, self._strip, self._random = scenes.make(SCENE, SIZE), strip(), random.Random(0)
        self._player = Player(self._scene)
        create = node.create_publisher
        self._topologies = {
            mesh: create(MeshTopology, topic_names.topology(mesh), qos.TOPOLOGY) for mesh in self._scene.mesh_names
        }
        deep = qos.vertices("reliable", INPUT_DEPTH)
        self._vertices = {
            mesh: create(MeshVertices, topic_names.vertices(mesh), deep) for mesh in self._scene.mesh_names
        }
        self._misspelt = create(MeshVertices, topic_names.vertices("statute"), qos.vertices("reliable", 10))
        node.create_subscription(ContactArray, topic_names.CONTACTS, self._on_contacts, 100)
        self._client = node.create_client(Detect, "hpccd/detect")
        self.open: list[tuple] = []  # requests without a reply
        # By stamp: how often topologies had changed before, frame of the scene, frame of the strip.
        self._frames: dict[int, tuple[int, int, int]] = {}
        self._count = self._generation = 0
        self.sent: Counter = Counter()
        self.wrong_sent: Counter = Counter()
        self.topologies_wrong: Counter = Counter()
        self.counts = dict.fromkeys(("results", "checked", "topologies", "requests", "replies"), 0)
        self.wrong: list[str] = []
        self.victim = self._scene.mesh_names[0]

    def node_parameters(self) -> dict:
        """Bounds near to what is sent; fewer contacts than there are at times: truncation is exercised too."""
        meshes = {m.name: {"static": m.static, "self_collision": m.self_collision} for m in self._scene.meshes}
        bounds = {"max_vertices": MOST_VERTICES, "max_contacts": 5000, "input_depth": INPUT_DEPTH}
        core = {"accuracy": TIER, "threads": 1}
        return {"meshes": [*meshes, STRIP], "mesh": meshes, **core, **bounds, "diagnostics_period": 1.0}

    def heard(self) -> bool:
        """Whether the node listens to every mesh and its service is there."""
        publishers = (*self._topologies.values(), *self._vertices.values())
        return all(p.get_subscription_count() for p in publishers) and self._client.service_is_ready()

    def acknowledged(self) -> bool:
        """Whether the node has all that was sent on its topics."""
        publishers = (*self._topologies.values(), *self._vertices.values())
        return all(p.wait_for_all_acked(Duration()) for p in publishers)

    def _publish(self, mesh: str, message) -> None:
        self.sent[mesh] += 1
        self._vertices[mesh].publish(message)

    def send(self, tick: int) -> tuple[scenes.Frame, int]:
        """The right frame that belongs to `tick`, and its stamp."""
        frame, stamp = self._scene.frame(self._count % self._scene.n_frames), stamp_of(tick, self._args.rate)
        changed = False
        for message in self._player.messages(frame, stamp):
            mesh, kind = message.topic.split("/")[1:]
            if kind == "vertices":
                self._publish(mesh, message.data)
            else:
                changed = True
                self.counts["topologies"] += 1
                self._topologies[mesh].publish(message.data)
        self._generation += changed
        self._frames[stamp] = (self._generation, frame.index, frame_of(tick, self._strip))
        if len(self._frames) > HISTORY:
            del self._frames[next(iter(self._frames))]
        self._count += 1
        return frame, stamp

    def tick(self, tick: int) -> None:
        """Send the frame that belongs to `tick`, and now and then what else there is."""
        frame, stamp = self.send(tick)
        if self._count % WRONG_EVERY == 0:
            self._send_wrong(frame[0], self._scene.faces(frame.index)[0], self._player.version(self.victim), stamp)
        if self._count % UNKNOWN_EVERY == 0:
            self._misspelt.publish(mesh_messages.vertices_message(frame[0][:9], stamp))
        if self._count % REQUEST_EVERY == 0:
            self._request(right=self._count % (3 * REQUEST_EVERY) != 0)

    def _send_wrong(self, xyz, faces, version: int, stamp: int) -> None:
        """xyz, faces, version: the mesh as it is; stamp: that of the last right message."""

        def vertices(positions, at=stamp + 1):
            return mesh_messages.vertices_message(positions, at, topology_version=version)

        def short(numbers):
            message = MeshVertices(topology_version=version, vertices_f32=fields.to_field(numbers))
            message.header.stamp = fields.ns_to_stamp(stamp + 1)
            return message

        def topology(*mesh, **of):
            return lambda: mesh_messages.topology_message(*mesh, **of)

        pick, whole = self._random.choice, b"\0\1\0\0" + bytes(range(1, 60))
        not_finite = np.where(np.arange(len(xyz))[:, None] == 7, np.float32(np.nan), xyz)
        large = np.zeros((MOST_VERTICES + 1, 3), np.float32)
        without = MeshTopology(version=version + 1, n_vertices=len(xyz), faces=[0, 1])
        kinds = (  # of vertices in groups that are equally likely, and of topologies
            ((Reason.MALFORMED, lambda: short(pick((xyz.ravel()[:-1], xyz.ravel()[:0])))),),
            (
                (Reason.NOT_FINITE, lambda: vertices(not_finite)),
                (Reason.WRONG_COUNT, lambda: vertices(xyz[:-1])),
                (Reason.TOO_LARGE, lambda: vertices(large)),
            ),
            (
                (Reason.REPEATED, lambda: vertices(xyz, stamp)),
                (Reason.BACKWARD, lambda: vertices(xyz, stamp - EARLIER)),
            ),
            ((Reason.MALFORMED, lambda: whole[: self._random.randrange(5, len(whole))]),),
            (
                (Reason.INDEX_RANGE, topology(faces, int(faces.max()), version=version + 1)),
                (Reason.TOPOLOGY_CONFLICT, topology(faces[1:], len(xyz), version=version)),
                (Reason.MALFORMED, lambda: without),
            ),
        )
        group = pick(kinds)
        reason, message = pick(group)
        if group is kinds[-1]:
            self.topologies_wrong[reason] += 1
            self._topologies[self.victim].publish(message())
        else:
            self.wrong_sent[reason] += 1
            self._publish(self.victim, message())

    def fill_segment(self) -> None:
        """Send, to a node that is held up, as much as the shared memory of this process holds: the pages that a reader
        has ever seen count as its own, and how many these are is else a matter of how long it is once held up."""
        large = mesh_messages.vertices_message(np.zeros((MOST_VERTICES, 3), np.float32), 1)
        for _ in range(SEGMENT // (12 * MOST_VERTICES) + 1):
            self._misspelt.publish(large)

    def _motion(self, k: int) -> list[np.ndarray]:
        return [self._strip.frame(i)[0] for i in (k, k + 1)]

    def _request(self, right: bool) -> None:
        number = self._count // REQUEST_EVERY
        k, query = number % (self._strip.n_frames - 1), QUERIES[number % len(QUERIES)]
        start, end = self._motion(k)
        request = Detect.Request(
            mesh_names=[STRIP],
            topologies=[mesh_messages.topology_message(self._strip.meshes[0].faces, len(start))],
            start=[mesh_messages.vertices_message(start, 1)],
            end=[mesh_messages.vertices_message(end if right else end[:-1], 2)],
            query=query,
        )
        self.counts["requests"] += 1
        self.open.append((self._client.call_async(request), k, query, right))

    def look_at_replies(self) -> None:
        """Check the replies that have come."""
        for future, k, query, right in [request for request in self.open if request[0].done()]:
            reply = future.result()
            self.counts["replies"] += 1
            if reply.success != right:
                self.wrong.append(f"request for frame {k}: success {reply.success}: {reply.message}")
            elif right:
                detector = hc.Detector(scenes.core_scene(self._strip), accuracy=TIER, threads=1)
                if query == "contacts":
                    same = reply.contacts.hash == detector.detect(*self._motion(k)).hash
                else:
                    same = reply.collision_free_step == detector.collision_free_step(*self._motion(k))
                if not same:
                    self.wrong.append(f"reply for frame {k} is not the core's, query {query}")
        self.open = [request for request in self.open if not request[0].done()]

    def _on_contacts(self, message: ContactArray) -> None:
        self.counts["results"] += 1
        if self.counts["results"] % self._args.check_every:
            return
        start, end = (self._frames.get(fields.stamp_to_ns(s)) for s in (message.start, message.header.stamp))
        if start is None or end is None:
            self.wrong.append(f"a result for step {message.step} names a time that was not sent, or long ago")
            return
        if start[0] != end[0]:
            self.wrong.append(f"the result for step {message.step} spans a change of topology")
            return
        meshes = (*self._scene.meshes, *self._strip.meshes)
        faces = (*self._scene.faces(end[1]), *self._strip.faces())
        begin, positions = ([*self._scene.frame(k), self._strip.frame(of)[0]] for _, k, of in (start, end))
        scene = hc.Scene()
        for mesh, triangles, xyz in zip(meshes, faces, positions, strict=True):
            how = {"static": mesh.static, "self_collision": mesh.self_collision, "n_vertices": len(xyz)}
            scene.add_mesh(mesh.name, triangles, **how)
        detector = hc.Detector(scene, accuracy=TIER, threads=1)
        expected = detector.detect(np.concatenate(begin), np.concatenate(positions))
        self.counts["checked"] += 1
        if message.hash != expected.hash or message.total != len(expected):
            self.wrong.append(
                f"the result for step {message.step}, {message.start} to {message.header.stamp}, has {message.total} "
                f"contacts and hash {message.hash:#x}, the core alone finds {len(expected)} and {expected.hash:#x}"
            )


class Soak:
    """Starts the node and the publisher that is restarted, streams for --minutes, and looks at the node's memory."""

    def __init__(self, args, report: lab.Report, session: dds.Session):
        self._args, self._report, self._session = args, report, session
        self._random = random.Random(args.seed)
        self._counter = session.folder / "strip-sent"
        self._counter.write_bytes(bytes(8))
        self.ends = {"ended": 0, "killed": 0}
        self._memory: list[tuple[float, float]] = []  # s, MB
        self.load, self.status = Load(session.node, args), dds.NodeStatus(session)

    def run(self) -> None:
        self._node = self._session.start_node(self.load.node_parameters())
        self._session.spin_until(self.load.heard, "the node listens")
        # Messages from before the node knew their publisher cannot be accounted for.
        self.load.send(int(time.time() * self._args.rate))
        self._session.spin_until(self.load.acknowledged, "the first frame acknowledged")
        self._start_publisher()
        last = self._stream()
        self._end_publisher(kill=False)
        # A message cut off is seen as a gap only once another comes behind it.
        self.load.send(last)
        try:
            self._session.spin_until(self._settled, "every message accounted for")
        except lab.UserError as error:
            self._report.failure(str(error))
        status = self._session.children.end(self._node)
        if status != 0:
            self._report.failure(f"the node ended with status {status} at SIGINT: {self._node.last_words()}")

    def sent_by_restarted(self) -> int:
        """Frames that all runs of the restarted publisher have sent."""
        return struct.unpack("<Q", self._counter.read_bytes())[0]

    def received(self, mesh: str) -> int:
        """And those counted as lost."""
        return self.status.count(f"received.{mesh}") + self.status.count(f"dropped.{mesh}.middleware")

    def _settled(self) -> bool:
        """Every message that was sent came, or is known to be lost; nothing waits; no request is open."""
        self.load.look_at_replies()
        missing = any(sent != self.received(mesh) for mesh, sent in self.load.sent.items())
        return not (self.status.unaccounted() or self.load.open or missing)

    def _alive(self) -> None:
        if not self._node.running:
            words = f"status {self._node.process.returncode}; its last words:\n{self._node.last_words(40)}"
            raise lab.UserError(f"the node ended by itself, {words}")

    def _stream(self) -> int:
        """Returns the tick behind the last."""
        args, process = self._args, self._node.process
        rate, seconds = args.rate, 60 * args.minutes
        begin = sample_at = row_at = time.monotonic()
        tick, restart_at = int(time.time() * rate) + 1, begin + self._life()
        hold_at = begin + seconds * args.warm_up / 2
        release_at = hold_at + HELD_UP_FRAMES / rate
        with lab.bar("soak", round(seconds)) as done:
            while (now := time.monotonic()) - begin < seconds:
                self._alive()
                left = tick / rate - time.time()
                if left > 0:
                    self._session.executor.spin_once(timeout_sec=left)
                else:
                    self.load.tick(tick)
                    tick = max(tick + 1, int(time.time() * rate))
                self.load.look_at_replies()
                if now >= hold_at:
                    process.send_signal(signal.SIGSTOP)
                    hold_at = math.inf
                if now >= release_at:
                    self.load.fill_segment()
                    process.send_signal(signal.SIGCONT)
                    release_at = math.inf
                if now >= restart_at:
                    self._end_publisher(kill=self._random.random() < 1 / 3)
                    self._start_publisher()
                    restart_at = time.monotonic() + self._life()
                if now >= sample_at:
                    sample_at += 1.0
                    self._memory.append((now - begin, dds.resident_mb(process.pid)))
                    done()
                if now >= row_at:
                    row_at += max(1.0, seconds / ROWS)
                    of = Path(f"/proc/{process.pid}")
                    row = {"second": round(now - begin), "memory_mb": self._memory[-1][1]}
                    row |= {
                        key: len(list((of / key2).iterdir())) for key, key2 in (("threads", "task"), ("files", "fd"))
                    }
                    self._report.add(**row, answers=self.load.counts["results"], **self.status.counts())
        process.send_signal(signal.SIGCONT)
        return tick

    def _life(self) -> float:
        return self._args.restart_every * self._random.uniform(0.5, 1.5)

    def _start_publisher(self) -> None:
        self._sent_before_start = self.sent_by_restarted()
        words = (NAMESPACE, str(self._args.rate), str(self._counter))
        self._publisher = self._session.children.start(STRIP, "bench.soak", *words)

    def _end_publisher(self, kill: bool) -> None:
        self._session.children.check()
        self.ends["killed" if kill else "ended"] += 1
        signalled = signal.SIGKILL if kill else signal.SIGTERM
        expected = {-signal.SIGKILL if kill else 0}
        if self.sent_by_restarted() == self._sent_before_start:  # Python may be loading yet, which knows no orderly end
            expected.add(-signalled)
        self._publisher.process.send_signal(signalled)
        status = self._publisher.process.wait(dds.PATIENCE)
        if status not in expected:
            words = self._publisher.last_words()
            self._report.failure(f"the restarted publisher ended with status {status}: {words}")
        self._session.children.forget(self._publisher)

    def check(self) -> None:
        """Each thing that does not add up becomes a failure; the accounts are the last row of the report."""
        load, status, failure, args = self.load, self.status, self._report.failure, self._args
        for text in load.wrong[:10]:
            failure(text)
        if not load.counts["checked"]:
            failure("no result was computed again: the time was too short to say anything of them")
        for mesh, sent in load.sent.items():
            if missing := sent - self.received(mesh):
                failure(f"{mesh}: {missing} messages were sent, but neither received nor counted as lost")
        if status.unaccounted():
            failure(f"{status.unaccounted()} messages are not accounted for: {status.counts()}")
        # Topics are not ordered among one another: a wrong message that the next topology overtakes is old as well. Of
        # one cut off, in a burst with right ones, only the gap in the numbers tells.
        dropped = {reason: status.count(f"dropped.{load.victim}.{reason}") for reason in Reason}
        known_otherwise = dropped[Reason.OLD_TOPOLOGY] + dropped[Reason.MIDDLEWARE]
        for reason, sent in load.wrong_sent.items():
            if dropped[reason] > sent:
                failure(f"{sent} messages for {reason} were sent, the node counted {dropped[reason]}")
            known_otherwise -= max(0, sent - dropped[reason])
        if known_otherwise < 0:
            failure(f"{-known_otherwise} wrong messages were not rejected: {dict(load.wrong_sent)}")
        for reason, sent in load.topologies_wrong.items():
            counted = status.count(f"topologies_rejected.{load.victim}.{reason}")
            if counted > sent:
                failure(f"{sent} topologies for {reason} were sent, the node rejected {counted}")
        if self.received(STRIP) > self.sent_by_restarted():
            failure(f"{STRIP}: {self.received(STRIP)} messages counted, {self.sent_by_restarted()} sent")
        if failures := status.count("failures", "detection"):
            failure(f"{failures} detections failed: {status.values['detection']}")
        seconds, mb = np.array(self._memory).T
        mb = mb[seconds >= args.warm_up * 60 * args.minutes]
        tenth = max(1, len(mb) // 10)
        first, last = (float(np.median(part)) for part in (mb[:tenth], mb[-tenth:]))
        memory = {"first": first, "last": last, "least": float(mb.min()), "most": float(mb.max())}
        change = 100 * (last / first - 1)
        text = f"{first:.1f} -> {last:.1f} MB ({change:+.2f} %), least {mb.min():.1f}, most {mb.max():.1f}"
        self._report.notes.insert(0, f"resident memory of the node: {text}")
        if abs(change) > args.memory_limit:
            failure(f"resident memory changed by more than {args.memory_limit:g} %: {text}")
        self._report.add(
            second=round(60 * args.minutes),
            sent=sum(load.sent.values()) + self.sent_by_restarted(),
            **status.counts(),
            **load.counts,
            **{f"publisher_{how}": number for how, number in self.ends.items()},
            wrong_sent={str(reason): n for reason, n in load.wrong_sent.items()},
            topologies_wrong={str(reason): n for reason, n in load.topologies_wrong.items()},
            node_memory_mb=memory,
        )


def strip() -> scenes.Scene:
    return scenes.make("folding-strip", 0.1)  # 336 triangles: a soak wants many frames, not large ones


def frame_of(tick: int, scene: scenes.Scene) -> int:
    """Frame of the scene that belongs to a tick: to and fro, without a jump."""
    last = scene.n_frames - 1
    return last - abs(last - tick % (2 * last))


def stamp_of(tick: int, rate: float) -> int:
    """ns since the epoch: every process computes the same stamp for a tick."""
    return round(tick * 1e9 / rate)


def restarted_publisher(namespace: str, rate: float, counter: Path) -> int:
    """Streams the strip, whose positions are a function of the time alone. counter: a file that holds, as 8 bytes, how
    many frames all runs together have sent, so that the number outlives SIGKILL."""
    stop = threading.Event()
    with dds.helper(STRIP, namespace, stop.set) as node:
        topology = node.create_publisher(MeshTopology, topic_names.topology(STRIP), qos.TOPOLOGY)
        vertices = node.create_publisher(MeshVertices, topic_names.vertices(STRIP), qos.vertices("reliable", 10))
        scene, deadline = strip(), time.monotonic() + 30.0
        mesh = scene.meshes[0]
        while not (topology.get_subscription_count() and vertices.get_subscription_count()) and not stop.wait(0.05):
            if time.monotonic() > deadline:
                print(f"no node listens to {STRIP} in {namespace}", file=sys.stderr)
                return 1
        topology.publish(mesh_cdr.topology(0, "world", 0, mesh.faces, mesh.n_vertices))
        with open(counter, "r+b") as file, mmap.mmap(file.fileno(), 8) as shared:
            (sent,) = struct.unpack("<Q", shared)
            tick = int(time.time() * rate) + 1
            while not stop.wait(max(0.0, tick / rate - time.time())):
                sent += 1
                shared[:] = struct.pack("<Q", sent)
                positions = scene.frame(frame_of(tick, scene))[0]
                vertices.publish(mesh_cdr.vertices(stamp_of(tick, rate), "world", 0, tick, positions))
                tick += 1
    return 0


if __name__ == "__main__":
    sys.exit(restarted_publisher(sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])))
