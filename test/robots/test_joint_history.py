# SPDX-License-Identifier: Apache-2.0
"""Values of all joints at a stamp, of messages that may each tell of some."""

import math

import numpy as np
import pytest

from hpccd_ros.frames.samples import HISTORY_NS, MOST_SAMPLES
from hpccd_ros.robots import urdf
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.joint_history import Added, JointHistory, NoJointStateError
from hpccd_ros.robots.kinematics import Kinematics
from hpccd_ros.robots.robot import Robot

URDF = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="turn" type="continuous"><parent link="a"/><child link="b"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/></joint>
<joint name="also" type="prismatic"><parent link="c"/><child link="d"/><mimic joint="slide"/></joint></robot>"""


def history():
    return JointHistory(Kinematics(urdf.parse(URDF)))


def test_values_are_interpolated_each_joint_between_its_own_stamps():
    joints = history()
    joints.add(100, ["turn", "slide"], [3.0, 1.0])
    joints.add(200, ["turn"], [-3.0])
    joints.add(300, ["slide", "of another robot"], [2.0, math.nan])
    found = joints.at(150)
    assert found["slide"] == 1.25
    assert found["turn"] == pytest.approx(math.pi)  # the shorter way
    assert joints.at(200) == {"turn": -3.0, "slide": 1.5}
    assert joints.latest() == 200


def test_order_of_arrival_does_not_matter_and_the_same_stamp_replaces():
    joints = history()
    for stamp, value in [(200, 9.0), (100, 0.0), (200, 1.0)]:
        joints.add(stamp, ["slide", "turn"], [value, 0.0])
    assert joints.at(150) == {"slide": 0.5, "turn": 0.0}


def test_what_is_not_known_is_named_and_whether_it_may_come():
    joints = history()
    with pytest.raises(NoJointStateError, match="no joint state so far names turn, slide$"):
        joints.latest()
    joints.add(100, ["slide"], [1.0])
    for stamp, message, final in [
        (100, "no joint state so far names turn; the last one names slide", False),
        (50, "after the stamp 50 ns", True),
        (250, "the last position of turn, slide is from 200 ns, before the stamp 250 ns", False),
    ]:
        if stamp == 50:
            joints.add(200, ["turn", "slide"], [0.0, 0.0])
        with pytest.raises(NoJointStateError, match=message) as rejected:
            joints.at(stamp)
        assert rejected.value.final is final


def test_a_publisher_that_gives_no_stamps_is_told_of():
    joints = history()
    joints.add(0, ["turn", "slide"], [0.0, 0.0])
    with pytest.raises(NoJointStateError, match="is from 0 ns, before .* 5 ns; its publisher must set header"):
        joints.at(5)


def test_messages_that_cannot_be_used_leave_nothing_behind():
    joints = history()
    with pytest.raises(RobotError, match="2 names and 1 position"):
        joints.add(1, ["turn", "slide"], [0.0])
    with pytest.raises(NoJointStateError):
        joints.latest()


def test_a_position_that_is_not_finite_leaves_the_others_of_its_message_in_use():
    joints = history()
    added = joints.add(100, ["turn", "slide", "also"], [1.0, math.nan, math.nan])
    assert added.unusable.startswith("'slide' is nan in the joint state of 100 ns; positions must be finite")
    with pytest.raises(NoJointStateError, match=r"^'slide' is nan in the joint state of 100 ns$"):
        joints.latest()
    assert joints.add(200, ["slide", "turn"], [2.0, 2.0]) == Added()
    assert joints.add(300, ["slide", "turn"], [-math.inf, 3.0]).unusable
    assert joints.latest() == 200 and joints.at(200) == {"turn": 2.0, "slide": 2.0}
    with pytest.raises(NoJointStateError, match="is from 200 ns, before .* 300 ns; 'slide' is -inf in .* of 300 ns$"):
        joints.at(300)
    joints.add(400, ["slide"], [4.0])
    assert joints.at(300) == {"turn": 3.0, "slide": 3.0}


def test_a_message_of_velocities_alone_is_not_malformed():
    joints = history()
    assert joints.add(100, ["turn", "slide", "of another robot"], []) == Added()
    with pytest.raises(NoJointStateError, match="^'turn' has no position in .* 100 ns; 'slide' has no position"):
        joints.latest()
    joints.add(100, ["turn", "slide"], [1.0, 1.0])
    joints.add(200, ["turn", "slide"], [])
    assert joints.latest() == 100


def test_a_joint_that_was_named_before_a_restart_is_not_called_unnamed():
    joints = history()
    joints.add(100, ["turn", "slide"], [0.0, 0.0])
    joints.clear()
    joints.add(10, ["turn"], [0.0])
    expected = "^the last position of slide, at 100 ns, is from before the clock was set back$"
    with pytest.raises(NoJointStateError, match=expected):
        joints.latest()


def test_joints_that_move_no_geometry_need_no_positions():
    """A head that carries only cameras; of the arm, what the gripper mimics counts too."""
    box = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{box}</link>' for name in ("base", "arm", "finger"))
    links += "".join(f'<link name="{name}"/>' for name in ("tip", "cam", "rotor"))
    text = f"""<robot name="r">{links}
      <joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/></joint>
      <joint name="grip" type="prismatic"><parent link="arm"/><child link="finger"/>
        <mimic joint="motor" multiplier="0.5"/></joint>
      <joint name="motor" type="continuous"><parent link="base"/><child link="rotor"/></joint>
      <joint name="head" type="revolute"><parent link="base"/><child link="cam"/></joint>
      <joint name="wrist" type="continuous"><parent link="finger"/><child link="tip"/></joint></robot>"""
    robot = Robot.of(text)
    assert set(robot.kinematics.inputs) == {"lift", "motor"}
    joints = JointHistory(robot.kinematics)
    unneeded = ["head", "wrist"]
    assert joints.add(100, ["lift", "motor", *unneeded], [0.1, 0.2, math.nan, math.inf]) == Added()
    without = robot.placements(robot.kinematics.state(joints.at(100)))
    given = robot.placements(robot.kinematics.state({**joints.at(100), "head": 1.0, "wrist": 2.0}))
    for a, b in zip(without, given, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
    assert robot.kinematics.state({"lift": 0.0, "motor": 0.0, "head": 1.0}).values.tolist().count(1.0) == 1


def test_what_is_kept_is_bounded():
    joints = history()
    for k in range(3 * MOST_SAMPLES):
        joints.add(k, ["slide", "turn"], [k, 0.0])
    with pytest.raises(NoJointStateError, match=f"from {2 * MOST_SAMPLES} ns") as rejected:
        joints.at(0)
    assert rejected.value.final
    for stamp in (2 * HISTORY_NS, 2 * HISTORY_NS + 1):
        joints.add(stamp, ["slide", "turn"], [0.0, 0.0])
    with pytest.raises(NoJointStateError):
        joints.at(3 * MOST_SAMPLES - 1)


def test_a_source_that_begins_fresh_at_an_earlier_time_is_followed():
    joints = history()
    joints.add(5 * HISTORY_NS, ["slide", "turn"], [5.0, 0.0])
    joints.add(100, ["slide", "turn"], [1.0, 0.0])
    assert joints.latest() == 100 and joints.at(100)["slide"] == 1.0


MS = 10**6


def after_a_short_run(*now):
    """Values 0 for half a second, then 1 at the milliseconds ``now``."""
    joints = history()
    for stamp in range(0, 500, 10):
        joints.add(stamp * MS, ["slide", "turn"], [0.0, 0.0])
    for stamp in now:
        joints.add(stamp * MS, ["slide", "turn"], [1.0, 1.0])
    return joints


def of_now(joints, stamp):
    """Whether what is found is of the run of now; None: nothing is found."""
    try:
        found = joints.at(stamp * MS)
    except NoJointStateError:
        return None
    return found == {"slide": 1.0, "turn": 1.0}


@pytest.mark.parametrize("now", [(), (5,), (5, 15), (5, 15, 25, 35, 45), tuple(range(5, 400, 10))])
def test_where_a_mesh_begins_fresh_nothing_from_before_is_used(now):
    joints = after_a_short_run(*now)
    joints.forget_future(10 * MS)
    joints.forget_future(10 * MS)
    found = [of_now(joints, stamp) for stamp in range(0, 500, 5)]
    assert found == [True if now and now[0] <= stamp <= now[-1] else None for stamp in range(0, 500, 5)]


def test_a_run_shorter_than_a_second_is_told_from_what_is_late_by_its_order():
    late = after_a_short_run(100, 120, 90, 490, 200, 210, 220, 230, 500)
    assert [of_now(late, stamp) for stamp in (0, 100, 105, 120, 300, 495)] == [False, True, False, True, False, True]
    fresh = after_a_short_run(5, 15, 25, 35, 45)
    assert [of_now(fresh, stamp) for stamp in (0, 10, 30, 45, 50, 300)] == [None, True, True, True, None, None]


FAR = 360 * HISTORY_NS


def test_a_stamp_far_ahead_loses_nothing_of_what_comes_before_and_after():
    joints = after_a_short_run()
    assert joints.add(FAR, ["slide", "turn"], [9.0, 9.0]).stray is None
    assert joints.at(FAR) == {"slide": 9.0, "turn": 9.0}
    assert of_now(joints, 485) is False
    with pytest.raises(NoJointStateError, match=f"is from {FAR} ns, far ahead of the stamp 495000000 ns") as rejected:
        joints.at(495 * MS)
    assert not rejected.value.final
    assert joints.add(500 * MS, ["turn"], [0.0]).stray == FAR  # of all joints that it told of
    assert joints.add(510 * MS, ["slide", "turn"], [0.0, 0.0]).stray is None
    assert joints.at(495 * MS) == {"slide": 0.0, "turn": 0.0} and joints.latest() == 510 * MS
    for k in range(3):  # of another clock, each beside one of this
        assert joints.add(FAR + k, ["slide", "turn"], [9.0, 9.0]).stray is None
        assert joints.add((520 + k) * MS, ["slide", "turn"], [0.0, 0.0]).stray == FAR + k
    assert of_now(joints, 515) is False and joints.latest() == 522 * MS


def test_what_goes_on_from_a_stamp_far_ahead_confirms_it():
    joints = after_a_short_run()
    for stamp in (FAR, FAR + 10 * MS):
        assert joints.add(stamp, ["slide", "turn"], [1.0, 1.0]).stray is None
    assert of_now(joints, FAR // MS + 5) is True
    with pytest.raises(NoJointStateError) as rejected:
        joints.at(495 * MS)
    assert rejected.value.final
