# SPDX-License-Identifier: Apache-2.0
"""Faces and positions of a mesh: numpy arrays to messages, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from hpccd.msg import MeshTopology, MeshVertices
from numpy.typing import ArrayLike, NDArray
from rclpy.serialization import serialize_message
from shape_msgs.msg import Mesh
from visualization_msgs.msg import Marker

from hpccd_core import arguments
from hpccd_ros.client.stamps import Stamp, nanoseconds
from hpccd_ros.frames import coordinates
from hpccd_ros.frames.types import Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import mesh_messages, whole_meshes

_LARGEST_UINT32 = 2**32 - 1
_LARGEST_UINT64 = 2**64 - 1


def topology_message(
    faces: ArrayLike, n_vertices: int, *, edges: ArrayLike = (), version: int = 0, stamp_ns: Stamp = 0
) -> MeshTopology:
    """The message that gives the node the triangles of a mesh: at the start, and whenever they change.

    Parameters
    ----------
    faces : ArrayLike, shape (F, 3), integers
        Indices into this mesh's own vertices; ``()`` for a rope.
    n_vertices : int
        Number of vertices, more than the largest index.
    edges : ArrayLike, shape (E, 2), integers
        Segments beside the edges of the faces.
    version : int
        Increases with each change; vertices name the version they belong to.
    stamp_ns : int, rclpy.time.Time or builtin_interfaces.msg.Time
        When it takes effect. An int is nanoseconds since the epoch.

    Returns
    -------
    hpccd.msg.MeshTopology

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type, shape or range.

    Examples
    --------
    >>> from hpccd_ros import client
    >>> message = client.topology_message([[0, 1, 2]], n_vertices=3)
    >>> message.n_vertices, list(message.faces)
    (3, [0, 1, 2])
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
        stamp_ns=nanoseconds("stamp_ns", stamp_ns),
    )


def vertices_message(
    vertices: NDArray[Any], stamp_ns: Stamp, *, step: int = 0, topology_version: int = 0, frame_id: str = ""
) -> MeshVertices:
    """The message that gives the node the positions of a mesh at one time.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3), float32 or float64
        Sent in that precision; finite, up to 1e150, in the unit of the scene.
    stamp_ns : int, rclpy.time.Time or builtin_interfaces.msg.Time
        The time of these positions: ``node.get_clock().now()``, the stamp of another message, or nanoseconds since the
        epoch as an int. It increases from message to message, and is the same for all meshes of a frame. A float is
        rejected; an int within ten seconds of the system's time in seconds is warned of.
    step : int
        A number of your own, copied to ``ContactArray.step``.
    topology_version : int
        Version of the :func:`topology_message` they belong to.
    frame_id : str
        Coordinate frame of the positions.

    Returns
    -------
    hpccd.msg.MeshVertices

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type, shape or range.

    Examples
    --------
    >>> import numpy as np
    >>> from rclpy.time import Time
    >>> from hpccd_ros import client
    >>> message = client.vertices_message(np.zeros((3, 3)), Time(seconds=2.5))
    >>> message.header.stamp.sec, message.header.stamp.nanosec
    (2, 500000000)
    """
    arguments.reject_masked("vertices", vertices)
    if not isinstance(vertices, np.ndarray) or vertices.dtype not in arguments.REALS:
        kind = f"dtype {vertices.dtype}" if isinstance(vertices, np.ndarray) else type(vertices).__name__
        raise TypeError(f"vertices: expected an array of float32 or float64, got {kind}; convert with numpy.asarray")
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
        raise ValueError(f"vertices: expected shape (n, 3), one row per vertex and at least one, got {vertices.shape}")
    if unusable := coordinates.unusable_coordinates(vertices):
        raise ValueError(f"vertices: {unusable[1]}")
    if not isinstance(frame_id, str):
        raise TypeError(f"frame_id: expected a string, got {type(frame_id).__name__}")
    if frame_id:
        arguments.text("frame_id", frame_id)
    return mesh_messages.vertices_message(
        vertices,
        nanoseconds("stamp_ns", stamp_ns),
        step=arguments.whole_number("step", step, 0, _LARGEST_UINT64),
        topology_version=arguments.whole_number("topology_version", topology_version, 0, _LARGEST_UINT32),
        frame_id=frame_id,
    )


def topology_from_message(message: MeshTopology) -> Topology:
    """The triangles of a message.

    Parameters
    ----------
    message : hpccd.msg.MeshTopology

    Returns
    -------
    Topology
        With ``version``, ``n_vertices``, ``faces`` (F, 3) and ``edges`` (E, 2), uint32: views of the message.

    Raises
    ------
    ValueError
        If faces are no triples, edges no pairs, or an index is out of range.
    """
    limits = dict.fromkeys(("max_vertices", "max_faces", "max_edges"), _LARGEST_UINT32)
    return mesh_messages.topology_from_message(message, limits)


def vertices_from_message(message: MeshVertices) -> NDArray[Any]:
    """The positions of a message.

    Parameters
    ----------
    message : hpccd.msg.MeshVertices

    Returns
    -------
    ndarray, shape (n, 3), float32 or float64
        In the unit of the scene; a view of the message.

    Raises
    ------
    ValueError
        If not exactly one of its two arrays is filled, or a coordinate is not finite or beyond 1e150.
    """
    return mesh_messages.vertices_from_message(message, _LARGEST_UINT32)


_ANY = 2**31 - 1


def mesh_from_shape(message: Mesh) -> tuple[Topology, NDArray[Any]]:
    """Topology and vertices of a shape message, numbered as by the node with ``mesh.NAME.input: shape``.

    Parameters
    ----------
    message : shape_msgs.msg.Mesh

    Returns
    -------
    topology : Topology
    vertices : ndarray, shape (n, 3), float64

    Raises
    ------
    ValueError
        If the node would reject the message.
    """
    mesh = whole_meshes.mesh_from_shape(serialize_message(message), 1, _ANY, _ANY)
    return mesh.topology, mesh.vertices


def mesh_from_marker(message: Marker, welding: Welding | None = None) -> tuple[Topology, NDArray[Any]]:
    """Topology and vertices of a marker, numbered as by the node with ``mesh.NAME.input: marker``.

    Parameters
    ----------
    message : visualization_msgs.msg.Marker
        A triangle list. Faces are numbered as its triangles; equal points become one vertex, in order of first use.
    welding : Welding, optional
        That of the markers sent before: the node keeps the vertices that the first marker of a stream joins while they
        stay together. None: this is the first marker.

    Returns
    -------
    topology : Topology
    vertices : ndarray, shape (n, 3), float64
        Scaled and placed.

    Raises
    ------
    ValueError
        If the node would reject the message.
    """
    data = serialize_message(message)
    mesh = whole_meshes.mesh_from_marker(data, _ANY, _ANY, Welding() if welding is None else welding)
    return mesh.topology, mesh.vertices
