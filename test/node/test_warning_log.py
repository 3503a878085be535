# SPDX-License-Identifier: Apache-2.0
"""Each cause is in the log once, until it has been gone for a while."""

import math

import pytest

from hpccd_core.rigid.transform import IDENTITY
from hpccd_ros.node.joint_state_watch import JointStateWatch
from hpccd_ros.node.silence import Silence
from hpccd_ros.node.warning_log import WarningLog
from hpccd_ros.robots.urdf import RobotJoint


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def log(clock):
    """tell(seconds, new, lasting): looks once a second for so long; returns what is logged."""
    logged = []
    written = WarningLog(logged.append, clock)

    def tell(seconds, new=(), lasting=()):
        logged.clear()
        for _ in range(seconds):
            clock.now += 1.0
            written.tell(new, lasting)
        return list(logged)

    return tell


def test_a_cause_that_lasts_is_logged_once(log):
    assert log(2, ["no transform"]) == []
    assert log(60, ["no transform"]) == ["no transform"]


def test_what_has_lasted_is_logged_at_once(log):
    assert log(60, lasting=["/points: no message"]) == ["/points: no message"]


def test_a_cause_that_comes_and_goes_within_a_moment_is_not_logged(log):
    for _ in range(5):
        assert log(2, ["flicker"]) == [] and log(1) == []


def test_a_cause_comes_back_as_a_new_episode(log):
    assert log(3, ["x"]) == ["x"]
    assert log(8) == [] and log(3, ["x"]) == [], "gone for too short a time"
    assert log(11) == [] and log(3, ["x"]) == ["x"]


def test_numbers_with_exponents_make_no_new_cause(log):
    said = [line for k in range(9) for line in log(1, [f"joint elbow is at {1234567.0 + 10 * k:g} rad"])]
    assert said == ["joint elbow is at 1.23459e+06 rad"]


def test_numbers_make_no_new_cause_but_names_do(log):
    assert log(3, ["stamp 12 ns, 1,000 more, -1.5"]) == ["stamp 12 ns, 1,000 more, -1.5"]
    assert log(5, ["stamp 13 ns, 7 more, 2.5"]) == []
    assert log(3, ["/cloth1/a waits"]) and log(3, ["/cloth2/a waits"])


def test_silence(clock):
    silence = Silence(clock)
    assert not silence.lasts(0)
    clock.now += 2.9
    assert not silence.lasts(0)
    clock.now += 0.1
    assert silence.lasts(0) and not silence.lasts(1)
    clock.now += 3.0
    assert silence.lasts(1)


def joint(name, kind="revolute", limits=(-2.0, 2.0)):
    return RobotJoint(name, kind, "base", name, IDENTITY, (0.0, 0.0, 1.0), limits)


@pytest.fixture
def watch(clock):
    watch = JointStateWatch("/joint_states", clock)
    watch.use([{name: joint(name) for name in ("shoulder", "elbow")}])
    assert watch.warnings() == []
    return watch


def test_joint_states_that_advance(watch, clock):
    for k in range(10):
        clock.now += 1.0
        watch.receive(k, ["elbow", "gripper"])
        assert watch.warnings() == []


@pytest.mark.parametrize("stamp, says", [(0, "header.stamp is 0 in every message"), (7, "stays at 7 ns")])
def test_a_stamp_that_does_not_advance(watch, clock, stamp, says):
    for _ in range(3):
        watch.receive(stamp, ["elbow"])
        assert watch.warnings() == []
        clock.now += 1.0
    watch.receive(stamp, ["elbow"])
    (line,) = watch.warnings()
    assert line.startswith("/joint_states: ") and says in line and "; let the publisher set it" in line
    watch.receive(stamp + 1, ["elbow"])
    assert watch.warnings() == []


def test_a_stream_that_ends_is_no_stamp_that_stays(watch, clock):
    watch.receive(5, ["elbow"])
    assert not watch.silent(1)
    clock.now += 60.0
    assert watch.warnings() == [] and watch.silent(1)


def test_a_new_publisher_has_its_time(watch, clock):
    assert not watch.silent(1)
    clock.now += 60.0
    assert not watch.silent(2) and not watch.silent(2)
    clock.now += 3.0
    assert watch.silent(2)


def test_a_clock_that_is_set_back_advances_from_there(watch, clock):
    watch.receive(60 * 10**9, ["elbow"])
    for k in range(5):
        clock.now += 1.0
        watch.receive(k, ["elbow"])
        assert watch.warnings() == []


def test_names_of_no_joint(watch, clock):
    for k in range(4):
        watch.receive(k, ["left_elbow", "left_wrist"])
        assert watch.warnings() == [] or k == 3
        clock.now += 1.0
    (line,) = watch.warnings()
    assert "no message names a joint of the robot (elbow, shoulder); the last one names left_elbow, left_wrist" in line
    assert line.endswith("; did you mean elbow?")
    watch.receive(9, ["shoulder"])
    assert watch.warnings() == []


def test_names_of_one_of_two_robots(watch, clock):
    watch.use([{"elbow": joint("elbow")}, {"knee": joint("knee")}])
    for k in range(4):
        watch.receive(k, ["elbow"])
        assert watch.warnings() == [] or k == 3
        clock.now += 1.0
    (line,) = watch.warnings()
    assert "no message names a joint of the robot (knee); the last one names elbow" in line


def test_before_a_robot_is_known_no_name_is_wrong(clock):
    watch = JointStateWatch("/joint_states", clock)
    for k in range(9):
        watch.receive(k, ["anything"])
        clock.now += 1.0
    assert watch.warnings() == []


DEGREES, MILLIMETRES = "send radians (this looks like degrees)", "send metres (this looks like millimetres)"
NEITHER = "correct the position or the limits"


@pytest.mark.parametrize(
    "kind, limits, position, remedy",
    [
        ("revolute", (-2.0, 2.0), 45.0, DEGREES),
        ("revolute", (-2.0, 2.0), -5.0, DEGREES),
        ("revolute", (-2.0, 2.0), -2.05, NEITHER),  # -2.05 degrees would be valid, too
        ("revolute", (-2.0, 2.0), 400.0, NEITHER),
        ("prismatic", (0.0, 0.3), 120.0, MILLIMETRES),
        ("prismatic", (1.0, 1.3), 0.5, NEITHER),
        ("revolute", (-2.0, 2.0), 2.03, None),
        ("revolute", (0.0, 0.0), 45.0, None),
        ("continuous", None, 45.0, None),
        ("revolute", (-2.0, 2.0), math.inf, None),  # rejected elsewhere, as nan
        ("revolute", (-2.0, 2.0), math.nan, None),
    ],
)
def test_positions_outside_the_limits(clock, kind, limits, position, remedy):
    watch = JointStateWatch("/joint_states", clock)
    watch.use([{"elbow": joint("elbow", kind, limits)}])
    watch.receive(1, ["gripper", "elbow"], [99.0, position])
    if remedy is None:
        assert watch.warnings() == []
        return
    unit = "m" if kind == "prismatic" else "rad"
    assert watch.warnings() == [
        f"/joint_states: joint elbow is at {position:g} {unit}, outside its limits {limits[0]:g} .. {limits[1]:g} in "
        f"the description; {remedy}"
    ]
    watch.receive(2, ["gripper"], [99.0])
    assert len(watch.warnings()) == 1
    clock.now += 60.0
    watch.receive(3, ["elbow"], [math.nan])
    watch.receive(4, ["elbow"], [limits[0]])
    assert watch.warnings() == []


def test_a_position_that_is_outside_now_and_then_is_logged_once(log, watch, clock):
    """A gripper in millimetres that opens and closes: closed it is within limits in metres."""
    watch.use([{"finger": joint("finger", "prismatic", (0.0, 0.04))}])
    logged = []
    for k in range(60):
        watch.receive(k, ["finger"], [40.0 - k % 3 if k % 2 else 0.0])
        logged += log(1, watch.warnings())
    assert len(logged) == 1 and logged[0].endswith(MILLIMETRES)
    for k in range(60, 66):
        watch.receive(k, ["finger"], [0.0])
        clock.now += 1.0
    assert watch.warnings() == []


def test_two_robots_whose_joints_share_a_name(clock):
    watch = JointStateWatch("/joint_states", clock)
    watch.use([{"elbow": joint("elbow", limits=limits)} for limits in ((-1.0, 1.0), (-3.0, 3.0))])
    watch.receive(1, ["elbow"], [1.5])
    (line,) = watch.warnings()
    assert "outside its limits -1 .. 1 in" in line


def test_many_positions_outside_the_limits(watch):
    names = [f"joint_{k}" for k in range(9)]
    watch.use([{name: joint(name)} for name in names])
    watch.receive(1, names, [90.0] * 9)
    lines = watch.warnings()
    assert len(lines) == 4 and lines[-1] == "/joint_states: 6 more joints outside the limits of the description"
