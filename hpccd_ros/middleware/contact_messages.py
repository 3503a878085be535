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

# Kinds in the order of messages, each with its value of `kind` and the number of indices of a pair.
KINDS = {
    "vf": (ContactArray.VERTEX_FACE, 2),
    "ee": (ContactArray.EDGE_EDGE, 4),
    "ef": (ContactArray.EDGE_FACE, 3),
    "vp": (ContactArray.VERTEX_PLANE, 2),
    "vv": (ContactArray.VERTEX_VERTEX, 2),
    "ve": (ContactArray.VERTEX_EDGE, 3),
}
#: Those of contacts and proximity, in the order of the core's outputs.
TIMED = ("vf", "ee", "vp", "vv", "ve")
_NONE = {kind: np.empty((0, width), np.uint32) for kind, (_, width) in KINDS.items()}


@dataclass(frozen=True, eq=False)
class FeaturePairs:
    """In the numbering of the scene, as the core gives them: ``vf`` (N, 2) vertex and face, ``ee`` (M, 4) two edges,
    ``ef`` (K, 3) edge and face, ``vp`` (L, 2) vertex and plane, ``vv`` (P, 2) two points, ``ve`` (Q, 3) point and edge;
    uint32."""

    vf: NDArray[np.uint32]
    ee: NDArray[np.uint32]
    ef: NDArray[np.uint32]
    vp: NDArray[np.uint32]
    vv: NDArray[np.uint32]
    ve: NDArray[np.uint32]

    def __len__(self) -> int:
        return sum(map(len, self.by_kind.values()))

    @property
    def by_kind(self) -> dict[str, NDArray[np.uint32]]:
        """In the order of messages."""
        return {kind: getattr(self, kind) for kind in KINDS}

    @classmethod
    def of(cls, **pairs: NDArray[np.uint32]) -> "FeaturePairs":
        """Of the other kinds there are none."""
        return cls(**{kind: pairs.get(kind, _NONE[kind]) for kind in KINDS})

    @classmethod
    def of_result(cls, found: Any) -> "FeaturePairs":
        """Those of contacts or proximity."""
        return cls.of(**{kind: getattr(found, kind) for kind in TIMED})

    def keep(self, rows: NDArray[np.intp]) -> "FeaturePairs":
        """The rows with these numbers (ascending), in this order."""
        ends = np.cumsum([len(pairs) for pairs in self.by_kind.values()])
        of_kinds = np.split(rows, np.searchsorted(rows, ends[:-1]))
        kept = zip(self.by_kind.items(), of_kinds, ends, strict=True)
        return FeaturePairs(**{kind: pairs[of_kind - (end - len(pairs))] for (kind, pairs), of_kind, end in kept})


def times_of(contacts: Any) -> NDArray[np.float64]:
    """Times of impact of the core's contacts, of all kinds in the order of its outputs."""
    return np.concatenate([getattr(contacts, f"{kind}_toc") for kind in TIMED])


def fill_pairs(message: ContactArray, pairs: FeaturePairs, layout: Layout) -> None:
    """Write kind, mesh_a, mesh_b, features_a and features_b."""
    count = len(pairs)
    kind, mesh_a, mesh_b = zeros("B", count), zeros("I", count), zeros("I", count)
    features_a, features_b = zeros("I", 2 * count), zeros("I", 2 * count)
    end = 0
    for name, rows in pairs.by_kind.items():
        end += len(rows)
        np.frombuffer(kind, np.uint8)[end - len(rows) : end] = KINDS[name][0]
    in_a, in_b = (np.frombuffer(mesh, np.uint32) for mesh in (mesh_a, mesh_b))
    side_a, side_b = (np.frombuffer(side, np.uint32).reshape(-1, 2) for side in (features_a, features_b))
    Sides(in_a, in_b, side_a, side_b).fill(layout, **pairs.by_kind)
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
    kind = np.frombuffer(message.kind, np.uint8)
    of_b = np.where(kind == ContactArray.VERTEX_PLANE, of_a, of_b)  # a plane has no vertices
    return np.stack([of_a, np.where(kind == ContactArray.VERTEX_FACE, of_b, of_a), of_b, of_b], 1)


def beyond_meshes(message: ContactArray, layout: Layout) -> str | None:
    """In words, a mesh, feature or vertex that does not exist, or None; of a message whose arrays fit together.

    In scene-wide indices they could be mistaken for others.
    """
    kind, of_vertices, of_faces = (
        np.frombuffer(message.kind, np.uint8),
        np.diff(layout.vertex_offsets),
        np.diff(layout.face_offsets),
    )
    corners = np.frombuffer(message.vertices, np.uint32).reshape(-1, 4)
    to_faces = np.isin(kind, [ContactArray.VERTEX_FACE, ContactArray.EDGE_FACE])
    to_planes = kind == ContactArray.VERTEX_PLANE
    of_edges = np.isin(kind, [ContactArray.EDGE_EDGE, ContactArray.EDGE_FACE])
    for side, alone in (("a", ~of_edges), ("b", to_faces | to_planes | (kind == ContactArray.VERTEX_VERTEX))):
        mesh = np.frombuffer(getattr(message, f"mesh_{side}"), np.uint32)
        feature = np.frombuffer(getattr(message, f"features_{side}"), np.uint32).reshape(-1, 2)
        if (mesh >= len(layout.mesh_names)).any():
            return f"mesh_{side} names mesh {mesh.max()} of {len(layout.mesh_names)}"
        count = of_vertices[mesh] if side == "a" else np.where(to_faces, of_faces[mesh], of_vertices[mesh])
        wrong = (feature[:, 0] >= count) | np.where(alone, feature[:, 1] != message.NONE, feature[:, 1] >= count)
        if side == "b":
            is_plane = np.isin(mesh, layout.planes) & (feature == message.NONE).all(axis=1)
            wrong = np.where(to_planes, ~is_plane, wrong)
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
    first_vertex, first_face = layout.vertex_offsets, layout.face_offsets
    found = {}
    for name, (value, _) in KINDS.items():
        rows = np.flatnonzero(kind == value)
        a, b = mesh_a[rows], mesh_b[rows]
        of_a = side_a[rows, : 2 if name in ("ee", "ef") else 1] + first_vertex[a, None]
        if name == "vp":
            of_b = np.searchsorted(layout.planes, b)[:, None]
        elif name in ("vf", "ef"):
            of_b = side_b[rows, :1] + first_face[b, None]
        else:
            of_b = side_b[rows, : 1 if name == "vv" else 2] + first_vertex[b, None]
        found[name] = np.concatenate([of_a, of_b], axis=1).astype(np.uint32)
    return FeaturePairs(**found)


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
    pairs, toc = FeaturePairs.of_result(contacts), times_of(contacts)
    total = len(pairs)
    sent = outputs_of(contacts, outputs, total)
    truncated = 0 < max_contacts < total
    if truncated:
        keep = lowest(toc, max_contacts)
        pairs, toc, sent = pairs.keep(keep), toc[keep], {name: values[keep] for name, values in sent.items()}
    fill_pairs(message, pairs, layout)
    message.toc = to_field(toc)
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
    hpccd_core.Contacts, Proximity (``vf_distance``, ...) and Intersections (``ef``); what the message does not hold is
    empty."""

    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    vp: NDArray[np.uint32]
    vp_toc: NDArray[np.float64]
    vv: NDArray[np.uint32]
    vv_toc: NDArray[np.float64]
    ve: NDArray[np.uint32]
    ve_toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    closest: NDArray[np.float64]
    vertices: NDArray[np.uint32]
    weights: NDArray[np.float64]
    approach: NDArray[np.float64]
    vf_distance: NDArray[np.float64]
    ee_distance: NDArray[np.float64]
    vp_distance: NDArray[np.float64]
    vv_distance: NDArray[np.float64]
    ve_distance: NDArray[np.float64]
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
    kind = np.frombuffer(message.kind, np.uint8)
    of_kinds = {
        f"{name}_{what}": values[kind == KINDS[name][0]] if len(values) else values
        for what in ("toc", "distance")
        for values in [np.frombuffer(getattr(message, what), np.float64)]
        for name in TIMED
    }
    return SceneContacts(
        vf=pairs.vf,
        ee=pairs.ee,
        vp=pairs.vp,
        vv=pairs.vv,
        ve=pairs.ve,
        ef=pairs.ef,
        **of_kinds,
        points=np.frombuffer(message.points, np.float64).reshape(-1, 3),
        normals=np.frombuffer(message.normals, np.float64).reshape(-1, 3),
        closest=np.frombuffer(message.closest, np.float64).reshape(-1, 2, 3),
        vertices=_scene_wide_vertices(message, layout),
        weights=np.frombuffer(message.weights, np.float64).reshape(-1, 4),
        approach=np.frombuffer(message.approach, np.float64),
    )
