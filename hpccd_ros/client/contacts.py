# SPDX-License-Identifier: Apache-2.0
"""The contacts of a step: the node's message to numpy arrays, numbered within each mesh or across the scene."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from hpccd.msg import ContactArray
from numpy.typing import NDArray

from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware import contact_messages
from hpccd_ros.middleware.contact_messages import SceneContacts


@dataclass(frozen=True, eq=False)
class ContactArrays:
    """The N contacts of one message in their canonical order; features are numbered within their mesh.

    mesh_names: of the scene. n_vertex_face: so many contacts, the first ones, are vertex-face, the others edge-edge.
    mesh_a, mesh_b: (N,) uint32, indices into mesh_names: the mesh of each side.
    features_a: (N, 2) uint32, of mesh_a: vertex and ``ContactArray.NONE``, or the two vertices of the edge.
    features_b: (N, 2) uint32, of mesh_b: face and ``ContactArray.NONE``, or the two vertices of the edge.
    toc: (N,) float64, time of contact as a fraction of the step, 0 .. 1.
    points: (N, 3) float64, where the sides meet at toc, in the unit of the scene.
    normals: (N, 3) float64, of length one: from the face to the vertex, or from edge a to edge b; zero where there is
    no such side (ContactArray.msg tells when).
    points and normals are (0, 3) where the node does not send them (its parameter ``outputs``). All are views of the
    message, which they keep alive.
    """

    mesh_names: tuple[str, ...]
    n_vertex_face: int
    mesh_a: NDArray[np.uint32]
    mesh_b: NDArray[np.uint32]
    features_a: NDArray[np.uint32]
    features_b: NDArray[np.uint32]
    toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.toc)


def contacts_from_message(message: ContactArray) -> ContactArrays:
    """The arrays of a message in their shapes. Of a step's contacts they are the earliest where ``message.truncated``.

    Raises ValueError where the arrays of the message do not fit together, which those of the node always do.
    """
    kind = np.frombuffer(message.kind, np.uint8)
    count, n_vertex_face = len(kind), int(np.count_nonzero(kind == ContactArray.VERTEX_FACE))
    of_vf, of_ee = kind[:n_vertex_face], kind[n_vertex_face:]
    if (of_vf != ContactArray.VERTEX_FACE).any() or (of_ee != ContactArray.EDGE_EDGE).any():
        raise ValueError("message: kind must hold those of vertex-face contacts, then those of edge-edge contacts")
    arrays = ContactArrays(
        tuple(message.mesh_names),
        n_vertex_face,
        mesh_a=_field(message, "mesh_a", np.uint32, (count,)),
        mesh_b=_field(message, "mesh_b", np.uint32, (count,)),
        features_a=_field(message, "features_a", np.uint32, (count, 2)),
        features_b=_field(message, "features_b", np.uint32, (count, 2)),
        toc=_field(message, "toc", np.float64, (count,)),
        points=_field(message, "points", np.float64, (count, 3) if len(message.points) else (0, 3)),
        normals=_field(message, "normals", np.float64, (count, 3) if len(message.normals) else (0, 3)),
    )
    for name in ("mesh_a", "mesh_b"):
        if (getattr(arrays, name) >= len(arrays.mesh_names)).any():
            raise ValueError(f"message: {name} names a mesh beyond the {len(arrays.mesh_names)} of mesh_names")
    return arrays


def _field(message: ContactArray, name: str, dtype: type[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    flat = np.frombuffer(getattr(message, name), dtype)
    if flat.size != np.prod(shape):
        raise ValueError(f"message: {name} has {flat.size} values, {np.prod(shape)} were expected for shape {shape}")
    return flat.reshape(shape)


def scene_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The contacts with features numbered across the scene: as ``hpccd_core.Contacts`` has them, and in its order.

    layout: ``Layout.of(mesh_names, topologies)`` of the meshes in the order of ``message.mesh_names``.
    Returns ``vf`` (N, 2) uint32, vertex and face; ``vf_toc`` (N,) float64; ``ee`` (M, 4) uint32, two edges by their
    vertices; ``ee_toc`` (M,) float64; ``points`` and ``normals`` (N+M, 3) float64, or (0, 3) where not sent.
    Raises ValueError where the layout is of other meshes or of other versions of their topologies than the message.
    """
    contacts = contacts_from_message(message)
    if contacts.mesh_names != layout.mesh_names:
        raise ValueError(
            f"layout: it is of the meshes {', '.join(layout.mesh_names)}, the message of "
            f"{', '.join(contacts.mesh_names)}; make it of these, in this order"
        )
    return contact_messages.read_contacts(message, layout)
