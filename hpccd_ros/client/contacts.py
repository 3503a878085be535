# SPDX-License-Identifier: Apache-2.0
"""Contacts and pair summaries of the node as numpy arrays and single messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hpccd.msg import ContactArray, PairSummary, PairSummaryArray
from numpy.typing import DTypeLike, NDArray

from hpccd_core.contacts import toc_gradients
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros.client.names import belongs, check
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.separation import Separation, Thickness
from hpccd_ros.middleware import contact_messages, result_fields
from hpccd_ros.middleware.contact_messages import SceneContacts
from hpccd_ros.middleware.result_fields import read_features


def field(message: Any, name: str, dtype: DTypeLike, shape: tuple[int, ...]) -> NDArray[Any]:
    """A view of the field. Raises ValueError where it has another number of values."""
    flat = np.frombuffer(getattr(message, name), dtype)
    if flat.size != np.prod(shape):
        raise ValueError(f"message: {name} has {flat.size} values, {np.prod(shape)} were expected for shape {shape}")
    return flat.reshape(shape)


def meshes_of(message: Any, name: str, count: int) -> NDArray[np.uint32]:
    """A field of ``count`` indices into mesh_names. Raises ValueError where one is beyond these."""
    meshes = field(message, name, np.uint32, (count,))
    if (meshes >= len(message.mesh_names)).any():
        raise ValueError(f"message: {name} names a mesh beyond the {len(message.mesh_names)} of mesh_names")
    return meshes


@dataclass(frozen=True, eq=False)
class ContactArrays:
    """The N contacts of one message in canonical order; features are numbered within their mesh.

    All arrays are views of the message. Outputs from `points` to `approach` have no rows if the node does not send them
    (its parameter ``outputs``; ``weights`` asks for the last three). Responses about one snapshot
    have no `approach`.

    Attributes
    ----------
    mesh_names : tuple of str
        Meshes of the scene.
    n_vertex_face, n_edge_edge, n_edge_face : int
        Number of contacts of each kind, in this order. Edge-face contacts come from query ``intersections``.
    mesh_a, mesh_b : ndarray, shape (N,), uint32
        The mesh of each side: indices into `mesh_names`.
    features_a : ndarray, shape (N, 2), uint32
        Side a, of `mesh_a`: vertex and ``ContactArray.NONE``, or both vertices of the edge.
    features_b : ndarray, shape (N, 2), uint32
        Side b, of `mesh_b`: face and ``ContactArray.NONE``, both vertices of the edge, a point and ``NONE``, or twice
        ``NONE`` for a plane.
    toc : ndarray, shape (N,), float64
        Time of impact as a fraction of the step in [0, 1]; (0,) in responses about one snapshot.
    points : ndarray, shape (N, 3), float64
        Where the sides touch at their time of impact, in the unit of the scene.
    normals : ndarray, shape (N, 3), float64
        Unit vectors from the face to the vertex, or from edge a to edge b; zero if no side is defined.
    closest : ndarray, shape (N, 2, 3), float64
        Nearest points of both sides at their time of impact, in the unit of the scene.
    vertices : ndarray, shape (N, 4), uint32
        Vertices of each contact within their mesh: v of `mesh_a` and f0 f1 f2 of `mesh_b`, or a0 a1 of `mesh_a` and b0
        b1 of `mesh_b`.
    weights : ndarray, shape (N, 4), float64
        Weights of `vertices`, as in ``hpccd_core.Contacts``.
    approach : ndarray, shape (N,), float64
        How fast the gap grows at the time of impact, as in ``hpccd_core.Contacts``; negative while the sides approach.
    distance : ndarray, shape (N,), float64
        Distance of the sides, in the unit of the scene, in responses to the query ``proximity``; otherwise (0,).
    minimum_separation : float
        In force in the whole scene, in its unit; 0 for contact.
    pair_separation : dict of (str, str) to float
        Separation of pairs of meshes that have one of their own.
    features : tuple of str
        What was tested: "vertex_face", "edge_edge" or both, unless a pair of meshes has its own ``pair_features``.
    parts : int
        Number of parts of the step if meshes move by poses, otherwise 0.
    motion_bounds : ndarray, shape (K,) or (0,), float64
        Upper bound on the deviation of each mesh from its true motion, see ContactArray.msg.
    n_vertex_plane, n_vertex_vertex, n_vertex_edge : int
        Number of contacts with planes, of two points, and of points with edges, after those above.
    thickness : dict of str to float
        Thickness of the meshes that have one.
    """

    mesh_names: tuple[str, ...]
    n_vertex_face: int
    n_edge_edge: int
    n_edge_face: int
    mesh_a: NDArray[np.uint32]
    mesh_b: NDArray[np.uint32]
    features_a: NDArray[np.uint32]
    features_b: NDArray[np.uint32]
    toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    closest: NDArray[np.float64]
    vertices: NDArray[np.uint32]
    weights: NDArray[np.float64]
    approach: NDArray[np.float64]
    distance: NDArray[np.float64]
    minimum_separation: float
    pair_separation: dict[tuple[str, str], float]
    features: tuple[str, ...]
    parts: int
    motion_bounds: NDArray[np.float64]
    n_vertex_plane: int
    n_vertex_vertex: int
    n_vertex_edge: int
    thickness: dict[str, float]

    def __len__(self) -> int:
        return len(self.mesh_a)

    def toc_gradients(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives of `toc` with respect to the positions at both ends of the step.

        Returns
        -------
        g0, g1 : ndarray, shape (N, 4, 3), float64
            As of ``hpccd_core.Contacts.toc_gradients``: with respect to the positions of `vertices` at the start of the
            step and at its end.

        Raises
        ------
        ValueError
            If the message is about one snapshot, if the node does not send `normals`, `weights` and `approach`, or if
            it cut the step into several parts, in which vertices do not move straight from start to end.
        """
        if len(self.toc) != len(self):
            raise ValueError("toc_gradients: a snapshot has no times; send the query contacts")
        for name in ("normals", "weights", "approach"):
            if len(getattr(self, name)) != len(self):
                asked = "set the node's parameter outputs to [normals, weights]"
                raise ValueError(f"toc_gradients: the message has no {name}; {asked}")
        if self.parts > 1:
            raise ValueError(
                f"toc_gradients: the step was computed in {self.parts} parts; with rigid_parts: 1 it has gradients"
            )
        return toc_gradients(self.toc, self.weights, self.normals, self.approach)


# Fields that may be empty; shape of what they hold for each contact, and type.
_OPTIONAL = {name: (array.row, array.dtype) for name, array in OUTPUT_ARRAYS.items()} | {"distance": ((), "float64")}


def contacts_from_message(message: ContactArray) -> ContactArrays:
    """The contacts of a message as arrays.

    Parameters
    ----------
    message : hpccd.msg.ContactArray

    Returns
    -------
    ContactArrays
        The earliest contacts if ``message.truncated``.

    Raises
    ------
    ValueError
        If the arrays of the message are inconsistent; those of the node never are.
    """
    kind = np.frombuffer(message.kind, np.uint8)
    if (kind > ContactArray.VERTEX_EDGE).any() or (kind[1:] < kind[:-1]).any():
        raise ValueError(
            "message: kind must hold known kinds in ascending order, as those of vertex-face contacts first"
        )
    count, numbers = len(kind), np.bincount(kind, minlength=6).tolist()
    n_vertex_face, n_edge_edge, n_edge_face, n_vertex_plane, n_vertex_vertex, n_vertex_edge = numbers
    of_snapshot = n_edge_face > 0 or len(message.distance) > 0
    separation, thickness = _spacing_of(message)
    order = {name: number for number, name in enumerate(message.mesh_names)}
    optional = {
        name: field(message, name, dtype, (count if len(getattr(message, name)) else 0, *row))
        for name, (row, dtype) in _OPTIONAL.items()
    }
    sent = {array.asked for name, array in OUTPUT_ARRAYS.items() if len(optional[name])}
    for name, array in OUTPUT_ARRAYS.items():
        if array.asked in sent and not len(optional[name]) and not (of_snapshot and name == "approach"):
            raise ValueError(f"message: {name} is empty, though other arrays of the output {array.asked} are not")
    return ContactArrays(
        tuple(message.mesh_names),
        n_vertex_face,
        n_edge_edge,
        n_edge_face,
        mesh_a=meshes_of(message, "mesh_a", count),
        mesh_b=meshes_of(message, "mesh_b", count),
        features_a=field(message, "features_a", np.uint32, (count, 2)),
        features_b=field(message, "features_b", np.uint32, (count, 2)),
        toc=field(message, "toc", np.float64, (0 if of_snapshot else count,)),
        **optional,
        minimum_separation=separation.minimum,
        pair_separation={(a, b) if order[a] <= order[b] else (b, a): distance for a, b, distance in separation.pairs},
        features=read_features(message),
        parts=message.parts,
        motion_bounds=field(message, "motion_bounds", np.float64, (len(order) if message.parts else 0,)),
        n_vertex_plane=n_vertex_plane,
        n_vertex_vertex=n_vertex_vertex,
        n_vertex_edge=n_vertex_edge,
        thickness=dict(thickness),
    )


def _spacing_of(message: ContactArray) -> tuple[Separation, Thickness]:
    """Separation and thickness in force. Raises ValueError if their fields are inconsistent."""
    try:
        return result_fields.read_separation(message), result_fields.read_thickness(message)
    except ValueError as error:
        raise ValueError(f"message: {error}") from None


def scene_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The contacts of a message with features numbered across the scene, as in ``hpccd_core.Contacts``.

    Parameters
    ----------
    message : hpccd.msg.ContactArray
    layout : Layout
        ``Layout.of(mesh_names, topologies, planes)`` of the meshes in the order of ``message.mesh_names``, and the
        names of the planes, which are the last of these.

    Returns
    -------
    SceneContacts
        ``vf`` (N, 2), ``vf_toc`` (N,), ``ee`` (M, 4), ``ee_toc`` (M,), ``vp``, ``vv``, ``ve`` with their times,
        ``points``, ``normals``, ``closest``, ``vertices``, ``weights`` and ``approach``. Responses to ``proximity``
        have ``vf_distance``, ``ee_distance``, ... instead of times, those to ``intersections`` only ``ef`` (K, 3).
        For gradients of the times, in the same rows: ``contacts_from_message(message).toc_gradients()``.

    Raises
    ------
    ValueError
        If the layout is of other meshes, or of other versions of their topologies, or has fewer features than the
        message names.
    """
    contacts = contacts_from_message(message)
    if contacts.mesh_names != layout.mesh_names:
        raise ValueError(
            f"layout: it is of the meshes {', '.join(layout.mesh_names)}, the message of "
            f"{', '.join(contacts.mesh_names)}; create it from these, in this order"
        )
    if problem := contact_messages.beyond_meshes(message, layout):
        raise ValueError(f"message: {problem}")
    return contact_messages.read_contacts(message, layout)


def pair_summary(message: PairSummaryArray, mesh_a: str, mesh_b: str) -> PairSummary:
    """The summary of two meshes, of a robot and a mesh, or of two robots.

    Parameters
    ----------
    message : hpccd.msg.PairSummaryArray
        From the topic ``PAIRS_TOPIC``.
    mesh_a, mesh_b : str
        Names in either order: of a mesh, of a link (``"arm/hand"``), or of a robot (``"arm"``: all of its links). The
        same name twice: within that mesh or robot.

    Returns
    -------
    hpccd.msg.PairSummary
        For several pairs of links: the sum of their contacts, the earliest time of impact, the smallest distance, which
        is NaN if that of a pair is unknown, and whether any link lies inside.

    Raises
    ------
    TypeError, ValueError
        If a name is not a string, is of no mesh or robot, or the pair is not tested.

    Examples
    --------
    >>> from hpccd.msg import PairSummary, PairSummaryArray
    >>> from hpccd_ros import client
    >>> hand = PairSummary(mesh_a="arm/hand", mesh_b="cloth", count=2, first_toc=0.25, distance=0.0)
    >>> elbow = PairSummary(mesh_a="arm/elbow", mesh_b="cloth", count=1, first_toc=0.75, distance=0.5)
    >>> summary = client.pair_summary(PairSummaryArray(pairs=[hand, elbow]), "cloth", "arm")
    >>> summary.mesh_a, summary.count, summary.first_toc, summary.distance
    ('arm', 3, 0.25, 0.0)
    """
    for argument, name in (("mesh_a", mesh_a), ("mesh_b", mesh_b)):
        check(argument, name, (mesh for pair in message.pairs for mesh in (pair.mesh_a, pair.mesh_b)))
    as_given = [belongs(pair.mesh_a, mesh_a) and belongs(pair.mesh_b, mesh_b) for pair in message.pairs]
    other_way = [belongs(pair.mesh_a, mesh_b) and belongs(pair.mesh_b, mesh_a) for pair in message.pairs]
    # A link with itself, asked for with its robot, is both.
    found = [pair for pair, *ways in zip(message.pairs, as_given, other_way, strict=True) if any(ways)]
    if not found:
        there = ", ".join(f"{pair.mesh_a} and {pair.mesh_b}" for pair in message.pairs)
        raise ValueError(
            f"mesh_a, mesh_b: {mesh_a!r} and {mesh_b!r} are not a tested pair; the tested pairs are {there}"
        )
    if len(found) == 1 and {found[0].mesh_a, found[0].mesh_b} == {mesh_a, mesh_b}:
        return found[0]
    first, second = (mesh_a, mesh_b) if any(as_given) else (mesh_b, mesh_a)
    inside = [
        pair.inside if belongs(pair.mesh_a, first) and belongs(pair.mesh_b, second) else _swapped(pair.inside)
        for pair in found
    ]
    return PairSummary(
        mesh_a=first,
        mesh_b=second,
        count=sum(pair.count for pair in found),
        first_toc=min(pair.first_toc for pair in found),
        distance=float(np.min([pair.distance for pair in found])),  # NaN if one of them is
        inside=int(np.bitwise_or.reduce(inside)),
    )


def _swapped(inside: int) -> int:
    """That of the same two meshes in the other order."""
    return (inside & 1) << 1 | (inside & 2) >> 1
