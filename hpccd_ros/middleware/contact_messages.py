# SPDX-License-Identifier: Apache-2.0
"""Contacts of the core <-> ContactArray: the core numbers features across the scene, the message within a mesh."""

from array import array
from dataclasses import dataclass

import numpy as np
from hpccd.msg import ContactArray
from numpy.typing import NDArray

from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware.fields import to_field, zeros


def fill_contacts(
    message: ContactArray,
    contacts,
    layout: Layout,
    *,
    max_contacts: int = 0,
    outputs: tuple[str, ...] = ("points", "normals"),
) -> None:
    """Write the core's ``Contacts`` into ``message`` (all but header, start, step, accuracy, backend, drops).

    max_contacts: 0: all; else only that many of the earliest, still in canonical order (of equal times those
    first in it); ``total``, ``first_toc`` and ``hash`` are of all contacts found.
    outputs: which of points and normals to send, where the core has computed them.
    """
    n_vf, n_ee = len(contacts.vf), len(contacts.ee)
    total = n_vf + n_ee
    vf, ee, vf_toc, ee_toc = contacts.vf, contacts.ee, contacts.vf_toc, contacts.ee_toc
    points, normals = (v if v is not None and len(v) == total else None for v in (contacts.points, contacts.normals))
    truncated = 0 < max_contacts < total
    if truncated:
        keep = _earliest(np.concatenate([vf_toc, ee_toc]), max_contacts)
        of_vf, of_ee = keep[keep < n_vf], keep[keep >= n_vf] - n_vf
        vf, ee, vf_toc, ee_toc = vf[of_vf], ee[of_ee], vf_toc[of_vf], ee_toc[of_ee]
        n_vf, n_ee = len(vf), len(ee)
        points = None if points is None else points[keep]
        normals = None if normals is None else normals[keep]

    count = n_vf + n_ee
    kind, mesh_a, mesh_b = zeros("B", count), zeros("I", count), zeros("I", count)
    features_a, features_b, toc = zeros("I", 2 * count), zeros("I", 2 * count), zeros("d", count)
    np.frombuffer(kind, np.uint8)[n_vf:] = ContactArray.EDGE_EDGE
    in_a, in_b = (np.frombuffer(mesh, np.uint32) for mesh in (mesh_a, mesh_b))
    side_a, side_b = (np.frombuffer(side, np.uint32).reshape(-1, 2) for side in (features_a, features_b))
    side_a[:n_vf, 1] = side_b[:n_vf, 1] = ContactArray.NONE
    _localise(vf[:, 0:1], layout.vertex_offsets, in_a[:n_vf], side_a[:n_vf])
    _localise(vf[:, 1:2], layout.face_offsets, in_b[:n_vf], side_b[:n_vf])
    _localise(ee[:, 0:2], layout.vertex_offsets, in_a[n_vf:], side_a[n_vf:])
    _localise(ee[:, 2:4], layout.vertex_offsets, in_b[n_vf:], side_b[n_vf:])
    np.concatenate([vf_toc, ee_toc], out=np.frombuffer(toc))

    message.mesh_names = list(layout.mesh_names)
    message.topology_versions = array("I", layout.topology_versions)
    # Only now: the setters copy, unless the message was made with check_fields=True.
    message.kind, message.mesh_a, message.mesh_b = kind, mesh_a, mesh_b
    message.features_a, message.features_b, message.toc = features_a, features_b, toc
    if points is not None and "points" in outputs:
        message.points = to_field(points)
    if normals is not None and "normals" in outputs:
        message.normals = to_field(normals)
    message.first_toc = float(contacts.first_toc)
    message.total, message.truncated, message.hash = total, truncated, int(contacts.hash)


def _earliest(toc: np.ndarray, count: int) -> np.ndarray:
    """Indices of the ``count`` smallest values in ascending order of index; ties go to the lower index."""
    threshold = np.partition(toc, count - 1)[count - 1]
    before = np.flatnonzero(toc < threshold)
    ties = np.flatnonzero(toc == threshold)[: count - len(before)]
    return np.sort(np.concatenate([before, ties]))


def _localise(indices: np.ndarray, offsets: np.ndarray, mesh: np.ndarray, local: np.ndarray) -> None:
    """Write the mesh of each row and its indices local to that; the entries of one row belong to one mesh.

    indices: (n,k); mesh: (n,), full of zeros; local: (n, at least k).
    """
    # By columns: numpy is four times slower on many rows of one or two.
    if len(offsets) == 2:  # one mesh: nothing to look up
        for column in range(indices.shape[1]):
            local[:, column] = indices[:, column]
        return
    mesh[...] = np.searchsorted(offsets, indices[:, 0], side="right") - 1
    # In the type of the indices: numpy would widen to 64 bits, at twice the time.
    start = offsets.astype(indices.dtype)[mesh]
    for column in range(indices.shape[1]):
        np.subtract(indices[:, column], start, out=local[:, column])


@dataclass(frozen=True, eq=False)
class SceneContacts:
    """A ContactArray in the scene-wide numbering of hpccd_core.Contacts: same names, shapes and dtypes."""

    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]


def other_topologies(message: ContactArray, layout: Layout) -> str | None:
    """In words, where both tell the versions of their topologies and these differ; else None."""
    of_message, of_layout = tuple(message.topology_versions), layout.topology_versions
    if not of_message or not of_layout or of_message == of_layout:
        return None
    return f"the contacts are of topology versions {list(of_message)}, the layout is of {list(of_layout)}"


def read_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The inverse of fill_contacts (what was cut off stays cut off). points, normals: (N,3) or (0,3).

    Raises ValueError where the message belongs to other versions of the topologies than the layout.
    """
    if why := other_topologies(message, layout):
        raise ValueError(f"layout: {why}; make it of the topologies of these versions")
    kind = np.frombuffer(message.kind, np.uint8)
    n_vf = int(np.count_nonzero(kind == ContactArray.VERTEX_FACE))
    mesh_a = np.frombuffer(message.mesh_a, np.uint32)
    mesh_b = np.frombuffer(message.mesh_b, np.uint32)
    side_a = np.frombuffer(message.features_a, np.uint32).reshape(-1, 2)
    side_b = np.frombuffer(message.features_b, np.uint32).reshape(-1, 2)
    toc = np.frombuffer(message.toc, np.float64)
    vertices, faces = layout.vertex_offsets, layout.face_offsets
    vf = np.stack([side_a[:n_vf, 0] + vertices[mesh_a[:n_vf]], side_b[:n_vf, 0] + faces[mesh_b[:n_vf]]], axis=1)
    ee = np.concatenate(
        [side_a[n_vf:] + vertices[mesh_a[n_vf:], None], side_b[n_vf:] + vertices[mesh_b[n_vf:], None]], axis=1
    )
    return SceneContacts(
        vf.astype(np.uint32),
        toc[:n_vf],
        ee.astype(np.uint32),
        toc[n_vf:],
        np.frombuffer(message.points, np.float64).reshape(-1, 3),
        np.frombuffer(message.normals, np.float64).reshape(-1, 3),
    )
