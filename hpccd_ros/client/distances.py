# SPDX-License-Identifier: Apache-2.0
"""The smallest distance of each pair of meshes: the node's message to numpy arrays."""

import math
from dataclasses import dataclass

import numpy as np
from hpccd.msg import DistanceArray
from numpy.typing import NDArray

from hpccd_ros.client.contacts import field, meshes_of


@dataclass(frozen=True, eq=False)
class DistanceArrays:
    """P pairs of meshes of one snapshot, in the order of the scene; a mesh with itself is a pair too. Features are
    numbered within their mesh.

    mesh_names: of the scene. distance: (P,) float64, in the unit of the scene; +inf where there are no two features.
    kind: (P,) uint8, ``DistanceArray.VERTEX_FACE``, ``EDGE_EDGE``, ``EDGE_FACE`` (they intersect) or ``NO_PAIR``.
    mesh_a, mesh_b: (P,) uint32, indices into mesh_names: the mesh of each side. The vertex of a vertex-face pair, and
    the edge of an edge-face pair, is of mesh_a, whichever comes first in the scene.
    features_a: (P, 2) uint32, of mesh_a: vertex and ``DistanceArray.NONE``, or the two vertices of the edge.
    features_b: (P, 2) uint32, of mesh_b: face and ``DistanceArray.NONE``, or the two vertices of the edge.
    points: (P, 2, 3) float64, the nearest points of both sides, in the unit of the scene.
    direction: (P, 3) float64, unit vector from the nearest point of mesh_a to that of mesh_b; 0 where it is not known.
    approach_speed: (P,) float64, by how much the distance became smaller in a second, on the mean of the time since the
    snapshot before; > 0: nearing; NaN where it is not known.
    All that the message has are views of it, which they keep alive.
    """

    mesh_names: tuple[str, ...]
    distance: NDArray[np.float64]
    kind: NDArray[np.uint8]
    mesh_a: NDArray[np.uint32]
    mesh_b: NDArray[np.uint32]
    features_a: NDArray[np.uint32]
    features_b: NDArray[np.uint32]
    points: NDArray[np.float64]
    direction: NDArray[np.float64]
    approach_speed: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.distance)

    def between(self, mesh_a: str, mesh_b: str) -> float:
        """The smallest distance of two meshes, or within one; +inf where they are not tested against each other.

        Raises ValueError for a name that the scene does not have.
        """
        a, b = self._number("mesh_a", mesh_a), self._number("mesh_b", mesh_b)
        wanted = ((self.mesh_a == a) & (self.mesh_b == b)) | ((self.mesh_a == b) & (self.mesh_b == a))
        return float(self.distance[wanted].min(initial=math.inf))

    def _number(self, argument: str, mesh: str) -> int:
        if mesh not in self.mesh_names:
            raise ValueError(f"{argument}: no mesh is named {mesh!r}; there are {', '.join(self.mesh_names)}")
        return self.mesh_names.index(mesh)


def distances_from_message(message: DistanceArray) -> DistanceArrays:
    """The arrays of a message in their shapes.

    Raises ValueError where the arrays of the message do not fit together, which those of the node always do.
    """
    count = len(message.distance)
    n_directed = len(message.direction) or len(message.approach_speed)
    return DistanceArrays(
        tuple(message.mesh_names),
        distance=field(message, "distance", np.float64, (count,)),
        kind=field(message, "kind", np.uint8, (count,)),
        mesh_a=meshes_of(message, "mesh_a", count),
        mesh_b=meshes_of(message, "mesh_b", count),
        features_a=field(message, "features_a", np.uint32, (count, 2)),
        features_b=field(message, "features_b", np.uint32, (count, 2)),
        points=field(message, "points", np.float64, (count, 2, 3)),
        direction=field(message, "direction", np.float64, (count, 3)) if n_directed else np.zeros((count, 3)),
        approach_speed=field(message, "approach_speed", np.float64, (count,)) if n_directed else np.full(count, np.nan),
    )
