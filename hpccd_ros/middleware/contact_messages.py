# SPDX-License-Identifier: Apache-2.0
"""Contacts of the core <-> ContactArray."""

from array import array
from dataclasses import dataclass
from typing import Any

import numpy as np
from hpccd.msg import ContactArray
from numpy.typing import NDArray

from hpccd_core.mesh_layout import Sides
from hpccd_core.options import OUTPUTS
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware.fields import to_field, zeros


@dataclass(frozen=True, eq=False)
class FeaturePairs:
    """In the numbering of the scene, as the core gives them: ``vf`` (N, 2) vertex and face, ``ee`` (M, 4) two edges,
    ``ef`` (K, 3) edge and face; uint32."""

    vf: NDArray[np.uint32]
    ee: NDArray[np.uint32]
    ef: NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee) + len(self.ef)

    @classmethod
    def of(cls, vf=None, ee=None, ef=None) -> "FeaturePairs":
        """None: there are none of this kind."""
        shapes = ((vf, 2), (ee, 4), (ef, 3))
        return cls(*(np.empty((0, width), np.uint32) if v is None else v for v, width in shapes))

    def keep(self, rows: NDArray[np.intp]) -> "FeaturePairs":
        """The rows with these numbers (ascending), in this order."""
        first, second = len(self.vf), len(self.vf) + len(self.ee)
        of_vf, of_ee, of_ef = np.split(rows, np.searchsorted(rows, [first, second]))
        return FeaturePairs(self.vf[of_vf], self.ee[of_ee - first], self.ef[of_ef - second])


def fill_pairs(message: ContactArray, pairs: FeaturePairs, layout: Layout) -> None:
    """Write kind, mesh_a, mesh_b, features_a and features_b."""
    count, n_vf, n_ee = len(pairs), len(pairs.vf), len(pairs.ee)
    kind, mesh_a, mesh_b = zeros("B", count), zeros("I", count), zeros("I", count)
    features_a, features_b = zeros("I", 2 * count), zeros("I", 2 * count)
    kinds = np.frombuffer(kind, np.uint8)
    kinds[n_vf : n_vf + n_ee], kinds[n_vf + n_ee :] = ContactArray.EDGE_EDGE, ContactArray.EDGE_FACE
    in_a, in_b = (np.frombuffer(mesh, np.uint32) for mesh in (mesh_a, mesh_b))
    side_a, side_b = (np.frombuffer(side, np.uint32).reshape(-1, 2) for side in (features_a, features_b))
    Sides(in_a, in_b, side_a, side_b).fill(layout, vf=pairs.vf, ee=pairs.ee, ef=pairs.ef)
    # Only now: the setters copy, unless the message was made with check_fields=True.
    message.kind, message.mesh_a, message.mesh_b = kind, mesh_a, mesh_b
    message.features_a, message.features_b = features_a, features_b


def fill_outputs(message: ContactArray, sent: dict[str, NDArray[Any]], layout: Layout) -> None:
    """Write arrays of outputs, of the pairs that `fill_pairs` has written."""
    for name, values in sent.items():
        within = (values - _first_vertices(message, layout)).astype(np.uint32) if name == "vertices" else values
        setattr(message, name, to_field(within))


def _first_vertices(message: ContactArray, layout: Layout) -> NDArray[np.int64]:
    """(N, 4): scene-wide number of the first vertex of the mesh of each entry in ``vertices``."""
    return _of_meshes_of_corners(message, layout.vertex_offsets)


def _of_meshes_of_corners(message: ContactArray, by_mesh: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N, 4): the number of the mesh of each entry in ``vertices``."""
    of_a, of_b = (by_mesh[np.frombuffer(m, np.uint32)] for m in (message.mesh_a, message.mesh_b))
    second = np.where(np.frombuffer(message.kind, np.uint8) == ContactArray.VERTEX_FACE, of_b, of_a)
    return np.stack([of_a, second, of_b, of_b], 1)


def beyond_meshes(message: ContactArray, layout: Layout) -> str | None:
    """In words, a mesh, feature or vertex that does not exist, or None; of a message whose arrays fit together.

    In scene-wide indices they could be mistaken for others.
    """
    kind, of_vertices = np.frombuffer(message.kind, np.uint8), np.diff(layout.vertex_offsets)
    corners = np.frombuffer(message.vertices, np.uint32).reshape(-1, 4)
    for side, alone, counts in (
        ("a", kind == ContactArray.VERTEX_FACE, of_vertices),
        ("b", kind != ContactArray.EDGE_EDGE, np.diff(layout.face_offsets)),
    ):
        mesh = np.frombuffer(getattr(message, f"mesh_{side}"), np.uint32)
        feature = np.frombuffer(getattr(message, f"features_{side}"), np.uint32).reshape(-1, 2)
        if (mesh >= len(layout.mesh_names)).any():
            return f"mesh_{side} names mesh {mesh.max()} of {len(layout.mesh_names)}"
        first = np.where(alone, counts[mesh], of_vertices[mesh])
        wrong = (feature[:, 0] >= first) | np.where(alone, feature[:, 1] != message.NONE, feature[:, 1] >= first)
        if wrong.any():
            row = int(np.argmax(wrong))
            return (
                f"features_{side} of contact {row} are {feature[row].tolist()}, in mesh {layout.mesh_names[mesh[row]]}"
            )
    if len(corners):
        wrong = (corners >= _of_meshes_of_corners(message, of_vertices)).any(1)
        if wrong.any():
            row = int(np.argmax(wrong))
            return f"vertices of contact {row} are {corners[row].tolist()}, beyond those of their meshes"
    return None


def read_pairs(message: ContactArray, layout: Layout) -> FeaturePairs:
    """The inverse of `fill_pairs`, of a message whose arrays fit together."""
    kind = np.frombuffer(message.kind, np.uint8)
    mesh_a, mesh_b = (np.frombuffer(mesh, np.uint32) for mesh in (message.mesh_a, message.mesh_b))
    side_a, side_b = (np.frombuffer(s, np.uint32).reshape(-1, 2) for s in (message.features_a, message.features_b))
    vertices, faces = layout.vertex_offsets, layout.face_offsets
    of_vf, of_ee, of_ef = (
        np.flatnonzero(kind == wanted)
        for wanted in (ContactArray.VERTEX_FACE, ContactArray.EDGE_EDGE, ContactArray.EDGE_FACE)
    )
    vf = np.stack([side_a[of_vf, 0] + vertices[mesh_a[of_vf]], side_b[of_vf, 0] + faces[mesh_b[of_vf]]], axis=1)
    ee = np.concatenate(
        [side_a[of_ee] + vertices[mesh_a[of_ee], None], side_b[of_ee] + vertices[mesh_b[of_ee], None]], axis=1
    )
    ef = np.concatenate(
        [side_a[of_ef] + vertices[mesh_a[of_ef], None], side_b[of_ef, :1] + faces[mesh_b[of_ef], None]], axis=1
    )
    return FeaturePairs(vf.astype(np.uint32), ee.astype(np.uint32), ef.astype(np.uint32))


def fill_contacts(
    message: ContactArray,
    contacts,
    layout: Layout,
    *,
    max_contacts: int = 0,
    outputs: tuple[str, ...] = OUTPUTS,
) -> None:
    """Write the core's ``Contacts`` into ``message`` (all but header, start, step, accuracy, backend, drops and the
    separation).

    max_contacts: 0: all; else only that many of the earliest, still in canonical order (of equal times those
    first in it); ``total``, ``first_toc`` and ``hash`` are of all contacts found.
    outputs: which outputs to send, where the core has computed them.
    """
    pairs, vf_toc, ee_toc = FeaturePairs.of(contacts.vf, contacts.ee), contacts.vf_toc, contacts.ee_toc
    total = len(pairs)
    sent = outputs_of(contacts, outputs, total)
    truncated = 0 < max_contacts < total
    if truncated:
        keep = lowest(np.concatenate([vf_toc, ee_toc]), max_contacts)
        n_vf = len(pairs.vf)
        pairs = pairs.keep(keep)
        vf_toc, ee_toc = vf_toc[keep[keep < n_vf]], ee_toc[keep[keep >= n_vf] - n_vf]
        sent = {name: values[keep] for name, values in sent.items()}
    fill_pairs(message, pairs, layout)
    toc = zeros("d", len(pairs))
    np.concatenate([vf_toc, ee_toc], out=np.frombuffer(toc))
    message.toc = toc
    fill_names(message, layout)
    fill_outputs(message, sent, layout)
    message.first_toc = float(contacts.first_toc)
    message.total, message.truncated, message.hash = total, truncated, int(contacts.hash)


def outputs_of(found: Any, outputs: tuple[str, ...], total: int) -> dict[str, NDArray[Any]]:
    """The arrays of the core's result that these words ask for, as far as it has them."""
    arrays = {name: getattr(found, name, None) for name, array in OUTPUT_ARRAYS.items() if array.asked in outputs}
    return {name: values for name, values in arrays.items() if values is not None and len(values) == total}


def fill_names(message, layout: Layout) -> None:
    """Write which meshes, and which versions of their topologies, the indices are of."""
    message.mesh_names = list(layout.mesh_names)
    message.topology_versions = array("I", layout.topology_versions)


def lowest(values: np.ndarray, count: int) -> np.ndarray:
    """Indices of the ``count`` smallest values in ascending order of index; ties go to the lower index."""
    threshold = np.partition(values, count - 1)[count - 1]
    before = np.flatnonzero(values < threshold)
    ties = np.flatnonzero(values == threshold)[: count - len(before)]
    return np.sort(np.concatenate([before, ties]))


@dataclass(frozen=True, eq=False)
class SceneContacts:
    """A ContactArray in the scene-wide numbering of the core, with the names, shapes and dtypes of
    hpccd_core.Contacts, Proximity (``vf_distance``, ``ee_distance``) and Intersections (``ef``); what the message does
    not hold is empty."""

    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    closest: NDArray[np.float64]
    vertices: NDArray[np.uint32]
    weights: NDArray[np.float64]
    approach: NDArray[np.float64]
    vf_distance: NDArray[np.float64]
    ee_distance: NDArray[np.float64]
    ef: NDArray[np.uint32]


def _scene_wide_vertices(message: ContactArray, layout: Layout) -> NDArray[np.uint32]:
    vertices = np.frombuffer(message.vertices, np.uint32).reshape(-1, 4)
    return (vertices + _first_vertices(message, layout)).astype(np.uint32) if len(vertices) else vertices


def other_topologies(message: ContactArray, layout: Layout) -> str | None:
    """In words, where both tell the versions of their topologies and these differ; else None."""
    of_message, of_layout = tuple(message.topology_versions), layout.topology_versions
    if not of_message or not of_layout or of_message == of_layout:
        return None
    return f"the contacts are of topology versions {list(of_message)}, the layout is of {list(of_layout)}"


def read_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The inverse of fill_contacts (what was cut off stays cut off). Outputs have as many rows as contacts, or none.

    Raises ValueError where the message belongs to other versions of the topologies than the layout.
    """
    if why := other_topologies(message, layout):
        raise ValueError(f"layout: {why}; create it from the topologies of these versions")
    pairs = read_pairs(message, layout)
    toc, distance = np.frombuffer(message.toc, np.float64), np.frombuffer(message.distance, np.float64)
    n_vf = len(pairs.vf)
    return SceneContacts(
        pairs.vf,
        toc[:n_vf],
        pairs.ee,
        toc[n_vf:],
        np.frombuffer(message.points, np.float64).reshape(-1, 3),
        np.frombuffer(message.normals, np.float64).reshape(-1, 3),
        np.frombuffer(message.closest, np.float64).reshape(-1, 2, 3),
        _scene_wide_vertices(message, layout),
        np.frombuffer(message.weights, np.float64).reshape(-1, 4),
        np.frombuffer(message.approach, np.float64),
        distance[:n_vf],
        distance[n_vf:],
        pairs.ef,
    )
