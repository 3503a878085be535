# SPDX-License-Identifier: Apache-2.0
"""Converts between scene-wide indices of the core and indices within a mesh, as in messages."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc
from hpccd_core.mesh_layout import MeshLayout, mesh_of
from hpccd_ros.frames.types import Topology


def meshes_of_contacts(
    contacts: hc.Contacts, layout: MeshLayout
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]]:
    """For each kind of contact the numbers of the meshes of both sides, and the times of impact."""
    vertices, faces = layout.vertex_offsets, layout.face_offsets
    for kind, second, of_second in (("vf", 1, faces), ("ee", 2, vertices), ("vv", 1, vertices), ("ve", 1, vertices)):
        rows = getattr(contacts, kind)
        yield mesh_of(rows[:, 0], vertices), mesh_of(rows[:, second], of_second), getattr(contacts, f"{kind}_toc")
    yield mesh_of(contacts.vp[:, 0], vertices), layout.planes[contacts.vp[:, 1]].astype(np.intp), contacts.vp_toc


@dataclass(frozen=True, eq=False)
class Layout(MeshLayout):
    """Position of each mesh in the scene-wide numbering of the core.

    ``vertex_offsets``, ``face_offsets``: (K+1,) int64, the last entry is the total. ``topology_versions``: one for each
    mesh, 0 for a plane; empty: not known.
    """

    topology_versions: tuple[int, ...] = ()

    @classmethod
    def of(
        cls, mesh_names: tuple[str, ...], topologies: tuple[Topology, ...], planes: tuple[str, ...] = ()
    ) -> "Layout":
        """Meshes concatenated in the order given, as hpccd_core.Scene does, and then the planes.

        mesh_names: of the topologies; the names of the planes may follow. Raises ValueError if the numbers of
        topologies and names differ.
        """
        names = tuple(mesh_names)
        if planes and names[-len(planes) :] == tuple(planes):
            names = names[: -len(planes)]
        if len(names) != len(topologies):
            raise ValueError(f"topologies: {len(topologies)} of {len(names)} meshes; give one for each name")
        of_planes = [0] * len(planes)
        return cls(
            names + tuple(planes),
            np.cumsum([0] + [t.n_vertices for t in topologies] + of_planes, dtype=np.int64),
            np.cumsum([0] + [len(t.faces) for t in topologies] + of_planes, dtype=np.int64),
            planes=np.arange(len(names), len(names) + len(planes), dtype=np.uint32),
            topology_versions=tuple(t.version for t in topologies) + tuple(of_planes),
        )
