# SPDX-License-Identifier: Apache-2.0
"""Whether two features on their true paths come within a distance: proven, either way, by branch and bound over time.

Consider an interval of time of half width w around m. An upper bound of the smallest distance is the distance of two
points at m. For a lower bound, take any direction n: n.(a - b) of vertices a and b stays above its value at m, minus
its rate times w, minus (A_a + A_b) w**2 / 2, where A bounds accelerations; the minimum over all pairs of vertices
bounds the distance of the features from below. n is the direction of the nearest points at m: its rate vanishes at the
smallest distance, so few intervals are needed even if the distance is close to the requested one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.rigid_paths import Paths

WITHIN, BEYOND, OPEN = 1, -1, 0
_LEVELS = 44
_MOST = 4096  # intervals of one query at a time: one that needs more is left open


@dataclass(frozen=True, eq=False)
class Pairs:
    """Queries of one kind of features: a vertex of ``a`` and a face of ``b``, or an edge of each."""

    a: Paths
    b: Paths
    kind: str

    def near(self, rows: np.ndarray, t: np.ndarray, precision: type = np.float64):
        """Distance of two points of both sides, almost the nearest ones; the direction from b to a; a's and b's
        positions and velocities."""
        (xa, va), (xb, vb) = self.a.at(rows, t, precision), self.b.at(rows, t, precision)
        apart = _vertex_face(xa, xb) if self.kind == "vf" else _edge_edge(xa, xb)
        distance = np.sqrt((apart * apart).sum(axis=1))
        direction = apart / np.where(distance == 0, precision(1), distance)[:, None]
        return distance, direction, xa, va, xb, vb

    def size(self) -> np.ndarray:
        return self.a.size() + self.b.size()


def comes_within(pairs: Pairs, distance: np.ndarray, until: np.ndarray | None = None, rows: np.ndarray | None = None):
    """(N,) of WITHIN, BEYOND, OPEN: whether the features of these queries (all by default) come within the distance at
    a time in [0, until]. In double precision first; open ones with 64 bits."""
    rows = np.arange(len(distance)) if rows is None else rows
    found = _decided(pairs, rows, distance, until, np.float64)
    if (still := found == OPEN).any() and np.finfo(np.longdouble).eps < 1e-18:
        found[still] = _decided(
            pairs, rows[still], distance[still], None if until is None else until[still], np.longdouble
        )
    return found


def _decided(pairs, rows, distance, until, precision):
    n = len(rows)
    found = np.zeros(n, int)
    if not n:
        return found
    eps = 64 * np.finfo(precision).eps * pairs.size()[rows].astype(precision)
    distance = distance.astype(precision)
    bend = (pairs.a.acceleration() + pairs.b.acceleration())[rows]
    until = np.ones(n) if until is None else until
    first = 8
    which = np.repeat(np.arange(n), first)
    half = np.repeat(until / (2 * first), first)
    middle = (2 * np.tile(np.arange(first), n) + 1) * half
    for _ in range(_LEVELS):
        if not len(which):
            break
        upper, lower = _bounds(pairs, rows, which, middle, half, bend, precision)
        hit = upper <= (distance - eps)[which]
        found[which[hit]] = WITHIN
        keep = (lower <= (distance + eps)[which]) & (found[which] == 0)
        which, middle, half = which[keep], middle[keep], half[keep]
        many = np.bincount(which, minlength=n) > _MOST
        keep = ~many[which]
        found[many] = 9  # given up
        which, middle, half = which[keep], middle[keep], half[keep]
        which, half = np.repeat(which, 2), np.repeat(half / 2, 2)
        middle = np.repeat(middle, 2) + np.where(np.arange(len(half)) % 2, half, -half)
    alive = np.zeros(n, bool)
    alive[which] = True
    found[(found == 0) & ~alive] = BEYOND
    found[found == 9] = OPEN
    return found


def _bounds(pairs, rows, which, middle, half, bend, precision):
    upper, lower = np.empty(len(which), precision), np.empty(len(which), precision)
    for begin in range(0, len(which), 65536):
        part = slice(begin, begin + 65536)
        d, n, xa, va, xb, vb = pairs.near(rows[which[part]], middle[part], precision)
        gaps = np.einsum("Nk,Nijk->Nij", n, xa[:, :, None] - xb[:, None])
        rates = np.einsum("Nk,Nijk->Nij", n, va[:, :, None] - vb[:, None])
        w = half[part] * (1 + 1e-9)  # neighbours overlap
        least = (gaps - np.abs(rates) * w[:, None, None]).min(axis=(1, 2)) - bend[which[part]] * w * w * (0.5 + 1e-9)
        upper[part], lower[part] = d, least
    return upper, lower


def _vertex_face(a, b):
    """From the nearest point of the triangles b (N,3,3) to the points a (N,1,3)."""
    p = a[:, 0]
    best = p - b[:, 0]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        best = _shorter(best, p - _on_segment(p, b[:, i], b[:, j]))
    u, v, r = b[:, 1] - b[:, 0], b[:, 2] - b[:, 0], p - b[:, 0]
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    ru, rv = (r * u).sum(1), (r * v).sum(1)
    area = uu * vv - uv * uv
    safe = np.where(area > 0, area, 1)
    s, t = (vv * ru - uv * rv) / safe, (uu * rv - uv * ru) / safe
    inside = (area > 0) & (s >= 0) & (t >= 0) & (s + t <= 1)
    flat = p - (b[:, 0] + s[:, None] * u + t[:, None] * v)
    return np.where(inside[:, None], _shorter(best, flat), best)


def _edge_edge(a, b):
    best = a[:, 0] - _on_segment(a[:, 0], b[:, 0], b[:, 1])
    best = _shorter(best, a[:, 1] - _on_segment(a[:, 1], b[:, 0], b[:, 1]))
    for k in (0, 1):
        best = _shorter(best, _on_segment(b[:, k], a[:, 0], a[:, 1]) - b[:, k])
    u, v, r = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0], a[:, 0] - b[:, 0]
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    ru, rv = (r * u).sum(1), (r * v).sum(1)
    area = uu * vv - uv * uv
    safe = np.where(area > 0, area, 1)
    s, t = (uv * rv - vv * ru) / safe, (uu * rv - uv * ru) / safe
    inside = (area > 0) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    crossing = r + s[:, None] * u - t[:, None] * v
    return np.where(inside[:, None], _shorter(best, crossing), best)


def _on_segment(p, a, b):
    u = b - a
    uu = (u * u).sum(1)
    s = np.clip(((p - a) * u).sum(1) / np.where(uu > 0, uu, 1), 0, 1)
    return a + s[:, None] * u


def _shorter(a, b):
    return np.where(((a * a).sum(1) <= (b * b).sum(1))[:, None], a, b)
