# SPDX-License-Identifier: Apache-2.0
"""The topics of transforms, for the node, its recordings and their replay.

tf2_msgs has no wheel, so geometry_msgs/TransformStamped on ``transforms`` and ``transforms_static`` is always used
as well.
"""

import dataclasses
from typing import Any

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames.drops import Aspect, Input, Reason, Rejection
from hpccd_ros.frames.samples import stray_text
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.types import UNKNOWN_TIME
from hpccd_ros.middleware import fields, topic_names
from hpccd_ros.middleware.message_types import message_class

STAMPED = "geometry_msgs/msg/TransformStamped"
TF2 = "tf2_msgs/msg/TFMessage"
TYPES = (STAMPED, TF2)


@dataclasses.dataclass(frozen=True)
class TransformTopic:
    """static: valid at all times, and latched: messages accumulate."""

    name: str
    type_name: str
    static: bool


ALL = {
    topic.name: topic
    for topic in (
        TransformTopic(topic_names.TRANSFORMS, STAMPED, False),
        TransformTopic(topic_names.TRANSFORMS_STATIC, STAMPED, True),
        TransformTopic(topic_names.TF, TF2, False),
        TransformTopic(topic_names.TF_STATIC, TF2, True),
    )
}


def understood() -> list[TransformTopic]:
    """The topics whose message type is installed."""
    return [topic for topic in ALL.values() if _installed(topic.type_name)]


def _installed(type_name: str) -> bool:
    try:
        message_class(type_name)
    except LookupError:
        return False
    return True


def fill(buffer: TransformBuffer, message: Any, topic: TransformTopic, sent: int = UNKNOWN_TIME) -> list[Rejection]:
    """Add the transforms in a message of ``topic``, sent at ``sent``, to ``buffer``. Returns rejected ones."""
    rejections = []
    for stamped in message.transforms if hasattr(message, "transforms") else [message]:
        try:
            stray = _add(buffer, stamped, topic.static, sent)
        except ValueError as error:
            names = f"{quoted(stamped.child_frame_id)} to {quoted(stamped.header.frame_id)}"
            text = f"transform from {names}: {error}"
            in_use = buffer.rejected(stamped.child_frame_id, topic.static, sent)
            aspect = Aspect.PLACE if in_use else Aspect.NOTHING
            rejections.append(
                Rejection(topic.name, Reason.MALFORMED, text, what=Input.TRANSFORM, aspect=aspect, sent=sent)
            )
            continue
        if stray is not None:
            text = f"transform from {quoted(stamped.child_frame_id)}: {stray_text(stray)}"
            rejections.append(Rejection(topic.name, Reason.AHEAD, text, what=Input.TRANSFORM, sent=sent))
    return rejections


def _add(buffer: TransformBuffer, stamped: Any, static: bool, sent: int) -> int | None:
    shift, turn = stamped.transform.translation, stamped.transform.rotation
    stamp = fields.stamp_to_ns(stamped.header.stamp)
    return buffer.add(
        stamped.header.frame_id,
        stamped.child_frame_id,
        Rigid.of((shift.x, shift.y, shift.z), (turn.x, turn.y, turn.z, turn.w)),
        None if static else stamp,
        sent,
    )
