# SPDX-License-Identifier: Apache-2.0
"""A cloth in the frame of the scene, and a net in the frame of a hand that moves."""

import numpy as np
from geometry_msgs.msg import TransformStamped
from waving_sheet import sheet_faces, sheet_positions

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.middleware import fields

N = 12
FACES = sheet_faces(N)
SECOND = 10**9
HAND = Rigid.of((0.3, -0.2, 0.1), (0.0, 0.0, np.sin(0.4), np.cos(0.4)))
SCENE = {"meshes": ["cloth", "net"], "frame_id": "world"}


def transform(parent, child, rigid, stamp=0):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, fields.ns_to_stamp(stamp)
    to = message.transform
    to.translation.x, to.translation.y, to.translation.z = rigid.shift.tolist()
    to.rotation.x, to.rotation.y, to.rotation.z, to.rotation.w = rigid.quaternion.tolist()
    return message


def parts(k):
    """The meshes in the scene's frame; what the net's publisher sends is in the frame of the hand."""
    net = sheet_positions(N, k + 2, offset=0.003, dtype=np.float64)
    return sheet_positions(N, k), net, HAND.inverse().apply(net)


def topologies(node):
    for name in ("cloth", "net"):
        node.peer.topology(name, FACES, N * N)
