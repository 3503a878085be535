# SPDX-License-Identifier: Apache-2.0
"""Rules of the assembler, one test a rule. No ROS."""

import numpy as np
import pytest

from hpccd_ros.frames.assembler import FrameAssembler
from hpccd_ros.frames.drops import Input, Reason, RejectionCounter
from hpccd_ros.frames.types import AssemblyRules, MeshFrame, MeshSettings, Topology

FACES = np.array([[0, 1, 2]], np.uint32)


def topology(version=0, n_vertices=3, faces=FACES):
    return Topology(version, n_vertices, faces)


def frame(stamp, version=0, n=3, value=0.0, step=None, frame_id="", only_publisher=True):
    vertices = np.full((n, 3), value, np.float32)
    return MeshFrame(stamp, vertices, version, step, frame_id, float(stamp), only_publisher)


class Scene:
    """An assembler, and what it gave back."""

    def __init__(self, *meshes, **options):
        self.drops, self.rejected = RejectionCounter(), RejectionCounter()
        self.restart_texts = []
        self.static_taken = 0
        meshes = [m if isinstance(m, MeshSettings) else MeshSettings(m) for m in meshes]
        self.assembler = FrameAssembler(meshes, AssemblyRules(**options))
        self.sent = 0

    def topologies(self, *names):
        for name in names:
            assert self.set_topology(name, topology()) == []
        return self

    def set_topology(self, *args, **kwargs):
        return self._frames(self.assembler.set_topology(*args, **kwargs))

    def add(self, mesh, *args, new_publisher=False, **kwargs):
        self.sent += 1
        return self._frames(self.assembler.add(mesh, frame(*args, **kwargs), new_publisher))

    def _frames(self, outcome):
        for rejection in outcome.rejections:
            (self.rejected if rejection.what is Input.TOPOLOGY else self.drops).count(rejection)
        self.restart_texts += outcome.restarts
        self.static_taken += outcome.static_taken
        return outcome.frames

    @property
    def restarts(self):
        return len(self.restart_texts)

    def dropped(self):
        return {str(reason): n for reason, n in self.drops.by_reason().items()}


def test_one_mesh_each_message_is_a_frame():
    scene = Scene("cloth").topologies("cloth")
    (first,) = scene.add("cloth", 10, value=1.0, step=7, frame_id="world")
    (second,) = scene.add("cloth", 20, value=2.0, step=8)
    assert (first.stamp, first.step, first.frame_id) == (10, 7, "world")
    assert (second.stamp, second.step, second.frame_id) == (20, 8, "world")
    assert first.vertices[0][0, 0] == 1.0 and second.received == 20.0
    assert first.same_scene(second)
    assert scene.drops.total == 0


def test_frames_without_a_step_are_numbered():
    scene = Scene("cloth").topologies("cloth")
    assert [scene.add("cloth", stamp, step=None)[0].step for stamp in (1, 2, 3)] == [0, 1, 2]


def test_two_meshes_are_joined_by_stamp_in_the_order_of_the_scene():
    scene = Scene("cloth", "ball").topologies("ball", "cloth")
    assert scene.add("ball", 10, value=2.0) == []
    assert scene.add("ball", 20, value=4.0) == []
    (first,) = scene.add("cloth", 10, value=1.0)
    (second,) = scene.add("cloth", 20, value=3.0)
    assert [v[0, 0] for v in first.vertices] == [1.0, 2.0]
    assert [v[0, 0] for v in second.vertices] == [3.0, 4.0]
    assert first.fresh == ("cloth", "ball")
    assert scene.drops.total == 0 and scene.assembler.waiting == 0


def test_incomplete_frames_before_a_complete_one_are_counted():
    scene = Scene("cloth", "ball").topologies("cloth", "ball")
    for stamp in (1, 2, 3):
        scene.add("cloth", stamp)
    (complete,) = scene.add("ball", 3)
    assert complete.stamp == 3
    assert scene.dropped() == {"incomplete": 2}
    assert scene.add("ball", 4) == [] and scene.assembler.waiting == 1


def test_waiting_frames_are_bounded_and_what_comes_too_late_is_counted():
    scene = Scene("cloth", "ball", max_pending=3).topologies("cloth", "ball")
    for stamp in range(1, 6):
        scene.add("cloth", stamp)
    assert scene.assembler.waiting == 3
    assert scene.dropped() == {"incomplete": 2}
    assert scene.add("ball", 2) == []
    assert scene.dropped() == {"incomplete": 2, "late": 1}
    assert [f.stamp for f in scene.add("ball", 3)] == [3]


def test_static_mesh_keeps_its_positions():
    scene = Scene("cloth", MeshSettings("floor", static=True)).topologies("cloth", "floor")
    assert scene.add("cloth", 1) == []
    assert scene.dropped() == {"static_missing": 1}
    assert scene.add("floor", 5, value=9.0) == []
    (complete,) = scene.add("cloth", 2)
    assert complete.vertices[1][0, 0] == 9.0
    assert complete.fresh == ("cloth",)
    assert scene.static_taken == 1


def test_unknown_mesh():
    scene = Scene("cloth").topologies("cloth")
    assert scene.add("ghost", 1) == []
    assert scene.set_topology("ghost", topology()) == []
    assert scene.dropped() == {"unknown_mesh": 1}
    assert scene.rejected.by_reason() == {Reason.UNKNOWN_MESH: 1}


def test_wrong_vertex_count():
    scene = Scene("cloth").topologies("cloth")
    assert scene.add("cloth", 1, n=4) == []
    assert scene.dropped() == {"wrong_vertex_count": 1}
    assert len(scene.add("cloth", 1)) == 1, "a rejected frame must not use up its stamp"


def test_vertices_before_their_topology_wait_for_it():
    scene = Scene("cloth", max_pending=2)
    for stamp in (1, 2, 3):
        assert scene.add("cloth", stamp) == []
    assert scene.dropped() == {"no_topology": 1}
    frames = scene.set_topology("cloth", topology())
    assert [f.stamp for f in frames] == [2, 3]


def test_topology_change_in_mid_stream():
    scene = Scene("cloth").topologies("cloth")
    (before,) = scene.add("cloth", 1)
    assert scene.add("cloth", 2, version=1, n=4) == [], "waits for topology 1"
    (after,) = scene.set_topology("cloth", topology(1, 4))
    assert after.stamp == 2 and len(after.vertices[0]) == 4
    assert not before.same_scene(after)
    assert scene.add("cloth", 3, version=0) == []
    assert scene.dropped() == {"old_topology": 1}


def test_topologies_that_overtake_vertices_lose_none():
    """A node that was busy reads all topologies first, then the vertices (nothing orders the two topics)."""
    scene = Scene("cloth").topologies("cloth")
    for version in (1, 2, 3):
        assert scene.set_topology("cloth", topology(version, 3 + version)) == []
    frames = [f for stamp in range(8) for f in scene.add("cloth", stamp, version=stamp // 2, n=3 + stamp // 2)]
    assert [f.stamp for f in frames] == list(range(8))
    assert [f.topologies[0].version for f in frames] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert [a.same_scene(b) for a, b in zip(frames, frames[1:], strict=False)] == [True, False] * 3 + [True]
    assert scene.add("cloth", 9, version=2, n=5) == []
    assert scene.dropped() == {"old_topology": 1}


def test_a_frame_skips_topologies_that_overtook_it():
    scene = Scene("cloth").topologies("cloth")
    for version in (1, 2, 3):
        scene.set_topology("cloth", topology(version))
    assert len(scene.add("cloth", 1, version=2)) == 1
    assert scene.add("cloth", 2, version=1) == [], "a frame of a later topology was accepted"
    assert len(scene.add("cloth", 3, version=2)) == 1
    assert scene.add("cloth", 4, version=2, n=4) == []
    assert len(scene.add("cloth", 5, version=3)) == 1
    assert scene.dropped() == {"old_topology": 1, "wrong_vertex_count": 1}


def test_how_many_superseded_topologies_are_kept_is_bounded():
    """By what the subscription holds (10) and the frames that may wait for a transform."""
    scene = Scene("cloth", max_pending=3).topologies("cloth")
    for version in range(1, 15):
        scene.set_topology("cloth", topology(version))
    assert scene.add("cloth", 1, version=0) == []
    assert len(scene.add("cloth", 2, version=1)) == 1
    assert scene.dropped() == {"old_topology": 1}


def test_positions_of_a_static_mesh_end_the_topologies_before():
    scene = Scene("cloth", MeshSettings("floor", static=True)).topologies("cloth")
    for version in range(5):
        scene.set_topology("floor", topology(version))
        scene.add("floor", version, version=version)
    assert not scene.assembler._meshes["floor"].topologies._superseded


def test_a_lower_version_of_a_new_publisher_begins_anew():
    scene = Scene("cloth").topologies("cloth")
    for version in (5, 6):
        scene.set_topology("cloth", topology(version))
    scene.set_topology("cloth", topology(2), new_publisher=True)
    assert len(scene.add("cloth", 1, version=2)) == 1
    assert scene.add("cloth", 2, version=0) == []
    assert scene.dropped() == {"old_topology": 1}


def test_old_and_conflicting_topologies_are_rejected():
    scene = Scene("cloth")
    scene.set_topology("cloth", topology(5))
    scene.set_topology("cloth", topology(4))
    scene.set_topology("cloth", topology(5, 9))
    assert scene.assembler.topology("cloth").n_vertices == 3
    assert scene.rejected.by_reason() == {Reason.OLD_TOPOLOGY: 1, Reason.TOPOLOGY_CONFLICT: 1}


def test_repeated_topology_changes_nothing():
    scene = Scene("cloth").topologies("cloth")
    (before,) = scene.add("cloth", 1)
    scene.set_topology("cloth", topology())
    (after,) = scene.add("cloth", 2)
    assert before.same_scene(after) and scene.rejected.total == 0


def test_new_publisher_may_count_versions_from_the_start():
    scene = Scene("cloth")
    scene.set_topology("cloth", topology(5))
    scene.set_topology("cloth", topology(0), new_publisher=True)
    assert len(scene.add("cloth", 1, version=0)) == 1


def test_backward_and_repeated_stamps():
    scene = Scene("cloth").topologies("cloth")
    assert len(scene.add("cloth", 100)) == 1
    assert scene.add("cloth", 50) == []
    assert scene.add("cloth", 100) == []
    assert len(scene.add("cloth", 101)) == 1
    assert scene.dropped() == {"stamp_backward": 1, "stamp_repeated": 1}
    assert scene.restarts == 0


def test_stream_that_goes_on_from_an_earlier_time_is_a_restart():
    scene = Scene("cloth", restart_after=3).topologies("cloth")
    scene.add("cloth", 100)
    assert [len(scene.add("cloth", stamp)) for stamp in (1, 2, 3, 4)] == [0, 0, 1, 1]
    assert scene.dropped() == {"stamp_backward": 2}
    assert scene.restarts == 1


def test_scattered_backward_stamps_are_no_restart():
    scene = Scene("cloth", restart_after=3).topologies("cloth")
    scene.add("cloth", 100)
    for stamp in (5, 4, 3, 2, 1):
        scene.add("cloth", stamp)
    for stamp in (101, 10, 102, 11, 103, 12):
        scene.add("cloth", stamp)
    assert scene.restarts == 0
    assert scene.dropped() == {"stamp_backward": 8}


def test_no_restart_where_it_is_switched_off():
    scene = Scene("cloth", restart_after=0).topologies("cloth")
    scene.add("cloth", 100)
    assert not any(scene.add("cloth", stamp) for stamp in range(1, 50))
    assert scene.dropped() == {"stamp_backward": 49}


def test_new_publisher_with_earlier_stamps_is_a_restart_at_once():
    scene = Scene("cloth", "ball").topologies("cloth", "ball")
    scene.add("cloth", 100)
    scene.add("cloth", 1, new_publisher=True)
    assert scene.dropped() == {"restart": 1}, "the frame that waited belongs to the old time"
    assert [f.stamp for f in scene.add("ball", 1)] == [1]


def test_meshes_in_different_frames():
    scene = Scene("cloth", "ball").topologies("cloth", "ball")
    scene.add("cloth", 1, frame_id="world")
    assert scene.add("ball", 1, frame_id="camera") == []
    assert scene.dropped() == {"frame_id": 1}
    assert len(scene.add("ball", 1, frame_id="")) == 1, "an empty frame_id fits all"


def test_a_stray_first_message_does_not_bind_those_that_follow():
    scene = Scene("cloth", restart_after=3).topologies("cloth")
    assert len(scene.add("cloth", 10**9, frame_id="stray")) == 1
    assert scene.assembler.coordinate_frame == ("stray", "a message of mesh cloth")
    taken = [scene.add("cloth", k, frame_id="world") for k in (1, 2, 3, 4)]
    assert [len(frames) for frames in taken] == [0, 0, 1, 1] and taken[2][0].frame_id == "world"
    assert scene.dropped() == {"frame_id": 2}
    assert scene.assembler.coordinate_frame == ("world", "a message of mesh cloth")
    assert scene.restarts == 1 and "'world' after 'stray'" in scene.restart_texts[0]


def test_a_new_publisher_brings_its_frame_at_once():
    scene = Scene("cloth", "ball", restart_after=0).topologies("cloth", "ball")
    for mesh in ("cloth", "ball"):
        (*_, before) = [None, *scene.add(mesh, 10, frame_id="world")]
    for mesh in ("cloth", "ball"):  # later stamps: only the frame tells
        (*_, after) = [None, *scene.add(mesh, 20, frame_id="map", new_publisher=True)]
    assert (before.frame_id, after.frame_id) == ("world", "map")
    assert not before.same_scene(after), "no motion leads from one coordinate frame into another"
    assert scene.drops.total == 0 and scene.restarts == 1
    assert scene.add("cloth", 30, frame_id="world") == []
    assert scene.dropped() == {"frame_id": 1}


def test_a_new_publisher_beside_another_one_does_not_take_the_frame_from_it():
    scene = Scene("cloth", restart_after=0).topologies("cloth")
    scene.add("cloth", 1, frame_id="world")
    assert scene.add("cloth", 2, frame_id="stray", new_publisher=True, only_publisher=False) == []
    assert len(scene.add("cloth", 3, frame_id="world")) == 1
    assert scene.restarts == 0


def test_new_publisher_is_noticed_although_its_first_frames_are_rejected():
    scene = Scene("cloth", restart_after=0).topologies("cloth")
    scene.add("cloth", 100, frame_id="world")
    assert scene.add("cloth", 1, n=4, frame_id="map", new_publisher=True) == []
    (taken,) = scene.add("cloth", 2, frame_id="map")
    assert taken.frame_id == "map" and scene.restarts == 1
    assert scene.add("cloth", 1, frame_id="map") == [], "only once"
    assert scene.dropped() == {"wrong_vertex_count": 1, "stamp_backward": 1}


def test_meshes_in_two_frames_do_not_take_turns():
    scene = Scene("cloth", "ball", restart_after=3).topologies("cloth", "ball")
    for stamp in range(20):
        assert scene.add("cloth", stamp, frame_id="world") == scene.add("ball", stamp, frame_id="camera") == []
    assert scene.restarts == 0 and scene.assembler.coordinate_frame[0] == "world"
    assert scene.dropped()["frame_id"] == 20


def test_demanded_frame_never_changes():
    scene = Scene("cloth", frame_id="world", restart_after=2).topologies("cloth")
    assert not any(scene.add("cloth", stamp, frame_id="odom", new_publisher=True) for stamp in range(9))
    assert scene.dropped() == {"frame_id": 9}
    assert scene.assembler.coordinate_frame == ("world", "parameter frame_id")


def test_frame_is_that_of_the_restarted_stream():
    scene = Scene("cloth", restart_after=2).topologies("cloth")
    scene.add("cloth", 100, frame_id="world")
    (*_, first) = [*scene.add("cloth", 1, frame_id="map"), *scene.add("cloth", 2, frame_id="map")]
    assert (first.stamp, first.frame_id) == (2, "map")
    scene.add("cloth", 1, frame_id="map")
    (again,) = scene.add("cloth", 2, frame_id="map", new_publisher=True)
    assert again.frame_id == "map", "a restart in the same frame keeps it"


def static_scene(**options):
    return Scene("cloth", MeshSettings("floor", static=True), **options).topologies("cloth", "floor")


def test_static_positions_are_used_in_their_own_frame_only():
    scene = static_scene(restart_after=2)
    assert scene.add("floor", 0, value=1.0, frame_id="world") == []
    scene.add("cloth", 1, frame_id="stray")
    assert scene.dropped() == {"static_missing": 1}
    assert "'world', the scene is in 'stray'" in scene.assembler.warnings()[0]
    scene.add("cloth", 2, frame_id="world")
    (complete,) = scene.add("cloth", 3, frame_id="world")
    assert (complete.frame_id, complete.vertices[1][0, 0]) == ("world", 1.0)
    assert scene.assembler.warnings() == []
    # A restarted simulation sends the floor first; what it had in the other frame is not mixed in, but kept.
    scene.add("floor", 0, value=5.0, frame_id="map", new_publisher=True)
    assert scene.add("cloth", 4, frame_id="world")[0].vertices[1][0, 0] == 1.0
    (complete,) = scene.add("cloth", 1, frame_id="map", new_publisher=True)
    assert (complete.frame_id, complete.vertices[1][0, 0]) == ("map", 5.0)


def test_scene_without_a_frame_has_that_of_its_static_mesh():
    scene = static_scene()
    scene.add("floor", 0, frame_id="world")
    assert scene.add("cloth", 1)[0].frame_id == "world"


def test_static_positions_in_many_frames_are_bounded():
    scene = static_scene()
    for k in range(100):
        scene.add("floor", 0, value=k, frame_id=f"frame{k}")
    complete = [len(scene.add("cloth", k, frame_id=f"frame{k}", new_publisher=True)) for k in (50, 95, 96, 99)]
    assert complete == [0, 0, 1, 1]


def test_demanded_frame_id():
    scene = Scene("cloth", frame_id="world").topologies("cloth")
    assert scene.add("cloth", 1, frame_id="odom") == []
    (complete,) = scene.add("cloth", 2, frame_id="world")
    assert complete.frame_id == "world"
    assert scene.dropped() == {"frame_id": 1}


def test_nearest_stamps_with_a_slower_mesh():
    scene = Scene("fast", "slow", tolerance=60).topologies("fast", "slow")
    out = []
    for stamp in range(0, 400, 20):
        out += scene.add("fast", stamp, value=stamp)
        if stamp % 100 == 0:
            out += scene.add("slow", stamp + 5, value=stamp + 5)
    assert [f.stamp for f in out] == list(range(0, 301, 20)), "later ones wait: a nearer slow frame may come"
    for f in out:
        nearest = min(range(5, 400, 100), key=lambda s: abs(s - f.stamp))
        assert f.vertices[1][0, 0] == nearest
    used = sum(len(f.fresh) for f in out)
    assert used + scene.drops.total + scene.assembler.waiting == scene.sent


def test_nearest_stamps_outside_of_the_tolerance():
    scene = Scene("a", "b", tolerance=3).topologies("a", "b")
    scene.add("a", 100)
    assert scene.add("b", 110) == []
    assert scene.dropped() == {"incomplete": 1}
    scene.add("a", 109)
    assert scene.assembler.waiting == 0


def test_nearest_waiting_is_bounded():
    scene = Scene("a", "b", tolerance=3, max_pending=4).topologies("a", "b")
    for stamp in range(20):
        scene.add("a", stamp)
    assert scene.assembler.waiting == 4
    assert scene.dropped() == {"incomplete": 16}
    for stamp in range(100, 120):
        scene.add("b", stamp)
    assert scene.assembler.waiting <= 8


@pytest.mark.parametrize("tolerance", [None, 4])
def test_no_message_is_unaccounted_for(tolerance):
    rng = np.random.default_rng(3)
    scene = Scene("a", "b", MeshSettings("floor", static=True), tolerance=tolerance, restart_after=4)
    used = 0
    for i in range(5000):
        mesh = rng.choice(["a", "b", "a", "b", "floor", "ghost"])
        stamp = i // 8 + int(rng.integers(-2, 3))  # now and then backward, repeated, late
        n, version = int(rng.choice([3, 3, 3, 4])), int(rng.choice([3, 3, 3, 2, 4]))
        new_publisher = bool(rng.random() < 0.01)
        frames = scene.add(mesh, stamp, n=n, version=version, new_publisher=new_publisher)
        used += sum(len(f.fresh) for f in frames)
        if rng.random() < 0.02:
            new = topology(int(rng.integers(0, 4)), int(rng.choice([3, 3, 4])))
            for f in scene.set_topology(rng.choice(["a", "b", "floor"]), new):
                used += len(f.fresh)
    accounted = used + scene.drops.total + scene.assembler.waiting + scene.static_taken
    assert accounted == scene.sent
    assert used > 50
    assert {"wrong_vertex_count", "old_topology", "stamp_backward"} <= scene.dropped().keys()
    for rejection in scene.assembler.clear(Reason.STOPPED):
        scene.drops.count(rejection)
    assert scene.assembler.waiting == 0
    assert used + scene.drops.total + scene.static_taken == scene.sent


def test_scene_that_cannot_move_is_rejected():
    with pytest.raises(ValueError, match="at least one mesh must not be static"):
        Scene(MeshSettings("floor", static=True))


def test_names_must_differ():
    with pytest.raises(ValueError, match="names must differ"):
        Scene("a", "a")
