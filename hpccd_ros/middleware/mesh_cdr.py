# SPDX-License-Identifier: Apache-2.0
"""MeshTopology and MeshVertices as CDR bytes, exactly as long as the message is.

`rclpy.serialization.serialize_message` appends uninitialised bytes, which strict readers refuse and by which
recordings of the same frames differ. These two messages are flat, so they are written here; the same bytes go
over DDS (`publish` takes bytes) and into files.
"""

from __future__ import annotations

import struct

import numpy as np

from hpccd_ros.frames.types import NO_EDGES

_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def topology(
    stamp_ns: int, frame_id: str, version: int, faces: np.ndarray, n_vertices: int, edges: np.ndarray = NO_EDGES
) -> bytes:
    """hpccd/msg/MeshTopology; `faces` (F,3) and `edges` (E,2) unsigned integers below `n_vertices`."""
    body = _header(stamp_ns, frame_id) + struct.pack("<II", version, n_vertices)
    for indices in (faces, edges):
        body += struct.pack("<I", indices.size) + np.ascontiguousarray(indices, dtype="<u4").tobytes()
    return _LITTLE_ENDIAN + body


def vertices(stamp_ns: int, frame_id: str, topology_version: int, step: int, xyz: np.ndarray) -> bytes:
    """hpccd/msg/MeshVertices with `xyz` (V,3) float32 in `vertices_f32`."""
    if xyz.dtype != np.float32:
        raise TypeError(f"xyz has dtype {xyz.dtype}; it is sent as float32: convert it with astype(numpy.float32)")
    body = _header(stamp_ns, frame_id) + struct.pack("<I", topology_version)
    body += b"\0" * (-len(body) % 8)
    body += struct.pack("<QI", step, xyz.size)
    # The empty vertices_f64 is its length alone; 4-byte floats leave the offset a multiple of 4, as it needs.
    return b"".join(
        [_LITTLE_ENDIAN, body, np.ascontiguousarray(xyz, dtype="<f4").tobytes(), struct.pack("<I", 0)]
    )


def _header(stamp_ns: int, frame_id: str) -> bytes:
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    text = frame_id.encode() + b"\0"
    body = struct.pack("<iII", seconds, nanoseconds, len(text)) + text
    return body + b"\0" * (-len(body) % 4)
