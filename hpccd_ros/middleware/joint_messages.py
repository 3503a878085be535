# SPDX-License-Identifier: Apache-2.0
"""Messages of joint states, for the node and the replay of its recordings."""

from collections.abc import Iterable
from typing import Any

from sensor_msgs.msg import JointState

from hpccd_ros.frames.drops import Input, Reason, Rejection
from hpccd_ros.frames.samples import stray_text
from hpccd_ros.frames.types import UNKNOWN_TIME
from hpccd_ros.middleware import fields
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.joint_frames import JointFrames
from hpccd_ros.robots.joint_history import check_lengths

# Limits for stored messages, which anyone may send.
MOST_JOINTS = 1000
MOST_CHARACTERS = 100_000  # total length of their names
# Last messages of a topic, kept for robots whose description has not arrived.
MOST_RECENT = 100


def kept(message: JointState) -> JointState | None:
    """The fields that `fill` needs later; None: it is too large, or names and positions do not match."""
    if len(message.name) > MOST_JOINTS or len(message.position) not in (0, len(message.name)):
        return None
    if sum(map(len, message.name)) > MOST_CHARACTERS:
        return None
    small = JointState(name=message.name, position=message.position)
    small.header.stamp = message.header.stamp
    return small


def too_large(topic: str) -> Rejection:
    """For a message that is not kept for a robot whose description has not arrived."""
    text = (
        f"a joint state with more than {MOST_JOINTS} names, or {MOST_CHARACTERS} characters of names, is not kept "
        "until the description of its robot comes; publish fewer joints in one message"
    )
    return Rejection(topic, Reason.TOO_LARGE, text, what=Input.JOINT_STATE)


def fill(
    robots: Iterable[JointFrames], message: Any, topic: str, sent: int = UNKNOWN_TIME, publisher: int | None = None
) -> list[Rejection]:
    """Give a sensor_msgs/JointState of ``topic``, sent at ``sent``, to the robots that it moves. Returns a rejection
    for each robot that cannot use all of it, and if no robot can use it; other robots still use it. An earlier message
    is rejected if this one shows that it was far ahead. publisher: number of the publisher if there are several.
    If publishers contradict each other, a rejection reports it, though the message is used."""
    problems: list[str] = []
    contradiction = ""
    stray: int | None = None
    try:
        stamp = fields.stamp_to_ns(message.header.stamp)
        check_lengths(message.name, message.position)
    except ValueError as error:
        return [_rejection(topic, str(error), sent)]
    for robot in robots:
        try:
            added = robot.add(stamp, message.name, message.position, sent, publisher)
        except RobotError as error:
            problems.append(str(error))
            continue
        stray = added.stray if stray is None else stray
        contradiction = contradiction or added.contradiction
        if added.unusable:
            problems.append(added.unusable)
    rejections = [_rejection(topic, problem, sent) for problem in problems[:1]]
    if contradiction:
        rejections.append(Rejection(topic, Reason.CONTRADICTED, contradiction, what=Input.JOINT_STATE, sent=sent))
    if stray is not None:
        rejections.append(Rejection(topic, Reason.AHEAD, stray_text(stray), what=Input.JOINT_STATE, sent=sent))
    return rejections


def _rejection(topic: str, problem: str, sent: int) -> Rejection:
    return Rejection(topic, Reason.MALFORMED, problem, what=Input.JOINT_STATE, sent=sent)
