# SPDX-License-Identifier: Apache-2.0
"""Smallest distances between an arm, a cloth and a table, as those of all pairs of features one by one."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros import scenes


def to_triangles(points, corners):
    """Smallest distance of (n,3) points from (m,3,3) triangles, where the foot lies inside; else infinite."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    uu, uv, vv = (np.einsum("mi,mi->m", p, q) for p, q in ((u, u), (u, v), (v, v)))
    normal = np.cross(u, v)
    size = np.linalg.norm(normal, axis=1)
    way = points[:, None] - a
    wu, wv = np.einsum("nmi,mi->nm", way, u), np.einsum("nmi,mi->nm", way, v)
    area = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    height = np.abs(np.einsum("nmi,mi->nm", way, normal)) / size
    return np.where(inside, height, np.inf).min()


def between_edges(p, q):
    """Smallest distance of segments (n,2,3) from (m,2,3)."""
    a, d = p[:, None, 0], (p[:, 1] - p[:, 0])[:, None]
    b, e = q[None, :, 0], (q[:, 1] - q[:, 0])[None]
    way = a - b
    dd, ee, de = (d * d).sum(-1), (e * e).sum(-1), (d * e).sum(-1)
    dw, ew = (d * way).sum(-1), (e * way).sum(-1)
    area = dd * ee - de * de
    flat = area < 1e-12 * dd * ee  # parallel: one of the ends is as near
    s = np.clip((de * ew - ee * dw) / np.where(flat, 1.0, area), 0, 1)
    s = np.where(flat, 0.0, s)
    t = np.clip((de * s + ew) / ee, 0, 1)
    s = np.clip((de * t - dw) / dd, 0, 1)
    return np.sqrt((((a + s[..., None] * d) - (b + t[..., None] * e)) ** 2).sum(-1).min())


def edges(faces):
    return np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)


def in_blocks(distance, rows, others, size=200):
    return min(distance(rows[k : k + size], others) for k in range(0, len(rows), size))


def brute_force(mesh_a, a, mesh_b, b):
    """Distance of two meshes that do not intersect."""
    return min(
        in_blocks(to_triangles, a, b[mesh_b.faces]),
        in_blocks(to_triangles, b, a[mesh_a.faces]),
        in_blocks(between_edges, a[edges(mesh_a.faces)], b[edges(mesh_b.faces)]),
    )


@pytest.mark.parametrize("index", [0, 110, 360, *(pytest.param(index, marks=pytest.mark.long) for index in (60, 240))])
def test_all_pairs(index):
    """From far above the table, through the grip, to the end; where meshes intersect the distance is 0."""
    scene = scenes.make("arm-and-cloth", size=1 / 16)
    frame = scene.frame(index)
    detector = hc.Detector(scenes.core_scene(scene), threads=2)
    gaps = detector.distances(frame.stacked())
    names, checked = scene.mesh_names, 0
    assert len(gaps) > 40
    for gap in gaps:
        i, j = names.index(gap.mesh_a), names.index(gap.mesh_b)
        if i == j or gap.distance == 0:
            continue
        a, b = (np.asarray(frame[k], np.float64) for k in (i, j))
        assert gap.distance == pytest.approx(brute_force(scene.meshes[i], a, scene.meshes[j], b), rel=1e-9, abs=1e-12)
        checked += 1
    assert checked > 40
