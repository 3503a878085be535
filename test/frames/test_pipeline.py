# SPDX-License-Identifier: Apache-2.0
"""Messages through the pipeline: input, output, and nothing lost in between. No ROS."""

import numpy as np
import pytest
from pipelines import reasons, retried

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.frames.drops import Input, Reason
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import AssemblyRules, MeshFrame, MeshSettings, Topology

FACES = np.array([[0, 1, 2]], np.uint32)
CLOTH, BALL, FLOOR = MeshSettings("cloth"), MeshSettings("ball"), MeshSettings("floor", static=True)
IN_HAND = MeshSettings("cloth", transform="tf", frame="hand")
UP = Rigid.of((0, 0, 1), (0, 0, 0, 1))


def topology(version=0, n_vertices=3):
    return Topology(version, n_vertices, FACES)


def frame(stamp, n=3, frame_id="", version=0):
    return MeshFrame(stamp, np.full((n, 3), stamp, np.float64), version, frame_id=frame_id)


def pipeline_of(*meshes, **options):
    made = FramePipeline(meshes, AssemblyRules(**options))
    for mesh in meshes:
        outcome = made.push(mesh.name, topology())
        assert (outcome.frames, outcome.rejections) == ([], [])
    return made


def enqueued(pipeline, outcome):
    for each in outcome.frames:
        outcome.rejections += pipeline.enqueue(each)
    return outcome


def stamps(frames):
    return [frame.stamp for frame in frames]


def test_a_message_of_the_only_mesh_is_a_frame():
    outcome = pipeline_of(CLOTH).push("cloth", frame(7))
    assert stamps(outcome.frames) == [7] and outcome.rejections == outcome.restarts == []


def test_a_frame_comes_up_with_the_message_that_completes_it():
    pipeline = pipeline_of(CLOTH, BALL)
    assert pipeline.push("cloth", frame(1)).frames == pipeline.push("cloth", frame(2)).frames == []
    assert pipeline.waiting == 2
    outcome = pipeline.push("ball", frame(2))
    assert stamps(outcome.frames) == [2] and reasons(outcome) == [("cloth", "incomplete")]
    assert "stamp 1 ns has no frame of ball" in outcome.rejections[0].text
    assert pipeline.waiting == 0


@pytest.mark.parametrize("moved", ["tf", "joints"])
def test_where_nobody_sends_what_is_missing_no_stamp_is_blamed(moved):
    link = MeshSettings("link", input=moved, frame="link_frame")
    pipeline = pipeline_of(CLOTH, link, frame_id="world", max_pending=1)
    outcomes = [pipeline.push("cloth", frame(stamp)) for stamp in (1, 2)]
    (text,) = {rejection.text for outcome in outcomes for rejection in outcome.rejections if rejection.mesh == "cloth"}
    assert text.startswith("stamp 1 ns has no frame of link; descriptions, joint states or transforms for that stamp")


def test_rejections_say_what_they_are_of():
    pipeline = pipeline_of(CLOTH)
    (of_vertices,) = pipeline.push("cloth", frame(1, n=4)).rejections
    (of_topology,) = pipeline.push("cloth", topology(n_vertices=9)).rejections
    assert (of_vertices.what, of_vertices.reason) == (Input.VERTICES, Reason.WRONG_COUNT)
    assert (of_topology.what, of_topology.reason) == (Input.TOPOLOGY, Reason.TOPOLOGY_CONFLICT)


def test_a_topology_lets_the_frames_go_on_that_waited_for_it():
    pipeline = pipeline_of(CLOTH)
    assert pipeline.push("cloth", frame(1, version=1)).frames == []
    assert stamps(pipeline.push("cloth", topology(version=1)).frames) == [1]


def test_a_restart_is_told():
    pipeline = pipeline_of(CLOTH, restart_after=2)
    outcomes = [pipeline.push("cloth", frame(stamp)) for stamp in (100, 1, 2)]
    assert [stamps(outcome.frames) for outcome in outcomes] == [[100], [], [2]]
    assert reasons(outcomes[1]) == [("cloth", "stamp_backward")]
    assert outcomes[2].restarts == ["mesh cloth continues from stamp 2 ns after 100 ns: taken as a restart"]
    pipeline.set_restart_after(0)
    assert not any(pipeline.push("cloth", frame(1)).restarts for _ in range(9))


def test_frames_wait_for_their_transforms(warned_at_once):
    pipeline = pipeline_of(IN_HAND, frame_id="world")
    assert pipeline.push("cloth", frame(1)).frames == [] and pipeline.waiting == 1
    assert "no transform connects 'hand' and 'world'" in pipeline.awaited_transform("cloth")[0]
    pipeline.transforms.add("world", "hand", UP, None)
    (placed,) = retried(pipeline).frames
    assert placed.frame_id == "world" and placed.vertices[0].tolist() == [[1, 1, 2]] * 3
    assert retried(pipeline).frames == pipeline.awaited_transform("cloth") == []


def test_frames_that_one_transform_lets_go_on_come_up_one_by_one():
    pipeline = pipeline_of(IN_HAND, frame_id="world")
    for stamp in (1, 2, 3):
        pipeline.push("cloth", frame(stamp))
    pipeline.transforms.add("world", "hand", UP, None)
    assert [stamps(outcome.frames) for outcome in pipeline.retry()] == [[], [1], [2], [3]]


def test_positions_from_a_file_are_not_transformed():
    pipeline = FramePipeline((CLOTH, FLOOR), AssemblyRules())
    assert pipeline.load("floor", topology(), frame(0)).static_taken == 0, "no message"
    pipeline.push("cloth", topology())
    (complete,) = pipeline.push("cloth", frame(5)).frames
    assert complete.fresh == ("cloth",) and complete.vertices[1][0, 0] == 0


def test_what_the_queue_has_no_room_for_comes_up_as_overload():
    pipeline = pipeline_of(CLOTH, BALL)
    queue = pipeline.start(1)
    for stamp in (1, 2):
        pipeline.push("cloth", frame(stamp))
        assert enqueued(pipeline, pipeline.push("ball", frame(stamp))).rejections == []
    pipeline.push("cloth", frame(3))
    outcome = enqueued(pipeline, pipeline.push("ball", frame(3)))
    assert stamps(outcome.frames) == [3] and reasons(outcome) == [("cloth", "overload"), ("ball", "overload")]
    assert [(queue.pop().frame.stamp) for _ in range(2)] == [1, 3]


def test_stopped_with_all_that_waits(warned_at_once):
    held = MeshSettings("held", transform="tf")
    pipeline = pipeline_of(held, BALL, frame_id="world")
    pipeline.transforms.add("world", "hand", UP, None)
    queue = pipeline.start(5)
    pipeline.push("held", frame(1, frame_id="hand"))
    assert stamps(enqueued(pipeline, pipeline.push("ball", frame(1))).frames) == [1]  # in the queue
    pipeline.push("ball", frame(2))  # waits for the other mesh
    pipeline.push("held", frame(3, frame_id="foot"))  # waits for a transform
    pipeline.push("ball", frame(4, version=1))  # waits for a topology
    assert pipeline.waiting == 5
    outcome = pipeline.stop()
    assert sorted(reasons(outcome)) == [("ball", "stopped")] * 3 + [("held", "stopped")] * 2
    assert pipeline.waiting == 0 and queue.pop() is None
    assert pipeline.stop().rejections == []
    # The transforms are forgotten, the topologies are not.
    pipeline.start(5)
    assert pipeline.push("held", frame(1, frame_id="hand")).frames == [] and pipeline.awaited_transform("held")
    assert pipeline.topology("ball") is not None


@pytest.mark.parametrize("queued", [False, True], ids=["replay", "node"])
def test_no_message_is_unaccounted_for(queued):
    rng = np.random.default_rng(7)
    held = MeshSettings("cloth", transform="tf")
    pipeline = pipeline_of(held, BALL, FLOOR, frame_id="world", restart_after=4)
    queue = pipeline.start(2) if queued else None
    sent = processed = rejected = 0
    for i in range(3000):
        mesh = rng.choice(["cloth", "ball", "cloth", "ball", "floor"])
        stamp = i // 6 + int(rng.integers(-2, 3))
        frame_id = rng.choice(["hand", "ghost"], p=[0.95, 0.05]) if mesh == "cloth" else "world"
        outcomes = [pipeline.push(mesh, frame(stamp, int(rng.choice([3, 3, 3, 4])), frame_id))]
        sent += 1
        if i % 5 == 0:
            pipeline.transforms.add("world", "hand", UP, i // 6)
            outcomes.append(retried(pipeline))
        for outcome in outcomes:
            if queue is not None:
                enqueued(pipeline, outcome)
            rejected += len(outcome.rejections)
            processed += outcome.static_taken
            if queue is None:
                processed += sum(len(f.fresh) for f in outcome.frames)
        if queue is not None and rng.random() < 0.2 and queue.frames():
            processed += len(queue.pop().frame.fresh)
        assert processed + rejected + pipeline.waiting == sent
    rejected += len(pipeline.stop().rejections)
    assert processed + rejected == sent and processed > 100 and rejected > 100
