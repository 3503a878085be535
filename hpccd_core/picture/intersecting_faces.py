# SPDX-License-Identifier: Apache-2.0
"""Which faces to draw in a colour of their own, as without it a body that pokes through a cloth looks like flecks."""

import numpy as np

import hpccd_core as hc


def marked(hits: hc.Intersections, faces: np.ndarray, n_vertices: int, within: bool = False) -> np.ndarray:
    """(F,) bool: faces of the scene that an edge of another mesh intersects, or whose edge intersects one.

    faces: (F, 3) scene-wide vertices. within: whether intersections within a mesh count too.
    """
    counted = np.ones(len(hits), bool) if within else np.asarray(hits.mesh_a) != np.asarray(hits.mesh_b)
    found = hits.ef[counted]
    faces = faces.astype(np.int64)
    meets = np.zeros(len(faces), bool)
    meets[found[:, 2]] = True
    crossing = np.unique(_keys(found[:, :2], n_vertices))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        meets |= np.isin(_keys(faces[:, [a, b]], n_vertices), crossing)
    return meets


def _keys(edges: np.ndarray, n_vertices: int) -> np.ndarray:
    """(N,) one number for each edge (N,2), whichever of its ends is first."""
    edges = edges.astype(np.int64)
    return edges.min(axis=1) * n_vertices + edges.max(axis=1)
