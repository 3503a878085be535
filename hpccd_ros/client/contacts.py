# SPDX-License-Identifier: Apache-2.0
"""The contacts of a step: the node's message to numpy arrays, numbered within each mesh or across the scene; and pairs
of meshes in brief."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from hpccd.msg import ContactArray, PairSummary, PairSummaryArray
from numpy.typing import NDArray

from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.separation import Separation
from hpccd_ros.middleware import answer_fields, contact_messages
from hpccd_ros.middleware.answer_fields import read_features
from hpccd_ros.middleware.contact_messages import SceneContacts


def field(message: Any, name: str, dtype: type[Any], shape: tuple[int, ...]) -> NDArray[Any]:
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
    """The N contacts of one message in their canonical order; features are numbered within their mesh.

    mesh_names: of the scene. n_vertex_face, n_edge_edge, n_edge_face: number of contacts, in this order, of each
    kind; edge-face ones are told only by ``~/detect``, for query ``intersections``.
    mesh_a, mesh_b: (N,) uint32, indices into mesh_names: the mesh of each side.
    features_a: (N, 2) uint32, of mesh_a: vertex and ``ContactArray.NONE``, or the two vertices of the edge.
    features_b: (N, 2) uint32, of mesh_b: face and ``ContactArray.NONE``, or the two vertices of the edge.
    toc: (N,) float64, time of contact as a fraction of the step, 0 .. 1; (0,) in answers of one snapshot.
    points: (N, 3) float64, where the sides meet at toc, in the unit of the scene; with a separation the middle between
    their nearest points.
    normals: (N, 3) float64, of length one: from the face to the vertex, or from edge a to edge b; zero where there is
    no such side (ContactArray.msg tells when).
    closest: (N, 2, 3) float64, the nearest points of both sides at toc, in the unit of the scene.
    distance: (N,) float64, how far apart the sides are, in the unit of the scene: in answers to query ``proximity``,
    else (0,).
    minimum_separation: in force in the whole scene, in its unit; 0 where contacts touch. pair_separation: for the pairs
    of meshes that have one of their own, by their names in the order of the scene.
    features: what was tested at all: "vertex_face", "edge_edge" or both, but for pairs of meshes of which the node
    tests other ones (its parameter ``pair_features``).
    parts: into how many the step was cut, because meshes move by poses; 0 where none does. motion_bounds: (K,) float64,
    for each of mesh_names how far it may have been from its motion, or (0,); what that means is in ContactArray.msg.
    points, normals and closest are (0, 3) and (0, 2, 3) where the node does not send them (its parameter ``outputs``).
    All are views of the message, which they keep alive.
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
    distance: NDArray[np.float64]
    minimum_separation: float
    pair_separation: dict[tuple[str, str], float]
    features: tuple[str, ...]
    parts: int
    motion_bounds: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.mesh_a)


# Fields that may be empty, and the shape of what they hold for each contact.
_OPTIONAL: dict[str, tuple[int, ...]] = {"points": (3,), "normals": (3,), "closest": (2, 3), "distance": ()}


def contacts_from_message(message: ContactArray) -> ContactArrays:
    """The arrays of a message in their shapes. Of a step's contacts they are the earliest where ``message.truncated``.

    Raises ValueError where the arrays of the message do not fit together, which those of the node always do.
    """
    kind = np.frombuffer(message.kind, np.uint8)
    if (kind > ContactArray.EDGE_FACE).any() or (kind[1:] < kind[:-1]).any():
        raise ValueError("message: kind must hold those of vertex-face contacts, then edge-edge, then edge-face")
    count, (n_vertex_face, n_edge_edge, n_edge_face) = len(kind), np.bincount(kind, minlength=3).tolist()
    of_snapshot = n_edge_face > 0 or len(message.distance) > 0
    separation = _separation_of(message)
    order = {name: number for number, name in enumerate(message.mesh_names)}
    optional = {
        name: field(message, name, np.float64, (count if len(getattr(message, name)) else 0, *shape))
        for name, shape in _OPTIONAL.items()
    }
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
    )


def _separation_of(message: ContactArray) -> Separation:
    """The separation in force. Raises ValueError where the fields that tell it do not fit together."""
    try:
        return answer_fields.read_separation(message)
    except ValueError as error:
        raise ValueError(f"message: {error}") from None


def scene_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The contacts with features numbered across the scene: as ``hpccd_core.Contacts`` has them, and in its order.

    layout: ``Layout.of(mesh_names, topologies)`` of the meshes in the order of ``message.mesh_names``.
    Returns ``vf`` (N, 2) uint32, vertex and face; ``vf_toc`` (N,) float64; ``ee`` (M, 4) uint32, two edges by their
    vertices; ``ee_toc`` (M,) float64; ``points`` and ``normals`` (N+M, 3) float64, or (0, 3) where not sent;
    ``closest`` (N+M, 2, 3) float64, or (0, 2, 3). Of query ``proximity`` ``vf_distance`` (N,) and ``ee_distance`` (M,)
    take the place of the times; of query ``intersections`` there is only ``ef`` (K, 3) uint32, edge and face.
    Raises ValueError where the layout is of other meshes or of other versions of their topologies than the message.
    """
    contacts = contacts_from_message(message)
    if contacts.mesh_names != layout.mesh_names:
        raise ValueError(
            f"layout: it is of the meshes {', '.join(layout.mesh_names)}, the message of "
            f"{', '.join(contacts.mesh_names)}; make it of these, in this order"
        )
    return contact_messages.read_contacts(message, layout)


def pair_summary(message: PairSummaryArray, mesh_a: str, mesh_b: str) -> PairSummary:
    """That of two meshes, whichever comes first; of one mesh: its name twice.

    Raises ValueError where they are not tested against each other, or there are no such meshes.
    """
    for pair in message.pairs:
        if {pair.mesh_a, pair.mesh_b} == {mesh_a, mesh_b}:
            return pair
    there = ", ".join(f"{pair.mesh_a} and {pair.mesh_b}" for pair in message.pairs) or "none"
    raise ValueError(f"mesh_a, mesh_b: {mesh_a!r} and {mesh_b!r} are no pair that is tested; there are {there}")
