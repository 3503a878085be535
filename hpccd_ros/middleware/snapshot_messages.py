# SPDX-License-Identifier: Apache-2.0
"""Results of the core for one snapshot as messages: near pairs and intersections as ContactArray, smallest distances as
DistanceArray."""

import math

import numpy as np
from hpccd.msg import ContactArray, DistanceArray

import hpccd_core as hc
from hpccd_ros.detect import approach
from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware.contact_messages import (
    TIMED,
    FeaturePairs,
    fill_names,
    fill_outputs,
    fill_pairs,
    lowest,
    outputs_of,
)
from hpccd_ros.middleware.fields import to_field

KINDS = {
    "vertex-face": DistanceArray.VERTEX_FACE,
    "edge-edge": DistanceArray.EDGE_EDGE,
    "edge-face": DistanceArray.EDGE_FACE,
    "vertex-plane": DistanceArray.VERTEX_PLANE,
    "vertex-vertex": DistanceArray.VERTEX_VERTEX,
    "vertex-edge": DistanceArray.VERTEX_EDGE,
}


def fill_proximity(
    message: ContactArray, near: hc.Proximity, layout: Layout, *, max_contacts: int, outputs: tuple[str, ...]
) -> None:
    """Write all but header, start, step, accuracy and backend. max_contacts: 0: all; else this many of the nearest, in
    canonical order. outputs: which outputs to send, where the core has computed them."""
    pairs = FeaturePairs.of_result(near)
    distance = np.concatenate([getattr(near, f"{kind}_distance") for kind in TIMED])
    keep = lowest(distance, max_contacts) if 0 < max_contacts < len(pairs) else None
    _fill(message, pairs, layout, near.hash, keep)
    message.distance = to_field(distance if keep is None else distance[keep])
    sent = outputs_of(near, outputs, len(pairs))
    fill_outputs(message, sent if keep is None else {name: rows[keep] for name, rows in sent.items()}, layout)


def fill_intersections(message: ContactArray, hits: hc.Intersections, layout: Layout, *, max_contacts: int) -> None:
    """As `fill_proximity`; max_contacts: 0: all; else the first ones."""
    keep = np.arange(max_contacts) if 0 < max_contacts < len(hits.ef) else None
    _fill(message, FeaturePairs.of(ef=hits.ef), layout, hits.hash, keep)


def _fill(message, pairs, layout, found_hash, keep) -> None:
    fill_pairs(message, pairs if keep is None else pairs.keep(keep), layout)
    fill_names(message, layout)
    message.first_toc = math.inf
    message.total, message.truncated, message.hash = len(pairs), keep is not None, int(found_hash)


def fill_distances(
    message: DistanceArray,
    gaps: list[hc.Gap],
    layout: Layout,
    *,
    before: list[hc.Gap] | None = None,
    approached: np.ndarray | None = None,
    seconds: float = 0.0,
) -> None:
    """Write all but header, step, accuracy and backend. before: those of ``seconds`` earlier, if known;
    approached: as `approach.approached` returns it."""
    count = len(gaps)
    kind, meshes = np.empty(count, np.uint8), np.empty((count, 2), np.uint32)
    inside = np.empty(count, np.uint8)
    features, points = np.full((count, 2, 2), DistanceArray.NONE, np.uint32), np.zeros((count, 2, 3))
    for row, gap in enumerate(gaps):
        inside[row] = DistanceArray.INSIDE_NONE
        if not gap.kind:
            kind[row] = DistanceArray.NO_PAIR
            meshes[row] = layout.mesh_names.index(gap.mesh_a), layout.mesh_names.index(gap.mesh_b)
            continue
        kind[row], points[row] = KINDS[gap.kind], gap.points
        for side, (indices, offsets) in enumerate(_sides(gap, layout)):
            meshes[row, side] = mesh = int(np.searchsorted(offsets, indices[0], side="right")) - 1
            features[row, side, : len(indices)] = [index - offsets[mesh] for index in indices]
        if gap.kind == "vertex-plane":
            meshes[row, 1] = layout.planes[gap.features[1]]
        sides = approach.SIDES_INSIDE[gap.inside]
        swapped = layout.mesh_names[meshes[row, 0]] != gap.mesh_a
        inside[row] = approach.inside_code(sides[::-1] if swapped else sides)
    fill_names(message, layout)
    message.kind, message.distance = to_field(kind), to_field(np.array([gap.distance for gap in gaps]))
    message.mesh_a, message.mesh_b = to_field(meshes[:, 0]), to_field(meshes[:, 1])
    message.features_a, message.features_b = to_field(features[:, 0]), to_field(features[:, 1])
    message.points = to_field(points)
    message.inside = to_field(inside)
    message.direction = to_field(approach.directions(gaps))
    message.approach_speed = to_field(approach.approach_speeds(before, gaps, seconds))
    speeds = approach.closing_speeds(before, gaps, approached, seconds)
    message.time_to_contact = to_field(approach.times_to_contact(gaps, speeds))
    if (row := approach.nearest(gaps)) is not None:
        message.nearest = row


def _sides(gap: hc.Gap, layout: Layout):
    """(indices, offsets of their numbering) of the first side and the second; a plane has none."""
    width = 2 if gap.kind in ("edge-edge", "edge-face") else 1
    yield gap.features[:width], layout.vertex_offsets
    if gap.kind != "vertex-plane":
        of_faces = gap.kind in ("vertex-face", "edge-face")
        yield gap.features[width:], layout.face_offsets if of_faces else layout.vertex_offsets
