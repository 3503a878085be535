# SPDX-License-Identifier: Apache-2.0
"""Converts between scene-wide indices of the core and indices within a mesh, as in messages."""

from dataclasses import dataclass

import numpy as np

from hpccd_core.mesh_layout import MeshLayout
from hpccd_ros.frames.types import Topology


@dataclass(frozen=True, eq=False)
class Layout(MeshLayout):
    """Position of each mesh in the scene-wide numbering of the core.

    ``vertex_offsets``, ``face_offsets``: (K+1,) int64, the last entry is the total. ``topology_versions``: one for each
    mesh; empty: not known.
    """

    topology_versions: tuple[int, ...] = ()

    @classmethod
    def of(cls, mesh_names: tuple[str, ...], topologies: tuple[Topology, ...]) -> "Layout":
        """Meshes concatenated in the order given, as hpccd_core.Scene does.

        Raises ValueError if the numbers of topologies and names differ.
        """
        if len(mesh_names) != len(topologies):
            raise ValueError(f"topologies: {len(topologies)} of {len(mesh_names)} meshes; give one for each name")
        return cls(
            tuple(mesh_names),
            np.cumsum([0] + [t.n_vertices for t in topologies], dtype=np.int64),
            np.cumsum([0] + [len(t.faces) for t in topologies], dtype=np.int64),
            tuple(t.version for t in topologies),
        )
