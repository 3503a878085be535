# SPDX-License-Identifier: Apache-2.0
"""The vertices of all meshes of a robot in one array: one call places them all."""

from collections.abc import Sequence

import numpy as np

from hpccd_core.joint_chains import placed
from hpccd_ros.rigid.body import Body


class LinkVertices:
    """bodies: of each mesh the number of its link, and its geometry in that link's frame."""

    def __init__(self, bodies: Sequence[tuple[int, Body]]) -> None:
        ends = np.cumsum([len(body.vertices) for _, body in bodies]).tolist()
        self._vertices = np.concatenate([body.vertices for _, body in bodies])
        self._meshes = [(link, end) for (link, _), end in zip(bodies, ends, strict=True)]
        self._rows = [slice(begin, end) for begin, end in zip([0, *ends], ends, strict=False)]

    def placed(self, poses: np.ndarray) -> np.ndarray:
        """(V,3) float64, as Rigid.apply gives them. poses (links,7): quaternion and shift."""
        return placed(poses, self._meshes, self._vertices)

    def of_meshes(self, vertices: np.ndarray) -> list[np.ndarray]:
        """Views: of each mesh its own. vertices: (V,3) of all."""
        return [vertices[rows] for rows in self._rows]
