# SPDX-License-Identifier: Apache-2.0
"""Where an edge and a face meet, in rational arithmetic. Shares no method with the core: the core clips the edge by
signs of volumes and areas, this solves linear systems and tries candidates."""

import itertools
from fractions import Fraction


def _vector(a, b):
    return tuple(y - x for x, y in zip(a, b, strict=True))


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def _at(a, b, s):
    return tuple(x + s * (y - x) for x, y in zip(a, b, strict=True))


def rational(points):
    return [tuple(map(Fraction, map(float, p))) for p in points]


def on_segment(p, a, b):
    """The position of p between a and b, or None."""
    along, to = _vector(a, b), _vector(a, p)
    length = _dot(along, along)
    s = _dot(along, to) / length if length else Fraction(0)
    return s if 0 <= s <= 1 and _at(a, b, s) == p else None


def weights_on_face(p, face):
    """Barycentric coordinates of p, or None if it is not on the closed face."""
    u, v, w = _vector(face[0], face[1]), _vector(face[0], face[2]), _vector(face[0], p)
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    det = uu * vv - uv * uv
    if det:
        b, c = (vv * uw - uv * vw) / det, (uu * vw - uv * uw) / det
        found = (1 - b - c, b, c)
        exact = all(sum(x * k for x, k in zip(found, xs, strict=True)) == px for *xs, px in zip(*face, p, strict=True))
        return found if exact and min(found) >= 0 else None
    for i, j in itertools.combinations(range(3), 2):
        s = on_segment(p, face[i], face[j])
        if s is not None:
            found = [Fraction(0)] * 3
            found[i], found[j] = found[i] + 1 - s, found[j] + s
            return tuple(found)
    return None


def _solutions(p, r, a, b):
    """Positions on the line p r of its nearest points to the line a b, and of their projections."""
    d, e, w = _vector(p, r), _vector(a, b), _vector(p, a)
    dd, de, ee, dw, ew = _dot(d, d), _dot(d, e), _dot(e, e), _dot(d, w), _dot(e, w)
    if dd:
        yield dw / dd
        yield (dw + de) / dd
    if det := dd * ee - de * de:
        yield (dw * ee - de * ew) / det


def place(edge, face):
    """The position on the edge where it first meets the face, and the weights there; None if it does not."""
    p, r = edge
    candidates = {Fraction(0), Fraction(1)}
    u, v = _vector(face[0], face[1]), _vector(face[0], face[2])
    n = [u[i] * v[j] - u[j] * v[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    steep = _dot(n, _vector(p, r))
    if steep:
        candidates.add(_dot(n, _vector(p, face[0])) / steep)
    for i, j in itertools.combinations(range(3), 2):
        candidates.update(_solutions(p, r, face[i], face[j]))
    for s in sorted(candidates):
        if 0 <= s <= 1 and (weights := weights_on_face(_at(p, r, s), face)) is not None:
            return s, weights
    return None
