# SPDX-License-Identifier: Apache-2.0
"""Rigid motions, the tree of frames over time, and frames of a mesh that wait for their transform."""

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st

from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.frames import samples, transform_buffer
from hpccd_ros.frames.arrivals import RateLimit
from hpccd_ros.frames.drops import Input, Reason
from hpccd_ros.frames.transform_buffer import NoTransformError, TransformBuffer
from hpccd_ros.frames.transformer import MeshTransformer
from hpccd_ros.frames.types import MeshFrame, MeshSettings
from hpccd_ros.middleware import topic_names, transform_topics

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
SECOND = 10**9


def turn(degrees, shift=(0.0, 0.0, 0.0)):
    """About z, then ``shift``."""
    half = np.radians(degrees) / 2
    return Rigid.of(shift, (0.0, 0.0, np.sin(half), np.cos(half)))


components = st.floats(-1, 1).filter(lambda x: x == 0 or abs(x) > 1e-3)


@st.composite
def rigids(draw):
    quaternion = np.array([draw(components) for _ in range(4)])
    if not quaternion.any():
        quaternion[3] = 1.0
    return Rigid.of([10 * draw(components) for _ in range(3)], quaternion / np.linalg.norm(quaternion))


@given(rigids(), rigids())
def test_motions_compose_and_invert(a, b):
    assert np.allclose(b.after(a).apply(POINTS), b.apply(a.apply(POINTS)), atol=1e-12)
    assert np.allclose(a.inverse().apply(a.apply(POINTS)), POINTS, atol=1e-12)
    edges = np.linalg.norm(np.diff(POINTS, axis=0), axis=1)
    assert np.allclose(np.linalg.norm(np.diff(a.apply(POINTS), axis=0), axis=1), edges, atol=1e-12)
    assert np.allclose(a.between(b, 0.0).apply(POINTS), a.apply(POINTS), atol=1e-9)
    assert np.allclose(a.between(b, 1.0).apply(POINTS), b.apply(POINTS), atol=1e-9)


def test_rotation_between_two_samples_has_constant_speed():
    for t in (0.25, 0.5, 0.75):
        assert np.allclose(turn(10).between(turn(130), t).apply(POINTS), turn(10 + 120 * t).apply(POINTS))


def test_lookup_along_the_tree():
    buffer = TransformBuffer()
    buffer.add("world", "base", Rigid.of((1, 0, 0), (0, 0, 0, 1)), None)
    buffer.add("base", "hand", turn(0), 1 * SECOND)
    buffer.add("base", "hand", turn(90, (0, 0, 2)), 2 * SECOND)
    buffer.add("world", "/camera", turn(180), None)  # names with the slash of ROS 1 are the same frames
    at = buffer.lookup("hand", "world", 3 * SECOND // 2)
    assert np.allclose(at.apply(POINTS), turn(45, (1, 0, 1)).apply(POINTS))
    there = buffer.lookup("hand", "camera", 2 * SECOND)
    assert np.allclose(there.apply(POINTS), turn(180).inverse().after(turn(90, (1, 0, 2))).apply(POINTS))
    assert buffer.lookup("anything", "anything", 0) is IDENTITY


@pytest.mark.parametrize(
    "source, stamp, text, final",
    [
        ("hand", 3, "before the stamp", False),
        ("hand", 0, "after the stamp", True),
        ("foot", 1, "no transform connects 'foot' and 'world'", False),
        ("head", 1, "form a loop", False),
    ],
    ids=["not yet", "never", "unknown", "loop"],
)
def test_missing_transforms_say_what_is_missing(source, stamp, text, final):
    buffer = TransformBuffer()
    for k in (1, 2):
        buffer.add("world", "hand", turn(0), k * SECOND)
    buffer.add("neck", "head", turn(0), None)
    buffer.add("head", "neck", turn(0), None)
    with pytest.raises(NoTransformError, match=text) as caught:
        buffer.lookup(source, "world", stamp * SECOND)
    assert caught.value.final == final


def test_untrusted_transforms_are_bounded(monkeypatch):
    buffer = TransformBuffer()
    for k in range(30):
        buffer.add("world", "hand", turn(k), k * SECOND)
    with pytest.raises(NoTransformError):
        buffer.lookup("hand", "world", 15 * SECOND)  # older than ten seconds
    buffer.lookup("hand", "world", 25 * SECOND)
    monkeypatch.setattr(transform_buffer, "MOST_FRAMES", 2)
    buffer.add("world", "foot", turn(0), None)
    with pytest.raises(ValueError, match="exceeds the limit of 2 frames"):
        buffer.add("world", "tail", turn(0), None)
    for parent, child in (("", "a"), ("a", ""), ("a", "/a")):
        with pytest.raises(ValueError, match="two different names"):
            buffer.add(parent, child, turn(0), None)
    with pytest.raises(ValueError, match="255 characters"):
        buffer.add("world", "x" * 256, turn(0), None)
    for k in range(3 * samples.MOST_SAMPLES):
        buffer.add("world", "hand", turn(0), 100 * SECOND + k)
    with pytest.raises(NoTransformError, match="the oldest stored one"):
        buffer.lookup("hand", "world", 100 * SECOND + 2 * samples.MOST_SAMPLES - 1)
    buffer.lookup("hand", "world", 100 * SECOND + 2 * samples.MOST_SAMPLES)


def test_the_account_of_what_was_heard_is_bounded_and_names_the_likeliest_first():
    buffer = TransformBuffer()
    assert buffer.account("hand") == "frames known: none"
    for k in range(30):
        buffer.add("world", f"link_{k}", IDENTITY, None)
    buffer.add("world", "right/hand", IDENTITY, None)
    buffer.received |= {"/tf": 31, "/tf_static": 0, "/transforms": "not understood"}
    text = buffer.account("left/hand")
    assert text.startswith(
        "received: /tf 31 messages, /tf_static no messages, /transforms not understood; frames known: "
    )
    assert text.endswith(
        "known: right/hand, link_0, world, " + ", ".join(f"link_{k}" for k in range(1, 8)) + " and 22 more"
    )
    buffer.add("w" * 255, "x" * 255, IDENTITY, None)
    assert len(buffer.account("x")) < 2000


def test_a_transform_far_ahead_is_left_out_by_the_next_one_and_told_of():
    topic = transform_topics.ALL[topic_names.TRANSFORMS]
    buffer = TransformBuffer()
    found = []
    for second in (1, 2, 3600, 3):
        message = TransformStamped(child_frame_id="hand")
        message.header.frame_id, message.header.stamp.sec = "world", second
        message.transform.translation.x = float(second)
        found += transform_topics.fill(buffer, message, topic)
        if second == 3600:
            with pytest.raises(NoTransformError, match="far ahead of the stamp 2500000000 ns") as caught:
                buffer.lookup("hand", "world", 5 * SECOND // 2)
            assert not caught.value.final
    (rejection,) = found
    assert (rejection.what, rejection.reason) == (Input.TRANSFORM, Reason.AHEAD)
    assert rejection.text.startswith(
        "transform from 'hand': one of stamp 3600000000000 ns came more than 10 s ahead of"
    )
    assert buffer.lookup("hand", "world", 5 * SECOND // 2).shift[0] == 2.5


@pytest.mark.parametrize("static", [False, True])
def test_transform_of_no_time_is_rejected(static):
    message = TransformStamped(child_frame_id="hand")
    message.header.frame_id, message.header.stamp.nanosec = "world", SECOND
    buffer = TransformBuffer()
    topic = transform_topics.ALL["transforms_static" if static else "transforms"]
    (rejection,) = transform_topics.fill(buffer, message, topic)
    assert (rejection.mesh, rejection.reason, rejection.what) == (topic.name, Reason.MALFORMED, Input.TRANSFORM)
    assert "transform from 'hand' to 'world': stamp has sec 0 and nanosec 1000000000" in rejection.text
    with pytest.raises(NoTransformError, match="no transform connects"):
        buffer.lookup("hand", "world", SECOND)


def test_source_that_starts_fresh_is_not_mixed_with_its_past():
    buffer = TransformBuffer()
    buffer.add("world", "hand", turn(0), 100 * SECOND)
    for k in (1, 2):
        buffer.add("world", "hand", turn(90 * k), k * SECOND)
    assert np.allclose(buffer.lookup("hand", "world", 2 * SECOND).apply(POINTS), turn(180).apply(POINTS))
    with pytest.raises(NoTransformError):
        buffer.lookup("hand", "world", 50 * SECOND)


MS = 10**6
BEFORE, NOW = turn(0), turn(90)


def after_a_short_run(*now):
    """Transforms of half a second, then those at the milliseconds ``now``."""
    buffer = TransformBuffer()
    for stamp in range(0, 500, 10):
        buffer.add("world", "hand", BEFORE, stamp * MS)
        buffer.add("world", "foot", BEFORE, stamp * MS)
    for stamp in now:
        buffer.add("world", "hand", NOW, stamp * MS)
    return buffer


def of_now(buffer, stamp, source="hand"):
    """Whether what is found is of the run of now; None: nothing is found."""
    try:
        found = buffer.lookup(source, "world", stamp * MS)
    except NoTransformError:
        return None
    return np.allclose(found.quaternion, NOW.quaternion)


def test_a_run_shorter_than_a_second_is_told_from_what_is_late_by_its_order():
    late = after_a_short_run(100, 120, 90, 490, 200, 210, 220, 230, 500)
    assert [of_now(late, stamp) for stamp in (0, 100, 105, 120, 300, 495)] == [False, True, False, True, False, True]
    fresh = after_a_short_run(5, 15, 25, 35, 45)
    assert [of_now(fresh, stamp) for stamp in (0, 10, 30, 45, 50, 300)] == [None, True, True, True, None, None]
    assert of_now(fresh, 100, "foot") is None, "of another frame, and from before as well"
    fresh.add("world", "foot", NOW, 20 * MS)
    assert of_now(fresh, 20, "foot")


def test_more_samples_behind_than_are_kept():
    buffer = TransformBuffer()
    for stamp in range(samples.MOST_SAMPLES):
        buffer.add("world", "hand", BEFORE, SECOND + stamp * MS // 10)
    for stamp in range(20):
        buffer.add("world", "hand", NOW, SECOND - 10 * MS + stamp * MS // 10)
    assert of_now(buffer, 1050) is None and of_now(buffer, 991)


@pytest.mark.parametrize("now", [(), (5,), (5, 15), (5, 15, 25, 35, 45), tuple(range(5, 400, 10))])
def test_where_a_mesh_begins_fresh_nothing_from_before_is_used(now):
    buffer = after_a_short_run(*now)
    buffer.forget_future(10 * MS)
    buffer.forget_future(10 * MS)
    found = [of_now(buffer, stamp) for stamp in range(0, 500, 5)]
    assert found == [True if now and now[0] <= stamp <= now[-1] else None for stamp in range(0, 500, 5)]
    assert of_now(buffer, 100, "foot") is None


def test_frames_of_a_new_publisher_wait_for_transforms_of_its_run():
    buffer = after_a_short_run()
    gate = Gate(buffer, transform="tf")
    assert gate.transform(frame(400 * MS)) and gate.transform(frame(10 * MS), new_publisher=True) == []
    for stamp in (0, 8, 16):
        buffer.add("world", "hand", NOW, stamp * MS)
    ((placed, new),) = gate.retry()
    assert new and np.allclose(placed.vertices, NOW.apply(POINTS)) and not gate.rejections


class Gate:
    """A transformer to the frame "world", and what it gave back."""

    def __init__(self, buffer=None, **settings):
        mesh = MeshSettings("cloth", **settings)
        self.transformer = MeshTransformer(mesh, "world", 2, buffer if buffer is not None else TransformBuffer())
        self.rejections = []

    def transform(self, given, new_publisher=False):
        return self._frames(self.transformer.transform(given, new_publisher))

    def retry(self):
        return self._frames(self.transformer.retry())

    def _frames(self, transformed):
        self.rejections += transformed.rejections
        return transformed.frames

    @property
    def waiting(self):
        return self.transformer.waiting

    def warnings(self):
        return self.transformer.warnings()

    def reasons(self):
        return [rejection.reason for rejection in self.rejections]


def frame(stamp, frame_id="hand"):
    return MeshFrame(stamp, POINTS.astype(np.float32), frame_id=frame_id)


def test_positions_are_untouched_where_nothing_is_asked_for():
    given = frame(1, "anything")
    assert Gate().transform(given) == [(given, False)]


def test_placed_by_a_pose():
    ((placed, new),) = Gate(transform="pose", frame="hand", pose=[0, 0, 1, 0, 0, 0, 1]).transform(frame(1), True)
    assert new and placed.frame_id == "world" and placed.vertices.dtype == np.float64
    assert np.array_equal(placed.vertices, POINTS + [0, 0, 1])
    gate = Gate(transform="pose", frame="hand")
    assert gate.transform(frame(1, "foot")) == []
    assert [(rejection.mesh, rejection.reason) for rejection in gate.rejections] == [("cloth", Reason.FRAME_ID)]


def test_a_transform_can_push_positions_out_of_range():
    buffer = TransformBuffer()
    far = Rigid.of((2e150, 0, 0), (0, 0, 0, 1))
    buffer.add("world", "hand", far, None)
    by_pose = {"transform": "pose", "pose": [*far.shift.tolist(), 0, 0, 0, 1]}
    for gate in (Gate(**by_pose), Gate(buffer, transform="tf")):
        assert gate.transform(frame(1)) == [] and gate.waiting == 0
        assert gate.reasons() == [Reason.OUT_OF_RANGE]


def test_frames_wait_in_order_for_their_transforms(warned_at_once):
    buffer = TransformBuffer()
    gate = Gate(buffer, transform="tf", frame="hand")
    assert gate.transform(frame(1 * SECOND)) == gate.transform(frame(2 * SECOND, "")) == [] and gate.waiting == 2
    assert "no transform connects 'hand' and 'world'" in gate.warnings()[0]
    assert gate.transform(frame(3 * SECOND)) == [] and gate.waiting == 2, "the oldest gave way"
    assert gate.reasons() == [Reason.NO_TRANSFORM] and "no transform connects" in gate.rejections[0].text
    for k in (2, 3):
        buffer.add("world", "hand", turn(90 * k), k * SECOND)
    ready = gate.retry()
    assert [f.stamp for f, _ in ready] == [2 * SECOND, 3 * SECOND] and gate.waiting == 0 and not gate.warnings()
    assert np.allclose(ready[0][0].vertices, turn(180).apply(POINTS))
    assert gate.transform(frame(SECOND)) == [] and gate.waiting == 0, "older than what is kept: will never come"
    assert gate.reasons() == [Reason.NO_TRANSFORM] * 2
    gate.transform(frame(9 * SECOND))
    assert [rejection.reason for rejection in gate.transformer.clear(Reason.STOPPED)] == [Reason.STOPPED]
    assert gate.waiting == 0


def test_a_frame_without_any_transform_holds_up_nobody(warned_at_once):
    buffer = TransformBuffer()
    gate = Gate(buffer, transform="tf")
    buffer.add("world", "hand", turn(0), 2 * SECOND)
    assert gate.transform(frame(1 * SECOND, "ghost")) == [] and gate.waiting == 1
    assert "no transform connects 'ghost' and 'world'" in gate.warnings()[0]
    assert [f.stamp for f, _ in gate.transform(frame(2 * SECOND))] == [2 * SECOND]
    assert gate.waiting == 0 and gate.reasons() == [Reason.NO_TRANSFORM]
    assert "no transform connects 'ghost'" in gate.rejections[0].text and "a later frame" in gate.rejections[0].text
    # Late transforms are waited for, in order, and a ghost between them gives way with the first that is ready.
    assert gate.transform(frame(3 * SECOND, "ghost")) == gate.transform(frame(4 * SECOND)) == [] and gate.waiting == 2
    buffer.add("world", "hand", turn(0), 4 * SECOND)
    assert [f.stamp for f, _ in gate.retry()] == [4 * SECOND] and gate.waiting == 0
    assert gate.reasons() == [Reason.NO_TRANSFORM] * 2


def test_a_ghost_that_becomes_known_in_time_is_placed_in_order():
    buffer = TransformBuffer()
    gate = Gate(buffer, transform="tf")
    buffer.add("world", "hand", turn(0), SECOND)
    assert gate.transform(frame(2 * SECOND, "ghost")) == gate.transform(frame(3 * SECOND)) == [] and gate.waiting == 2
    buffer.add("world", "ghost", turn(0), None)
    assert [f.stamp for f, _ in gate.retry()] == [2 * SECOND] and gate.waiting == 1
    buffer.add("world", "hand", turn(0), 3 * SECOND)
    assert [f.stamp for f, _ in gate.retry()] == [3 * SECOND] and not gate.rejections


def test_a_new_publisher_is_noticed_although_its_first_frame_is_rejected():
    buffer = TransformBuffer()
    buffer.add("world", "hand", turn(0), None)
    gate = Gate(buffer, transform="tf")
    for rejected in (frame(1, ""), frame(1, "ghost")):
        assert gate.transform(rejected, new_publisher=True) == []
        assert [new for k in (2, 3) for _, new in gate.transform(frame(k))] == [True, False]


def test_frame_to_transform_from_must_be_named():
    gate = Gate(transform="tf")
    assert gate.transform(frame(1, "")) == []
    assert gate.reasons() == [Reason.FRAME_ID]


def test_rate_limit():
    now = [0.0]
    limit = RateLimit(10.0, clock=lambda: now[0])
    assert [limit.allows() for _ in range(11)] == [True] * 10 + [False], "a burst of one second's worth"
    now[0] = 0.25
    assert [limit.allows() for _ in range(3)] == [True, True, False]
    now[0] = 100.0
    assert sum(limit.allows() for _ in range(20)) == 10
    assert all(RateLimit(0.0, clock=lambda: 0.0).allows() for _ in range(1000))
