# SPDX-License-Identifier: Apache-2.0
"""Meshes that are inside others without touching them: stop rises within a frame, however they got there. No ROS, but
for the last tests, which run a node as a process. Balls decide by their radii what is true."""

import contextlib

import numpy as np
import pytest
import stop_stream
from hand_and_table import MESHES
from hpccd.msg import DistanceArray, PairSummary, PairSummaryArray

from hpccd_core import shapes
from hpccd_ros import client
from hpccd_ros.base.clocks import Clocks
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import MeshSettings, Origin, SceneFrame, Topology
from hpccd_ros.node.stop_doubts import WatchedScene
from hpccd_ros.node.stop_state import Cause, StopState

OPTIONS = Options(backend="cpu", threads=1)
BALL, FACES = shapes.icosphere(1)
ROUND = np.linalg.norm(BALL[FACES].mean(axis=1), axis=1).min()  # of a ball inside this surface, whose radius is 1
DISTANCE = 0.05


class Stream:
    """Frames of a small ball and a large, closed or open one, and what the node would make of them."""

    def __init__(self, static=False, faces=FACES):
        meshes = tuple(MeshSettings(name, static and name == "table") for name in MESHES)
        builder = SceneBuilder(meshes)
        self.topologies = tuple(Topology(0, len(BALL), f) for f in (FACES, faces))
        self.nearness = Nearness(builder, OPTIONS, DISTANCE)
        self.time = 10**18  # ns; each frame is sent 1 ms after the one before
        self.state = StopState(DISTANCE, 10.0, clocks=Clocks(lambda: 1e-9 * self.time, lambda: self.time))
        self.state.begin(WatchedScene(MESHES, tuple(not mesh.static for mesh in meshes)))
        self.last = None
        self.shells = {}

    def frame(self, small, centre=(0, 0, 0)):
        """small: positions of the small ball. The shell has radius 2 and keeps its array while it stays."""
        shell = self.shells.setdefault(tuple(centre), 2 * BALL + centre)
        return SceneFrame(0, 0, "", self.topologies, (np.asarray(small, float), shell), MESHES, 0.0)

    def restart(self, frame):
        self.last = frame
        self.state.first()
        return self.cause()

    def step(self, frame, lost=False):
        """lost: the detection of this step fails."""
        self.time += 10**6
        if lost:
            self.state.failed("lost")
            return self.cause()
        near, distance = self.nearness.within(self.last, frame)
        inside = self.nearness.inside(self.last, frame) if near is None else None
        self.state.answered(near, distance, [Origin(self.time)] * 2, inside=inside)
        self.last = frame
        return self.cause()

    def cause(self):
        why = self.state.why()
        return None if why is None else why.cause


def direction(random):
    towards = random.normal(size=3)
    return towards / np.linalg.norm(towards)


@pytest.mark.parametrize("seed", range(10))
def test_random_approaches_that_end_inside(seed):
    """A hundred for each seed: one large step, teleports (the stream restarts), failed steps, a static shell that is
    placed around the ball; then small steps inside, and out again."""
    random, counts = np.random.default_rng(seed), dict.fromkeys(Cause, 0)
    for trial in range(100):
        kind = ("step", "teleport", "lost", "placed")[trial % 4]
        stream, radius = Stream(static=kind == "placed"), random.uniform(0.05, 0.5)
        small = radius * BALL * random.uniform(0.8, 1.0, (len(BALL), 1))
        deep = 2 * ROUND - radius - 2 * DISTANCE
        inside = [direction(random) * random.uniform(0, deep) for _ in range(4)]
        outside = direction(random) * random.uniform(4.0, 40.0)
        stream.restart(stream.frame(small + outside))
        assert stream.step(stream.frame(small + 1.1 * outside)) is None
        if kind == "step":
            assert stream.step(stream.frame(small + inside[0])) is Cause.NEAR, "it met the surface on its way"
        elif kind == "teleport":
            assert stream.restart(stream.frame(small + inside[0])) is Cause.UNANSWERED
        elif kind == "lost":
            assert stream.step(stream.frame(small + inside[0]), lost=True) is Cause.FAILED
            assert stream.step(stream.frame(small + inside[1])) is not None
        else:
            stream.restart(stream.frame(small, 10 * outside))
            assert stream.step(stream.frame(small, 10 * outside)) is None
            assert stream.step(stream.frame(small.copy(), 0.1 * inside[0])) is Cause.INSIDE, "nothing moved"
            counts[Cause.INSIDE] += 1
            continue
        for centre in inside:
            assert stream.step(stream.frame(small + centre)) is Cause.INSIDE
            counts[Cause.INSIDE] += 1
        assert stream.step(stream.frame(small + outside)) is Cause.NEAR
        assert stream.step(stream.frame(small + outside)) is None
    assert counts[Cause.INSIDE] == 75 * 4 + 25


def test_names_of_the_meshes_and_the_scale():
    stream, small = Stream(), 0.1 * BALL
    stream.restart(stream.frame(small))
    assert stream.step(stream.frame(small)) is Cause.INSIDE
    assert stream.state.why().text == "hand is inside table" and stream.state.slowdown().scale == 0
    stream.restart(stream.frame(10 * BALL))
    assert stream.step(stream.frame(10 * BALL)) is Cause.INSIDE
    assert stream.state.why().text == "table is inside hand"


def test_an_open_mesh_is_named_and_contains_nothing():
    for faces, open_meshes in ((FACES, []), (FACES[:, ::-1].copy(), []), (FACES[1:], ["table"])):
        stream, small = Stream(faces=faces), 0.1 * BALL
        frame = stream.frame(small)
        assert stream.nearness.not_closed(frame) == open_meshes
        stream.restart(frame)
        assert stream.step(stream.frame(small)) is (None if open_meshes else Cause.INSIDE)


@pytest.fixture
def start_stream(start_node):
    with contextlib.ExitStack() as stack:
        yield lambda **parameters: stack.enter_context(stop_stream.started(start_node, **parameters))


class NodeStream:
    """The same balls, sent to a node, a frame each 0.1 s of the stamps."""

    def __init__(self, stream, faces=FACES):
        self.stream, self.peer, self.stamp = stream, stream.node.peer, 0
        for name, of in zip(MESHES, (FACES, faces), strict=True):
            self.peer.topology(name, of, len(BALL))

    def send(self, centre, radius=0.1, stamp=None):
        self.stamp = self.stamp + 10**8 if stamp is None else stamp
        self.peer.vertices("hand", radius * BALL + centre, stamp=self.stamp)
        self.peer.vertices("table", 2 * BALL, stamp=self.stamp)

    def expect(self, cause, text=""):
        self.stream.status(cause, text)
        self.stream.expect(bool(cause))


def test_a_node(start_stream, tmp_path, hpccd):
    """A large step in, a rest, a way out; a teleport back in, which its stamps show; a recording of it all."""
    path = str(tmp_path / "run.mcap")
    stream = start_stream(
        stop_distance=DISTANCE,
        distances=True,
        pair_summaries=True,
        approach_time=1.0,
        record=path,
        restart_after=1,
        frame_queue=10,
    )
    heard = {"distances": [], "pairs": []}
    node, types = stream.node.peer.node, {"distances": DistanceArray, "pairs": PairSummaryArray}
    for topic, type_ in types.items():
        node.create_subscription(type_, f"{stream.node.namespace}/{topic}", heard[topic].append, 10)
        stream.node.wait_until(lambda topic=topic: node.count_publishers(f"{stream.node.namespace}/{topic}"), topic)
    balls, far = NodeStream(stream), (0, 0, 5)
    balls.send(far)
    balls.send(far)
    balls.expect("", "false: nothing is near; speed_scale 1")
    balls.send((0, 0, 0))
    balls.expect("near")
    balls.send((0, 0, 0.01))
    balls.expect("inside", "true: hand is inside table")
    balls.send(far)
    balls.send(far)
    balls.expect("")
    balls.send((0, 0, 0.01), stamp=1)
    balls.send((0, 0, 0.02))
    balls.expect("inside")
    stream.node.wait_until(lambda: min(map(len, heard.values())) == 6, "6 results")
    told = [client.distances_from_message(message) for message in heard["distances"]]
    rows = [next(row for row in range(3) if of.mesh_a[row] != of.mesh_b[row]) for of in told]
    sides = {"hand": DistanceArray.INSIDE_A, "table": DistanceArray.INSIDE_B}  # by the mesh of the first one
    inside = [
        bool(of.inside[row]) and of.inside[row] == sides[of.mesh_names[of.mesh_a[row]]]
        for of, row in zip(told, rows, strict=True)
    ]
    assert [bool(of.inside[row]) for of, row in zip(told, rows, strict=True)] == inside
    assert inside == [False, True, True, False, False, True]
    assert [of.time_to_contact[row] == 0 for of, row in zip(told, rows, strict=True)] == inside
    assert all(of.nearest == row and of.distance[row] > 1 for of, row in zip(told, rows, strict=True))
    pairs = [client.pair_summary(message, "table", "hand").inside for message in heard["pairs"]]
    assert pairs == [PairSummary.INSIDE_A * one for one in inside]
    assert not any("not closed" in line for line in stream.node.output().splitlines())
    stream.node.stop()
    done = hpccd("replay", path)
    assert done.returncode == 0 and "6 results about distances are equal" in done.stdout, done.stdout + done.stderr


def test_a_node_with_an_open_mesh(start_stream, hpccd):
    """It warns once, and its status names the mesh."""
    stream = start_stream(stop_distance=DISTANCE)
    balls = NodeStream(stream, FACES[1:])
    for _ in range(3):
        balls.send((0, 0, 0))
    balls.expect("")
    values = stream.status("")
    assert values["not_closed"] == "table"
    (warning,) = [line for line in stream.node.output().splitlines() if "not closed" in line]
    assert "[WARN]" in warning and "stop: table: not closed, so stop cannot tell whether a mesh is inside" in warning
    done = hpccd("status", f"{stream.node.namespace}/hpccd")
    assert "not closed, so whether a mesh is inside is unknown: table" in done.stdout, done.stdout + done.stderr
