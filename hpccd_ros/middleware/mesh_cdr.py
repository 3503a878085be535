# SPDX-License-Identifier: Apache-2.0
"""MeshTopology, MeshVertices, and for robots String and JointState, as CDR bytes of exactly the length of the message.

`rclpy.serialization.serialize_message` appends uninitialised bytes, which strict readers reject and which make
recordings of the same frames differ. These messages are flat, so they are written here; the same bytes go
over DDS (`publish` takes bytes) and into files.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

from hpccd_ros.frames.types import NO_EDGES

LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def topology(
    stamp_ns: int, frame_id: str, version: int, faces: np.ndarray, n_vertices: int, edges: np.ndarray = NO_EDGES
) -> bytes:
    """hpccd/msg/MeshTopology; `faces` (F,3) and `edges` (E,2) unsigned integers below `n_vertices`."""
    body = header(stamp_ns, frame_id) + struct.pack("<II", version, n_vertices)
    for indices in (faces, edges):
        body += struct.pack("<I", indices.size) + np.ascontiguousarray(indices, dtype="<u4").tobytes()
    return LITTLE_ENDIAN + body


def vertices(stamp_ns: int, frame_id: str, topology_version: int, step: int, xyz: np.ndarray) -> bytes:
    """hpccd/msg/MeshVertices with `xyz` (V,3) float32 in `vertices_f32`."""
    if xyz.dtype != np.float32:
        raise TypeError(f"xyz has dtype {xyz.dtype}; it is sent as float32: convert it with astype(numpy.float32)")
    body = aligned(header(stamp_ns, frame_id) + struct.pack("<I", topology_version), 8)
    body += struct.pack("<QI", step, xyz.size)
    # The empty vertices_f64 is only its length; 4-byte floats leave the offset a multiple of 4, as required.
    return b"".join([LITTLE_ENDIAN, body, np.ascontiguousarray(xyz, dtype="<f4").tobytes(), struct.pack("<I", 0)])


def header(stamp_ns: int, frame_id: str) -> bytes:
    """std_msgs/Header, padded for the next number of 4 bytes."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return aligned(struct.pack("<iI", seconds, nanoseconds) + text(frame_id), 4)


def text(value: str) -> bytes:
    """A string: its length, its bytes and a zero."""
    encoded = value.encode() + b"\0"
    return struct.pack("<I", len(encoded)) + encoded


def aligned(body: bytes, size: int) -> bytes:
    """`body`, padded to a multiple of `size` bytes."""
    return body + b"\0" * (-len(body) % size)


def description(urdf: str) -> bytes:
    """std_msgs/String."""
    return LITTLE_ENDIAN + text(urdf)


def joint_states(stamp_ns: int, positions: Mapping[str, float]) -> bytes:
    """sensor_msgs/JointState with names and positions; without velocities, efforts and, as is usual, a frame."""
    body = header(stamp_ns, "") + struct.pack("<I", len(positions))
    for name in positions:
        body = aligned(body + text(name), 4)
    body += struct.pack("<I", len(positions))
    if positions:
        body = aligned(body, 8) + struct.pack(f"<{len(positions)}d", *positions.values())
    # Two empty sequences are only their lengths.
    return LITTLE_ENDIAN + body + struct.pack("<II", 0, 0)
