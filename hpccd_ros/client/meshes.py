# SPDX-License-Identifier: Apache-2.0
"""Faces and positions of a mesh: numpy arrays to messages, and back; those of shape_msgs/Mesh and of markers are
numbered as by the node, whose contacts name their vertices and faces."""

from typing import Any

import numpy as np
from hpccd.msg import MeshTopology, MeshVertices
from numpy.typing import ArrayLike, NDArray
from rclpy.serialization import serialize_message
from shape_msgs.msg import Mesh
from visualization_msgs.msg import Marker

from hpccd_core import arguments
from hpccd_ros.frames import coordinates
from hpccd_ros.frames.types import Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import mesh_messages, whole_meshes

_LARGEST_UINT32 = 2**32 - 1
_LARGEST_UINT64 = 2**64 - 1
# builtin_interfaces/Time counts seconds in 32 bits with a sign.
_LAST_STAMP = 2**31 * 10**9 - 1


def topology_message(
    faces: ArrayLike, n_vertices: int, *, edges: ArrayLike = (), version: int = 0, stamp_ns: int = 0
) -> MeshTopology:
    """The message that tells the node the triangles of a mesh: at the start, and again whenever they change.

    faces: (F, 3) integers, indices into this mesh's own vertices. n_vertices: how many it has, more than the largest
    index. edges: (E, 2) integers, edges beside those of the faces; a rope has no faces: ``()``. version: counts up with
    each change; vertices name the version that they belong to. stamp_ns: when it came into force, ns since the epoch.
    Raises TypeError or ValueError naming the argument.
    """
    triangles, segments = arguments.faces(faces), arguments.edges(edges)
    n_vertices = arguments.whole_number("n_vertices", n_vertices, 0, _LARGEST_UINT32)
    for what, indices in (("face", triangles), ("edge", segments)):
        if indices.size and (highest := int(indices.max())) >= n_vertices:
            raise ValueError(
                f"{what}s: {what} {int(indices.argmax()) // indices.shape[1]} names vertex {highest}, n_vertices is "
                f"{n_vertices}; indices count this mesh's vertices from 0"
            )
    return mesh_messages.topology_message(
        triangles,
        n_vertices,
        edges=segments,
        version=arguments.whole_number("version", version, 0, _LARGEST_UINT32),
        stamp_ns=arguments.whole_number("stamp_ns", stamp_ns, 0, _LAST_STAMP),
    )


def vertices_message(
    vertices: NDArray[Any], stamp_ns: int, *, step: int = 0, topology_version: int = 0, frame_id: str = ""
) -> MeshVertices:
    """The message that tells the node where the vertices of a mesh are at one time.

    vertices: (n, 3) float32 or float64, sent in that precision; finite, not beyond 1e150, in the unit of the scene.
    stamp_ns: the time of these positions, ns since the epoch; it grows from message to message, and is the same for all
    meshes of a frame. step: a number of your own, handed through to ``ContactArray.step``. topology_version: that of
    the :func:`topology_message` they belong to. frame_id: the coordinate frame of the positions.
    Raises TypeError or ValueError naming the argument.
    """
    arguments.refuse_masked("vertices", vertices)
    if not isinstance(vertices, np.ndarray) or vertices.dtype not in arguments.REALS:
        kind = f"dtype {vertices.dtype}" if isinstance(vertices, np.ndarray) else type(vertices).__name__
        raise TypeError(f"vertices: expected an array of float32 or float64, got {kind}; convert with numpy.asarray")
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
        raise ValueError(f"vertices: expected shape (n, 3), one row a vertex and at least one, got {vertices.shape}")
    if unusable := coordinates.unusable_coordinates(vertices):
        raise ValueError(f"vertices: {unusable[1]}")
    if not isinstance(frame_id, str):
        raise TypeError(f"frame_id: expected a string, got {type(frame_id).__name__}")
    return mesh_messages.vertices_message(
        vertices,
        arguments.whole_number("stamp_ns", stamp_ns, 0, _LAST_STAMP),
        step=arguments.whole_number("step", step, 0, _LARGEST_UINT64),
        topology_version=arguments.whole_number("topology_version", topology_version, 0, _LARGEST_UINT32),
        frame_id=frame_id,
    )


def topology_from_message(message: MeshTopology) -> Topology:
    """What is in a message: ``version``, ``n_vertices``, ``faces``, (F, 3) uint32, and ``edges``, (E, 2).

    Both are views of the message, which they keep alive: to change one is to change the other.
    Raises ValueError where faces are no triples, edges no pairs, or name a vertex that is not there.
    """
    limits = dict.fromkeys(("max_vertices", "max_faces", "max_edges"), _LARGEST_UINT32)
    return mesh_messages.topology_from_message(message, limits)


def vertices_from_message(message: MeshVertices) -> NDArray[Any]:
    """The positions in a message: (n, 3) float32 or float64, whichever was sent, in the unit of the scene.

    A view of the message, which it keeps alive: to change one is to change the other.
    Raises ValueError where not exactly one of the two arrays is filled, or a coordinate is not finite or beyond 1e150.
    """
    return mesh_messages.vertices_from_message(message, _LARGEST_UINT32)


_ANY = 2**31 - 1


def mesh_from_shape(message: Mesh) -> tuple[Topology, NDArray[Any]]:
    """Topology and (n, 3) float64 vertices of a message for ``mesh.NAME.input: shape``, numbered as they are in it.

    Raises ValueError for one that the node refuses.
    """
    mesh = whole_meshes.mesh_from_shape(serialize_message(message), 1, _ANY, _ANY)
    return mesh.topology, mesh.vertices


def mesh_from_marker(message: Marker, welding: Welding | None = None) -> tuple[Topology, NDArray[Any]]:
    """Topology and (n, 3) float64 vertices of a message for ``mesh.NAME.input: marker``, scaled and placed.

    Faces are numbered as the triangles of the message; vertices in the order in which their points first come, as equal
    points are one vertex. welding: of the markers that were sent before it; the node keeps what the first of a stream
    joins, as long as it stays together. None: this is the first.
    Raises ValueError for one that the node refuses.
    """
    data = serialize_message(message)
    mesh = whole_meshes.mesh_from_marker(data, _ANY, _ANY, Welding() if welding is None else welding)
    return mesh.topology, mesh.vertices
