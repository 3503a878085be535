# SPDX-License-Identifier: Apache-2.0
"""Pairs of features in the fields of a message, and back: the core numbers features across the scene, the message
within a mesh."""

from dataclasses import dataclass

import numpy as np
from hpccd.msg import ContactArray
from numpy.typing import NDArray

from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware.fields import zeros


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
        """Of all of them, in this order, only those with these numbers (ascending)."""
        first, second = len(self.vf), len(self.vf) + len(self.ee)
        of_vf, of_ee, of_ef = np.split(rows, np.searchsorted(rows, [first, second]))
        return FeaturePairs(self.vf[of_vf], self.ee[of_ee - first], self.ef[of_ef - second])


def fill_pairs(message: ContactArray, pairs: FeaturePairs, layout: Layout) -> None:
    """Write kind, mesh_a, mesh_b, features_a and features_b."""
    count, n_vf, n_ee = len(pairs), len(pairs.vf), len(pairs.ee)
    kind, mesh_a, mesh_b = zeros("B", count), zeros("I", count), zeros("I", count)
    features_a, features_b = zeros("I", 2 * count), zeros("I", 2 * count)
    kinds = np.frombuffer(kind, np.uint8)
    in_a, in_b = (np.frombuffer(mesh, np.uint32) for mesh in (mesh_a, mesh_b))
    side_a, side_b = (np.frombuffer(side, np.uint32).reshape(-1, 2) for side in (features_a, features_b))
    of_vf, of_ee, of_ef = slice(n_vf), slice(n_vf, n_vf + n_ee), slice(n_vf + n_ee, count)
    kinds[of_ee], kinds[of_ef] = ContactArray.EDGE_EDGE, ContactArray.EDGE_FACE
    side_a[of_vf, 1] = side_b[of_vf, 1] = side_b[of_ef, 1] = ContactArray.NONE
    vertices, faces = layout.vertex_offsets, layout.face_offsets
    localise(pairs.vf[:, 0:1], vertices, in_a[of_vf], side_a[of_vf])
    localise(pairs.vf[:, 1:2], faces, in_b[of_vf], side_b[of_vf])
    localise(pairs.ee[:, 0:2], vertices, in_a[of_ee], side_a[of_ee])
    localise(pairs.ee[:, 2:4], vertices, in_b[of_ee], side_b[of_ee])
    localise(pairs.ef[:, 0:2], vertices, in_a[of_ef], side_a[of_ef])
    localise(pairs.ef[:, 2:3], faces, in_b[of_ef], side_b[of_ef])
    # Only now: the setters copy, unless the message was made with check_fields=True.
    message.kind, message.mesh_a, message.mesh_b = kind, mesh_a, mesh_b
    message.features_a, message.features_b = features_a, features_b


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


def localise(indices: np.ndarray, offsets: np.ndarray, mesh: np.ndarray, local: np.ndarray) -> None:
    """Write the mesh of each row and its indices local to that; the entries of one row belong to one mesh.

    indices: (n,k); mesh: (n,), full of zeros; local: (n, at least k).
    """
    if not len(indices):
        return
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
