# SPDX-License-Identifier: Apache-2.0
"""Slow oracles that the core is compared with: exact elementary tests and brute force over all pairs.

All decisions use integers of any size on the coordinates as given, without code of the core. Contacts are defined as in
Kim et al. 2009, section 3.1: vertices move on straight lines, features are closed, touching counts, `toc` is the
earliest time in [0,1]. Distances are Euclidean, `<=` throughout.
"""

try:
    import _oracle  # noqa: F401
except ModuleNotFoundError as error:
    raise ImportError(
        "oracle: _oracle is not on Python's path; run `make oracle`, and add build/oracle to PYTHONPATH"
    ) from error

from .elementary import (
    distance_edge_edge,
    distance_vertex_face,
    edge_edge,
    edge_face_intersect,
    separation_edge_edge,
    separation_vertex_face,
    squared_distance_edge_edge,
    squared_distance_vertex_face,
    vertex_face,
    within_edge_edge,
    within_vertex_face,
)
from .scenes import (
    Contacts,
    Gap,
    Proximity,
    brute_force,
    earliest_contacts,
    intersections,
    proximity,
    smallest_distances,
)
from .solids import closed, contained, convex_depths, edge_face_points, separating_translations, winding_numbers

__all__ = [
    "Contacts",
    "Gap",
    "Proximity",
    "brute_force",
    "closed",
    "contained",
    "convex_depths",
    "distance_edge_edge",
    "distance_vertex_face",
    "earliest_contacts",
    "edge_edge",
    "edge_face_intersect",
    "edge_face_points",
    "intersections",
    "proximity",
    "separating_translations",
    "separation_edge_edge",
    "separation_vertex_face",
    "smallest_distances",
    "squared_distance_edge_edge",
    "squared_distance_vertex_face",
    "vertex_face",
    "winding_numbers",
    "within_edge_edge",
    "within_vertex_face",
]
