# SPDX-License-Identifier: Apache-2.0
"""std_msgs/String and sensor_msgs/JointState as CDR bytes, exactly as long as the message is (see mesh_cdr)."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from hpccd_ros.middleware.mesh_cdr import LITTLE_ENDIAN, aligned, header, text


def description(urdf: str) -> bytes:
    """std_msgs/String."""
    return LITTLE_ENDIAN + text(urdf)


def joint_states(stamp_ns: int, positions: Mapping[str, float]) -> bytes:
    """sensor_msgs/JointState with names and positions; without velocities, efforts and, as by custom, a frame."""
    body = header(stamp_ns, "") + struct.pack("<I", len(positions))
    for name in positions:
        body = aligned(body + text(name), 4)
    body += struct.pack("<I", len(positions))
    if positions:
        body = aligned(body, 8) + struct.pack(f"<{len(positions)}d", *positions.values())
    # Two empty sequences are their lengths alone.
    return LITTLE_ENDIAN + body + struct.pack("<II", 0, 0)
