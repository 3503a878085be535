# SPDX-License-Identifier: Apache-2.0
"""Sides, normals and distances of one query in rational numbers: slow, and sure of each sign.

A query is (8,3): v f0 f1 f2 or a0 a1 b0 b1 at t=0, then the same at t=1.
"""

from fractions import Fraction

import numpy as np
from fuzz.generators import VERTEX_FACE


def _rational(query):
    return [[Fraction(float(x)) for x in row] for row in query]


def _add(x, y):
    n = max(len(x), len(y))
    return [(x[i] if i < len(x) else 0) + (y[i] if i < len(y) else 0) for i in range(n)]


def _times(x, y):
    z = [Fraction(0)] * (len(x) + len(y) - 1)
    for i, xi in enumerate(x):
        for j, yj in enumerate(y):
            z[i + j] += xi * yj
    return z


def _minus(x, y):
    return _add(x, [-c for c in y])


def _cross(u, v):
    return [_minus(_times(u[(k + 1) % 3], v[(k + 2) % 3]), _times(u[(k + 2) % 3], v[(k + 1) % 3])) for k in range(3)]


def _spanned(kind, query):
    """The vectors p, a, b of the core's motion.h: for each coordinate its coefficients in t."""
    q = _rational(query)
    moving = [[[q[i][k], q[i + 4][k] - q[i][k]] for k in range(3)] for i in range(4)]
    ends = ((1, 0), (1, 2), (1, 3)) if kind == VERTEX_FACE else ((0, 2), (0, 1), (2, 3))
    return [[_minus(moving[to][k], moving[start][k]) for k in range(3)] for start, to in ends]


def _trimmed(f):
    f = list(f)
    while f and f[-1] == 0:
        f.pop()
    return f


def _value(f, t):
    value = Fraction(0)
    for c in reversed(f):
        value = value * t + c
    return value


def _sturm_chain(f):
    chain = [f, _trimmed([i * c for i, c in enumerate(f)][1:])]
    while chain[-1]:
        rest, by = list(chain[-2]), chain[-1]
        while len(rest) >= len(by):
            factor, shift = rest[-1] / by[-1], len(rest) - len(by)
            rest = [c - (factor * by[i - shift] if i >= shift else 0) for i, c in enumerate(rest)][:-1]
        chain.append(_trimmed([-c for c in rest]))
    return chain[:-1]


def _variations(chain, t):
    signs = [v > 0 for v in (_value(f, t) for f in chain) if v != 0]
    return sum(x != y for x, y in zip(signs, signs[1:], strict=False))


def _coplanarity(kind, query):
    p, a, b = _spanned(kind, query)
    n = _cross(a, b)
    return _trimmed(_add(_add(_times(p[0], n[0]), _times(p[1], n[1])), _times(p[2], n[2])))


def side_at_start(kind, query):
    """The sign of p . (a x b) at t=0."""
    f = _value(_coplanarity(kind, query), 0)
    return (f > 0) - (f < 0)


def side(kind, query, toc):
    """The sign of p . (a x b) just before its root at toc: 0 where it is zero throughout, None where there are two
    roots within 4e-12 of toc."""
    f = _coplanarity(kind, query)
    if not f:
        return 0
    chain = _sturm_chain(f)

    def roots(low, high):
        return _variations(chain, low) - _variations(chain, high)

    toc = Fraction(float(toc))
    for radius in (Fraction(1, 10**9), Fraction(1, 10**11), Fraction(4, 10**12)):
        low, high = toc - radius, toc + radius
        number = roots(low, high)
        assert number > 0, "a contact where the features are not coplanar"
        if number == 1:
            break
    else:
        return None
    while (before := _value(f, low)) == 0 or roots(low, high) == 0:
        low = (low + high) / 2  # low itself is a root, an earlier one
    return 1 if before > 0 else -1


def _direction(vector, t):
    values = [_value(x, t) for x in vector]
    largest = max(map(abs, values)) or 1
    direction = np.array([float(x / largest) for x in values])
    return direction / (np.linalg.norm(direction) or 1)


def normal_before_contact(kind, query, toc):
    """a x b, of length one, to the side of p just before the contact, of which toc is the time rounded down: the motion
    may change it within that rounding. None where p . (a x b) has none or several roots there, or a double one."""
    f, (_, a, b) = _coplanarity(kind, query), _spanned(kind, query)
    n, chain = _cross(a, b), _sturm_chain(f)
    low, high = Fraction(float(toc)) - Fraction(1, 2**60), Fraction(float(toc)) + Fraction(1, 2**52)
    rising = _value(f, high) > 0
    if _variations(chain, low) - _variations(chain, high) != 1 or rising == (_value(f, low) > 0):
        return None
    while np.abs(_direction(n, low) - _direction(n, high)).max() > 1e-9:
        for _ in range(32):
            middle = (low + high) / 2
            low, high = (low, middle) if (_value(f, middle) > 0) == rising else (middle, high)
    return -_direction(n, low) if rising else _direction(n, low)


def normal(kind, query, toc):
    """a x b at toc in floating point, of length one, and its size relative to the largest of a and b in the step."""
    _, a, b = _spanned(kind, query)
    n, t = _cross(a, b), Fraction(float(toc))
    largest = max(abs(_value(x, t)) for x in n)
    sizes = [max(abs(_value(x, t)) for x in v for t in (0, 1)) for v in (a, b)]
    return _direction(n, t), float(largest / (sizes[0] * sizes[1])) if largest else 0.0


def _dot(u, v):
    return sum(x * y for x, y in zip(u, v, strict=True))


def _difference(u, v):
    return [x - y for x, y in zip(u, v, strict=True)]


def _from_segment(x, start, end):
    """The vector to x from the nearest point of a segment."""
    along, there = _difference(end, start), _difference(x, start)
    length = _dot(along, along)
    place = min(max(_dot(there, along) / length, 0), 1) if length else 0
    return [c - place * d for c, d in zip(there, along, strict=True)]


def _from_triangle(x, corners):
    border = min((_from_segment(x, corners[i - 1], corners[i]) for i in range(3)), key=lambda v: _dot(v, v))
    p, a, b = ([c - o for o, c in zip(corners[0], y, strict=True)] for y in (x, corners[1], corners[2]))
    aa, ab, bb, pa, pb = _dot(a, a), _dot(a, b), _dot(b, b), _dot(p, a), _dot(p, b)
    area = aa * bb - ab * ab
    alpha, beta = bb * pa - ab * pb, aa * pb - ab * pa
    if area == 0 or min(alpha, beta, area - alpha - beta) < 0:
        return border
    return _difference(p, [(alpha * c + beta * d) / area for c, d in zip(a, b, strict=True)])


def squared_distance_to_segment(x, start, end):
    rest = _from_segment(x, start, end)
    return _dot(rest, rest)


def squared_distance_to_triangle(x, corners):
    rest = _from_triangle(x, corners)
    return _dot(rest, rest)


def positions(query, t):
    """Positions of the four points at time t, in rationals."""
    q, t = _rational(query), Fraction(t)
    return [[(1 - t) * c + t * d for c, d in zip(q[i], q[i + 4], strict=True)] for i in range(4)]


def gap(kind, now):
    """The vector from face to vertex or from edge a to edge b between their nearest points; now: from positions()."""
    if kind == VERTEX_FACE:
        return _from_triangle(now[0], now[1:])
    a0, a1, b0, b1 = now
    p, a, b = _difference(b0, a0), _difference(a1, a0), _difference(b1, b0)
    aa, ab, bb, pa, pb = _dot(a, a), _dot(a, b), _dot(b, b), _dot(p, a), _dot(p, b)
    area = aa * bb - ab * ab
    on_a, on_b = bb * pa - ab * pb, ab * pa - aa * pb
    if area and 0 <= on_a <= area and 0 <= on_b <= area:
        return [c - (on_a * x - on_b * y) / area for c, x, y in zip(p, a, b, strict=True)]
    ends = [_from_segment(x, a0, a1) for x in (b0, b1)]
    ends += [[-c for c in _from_segment(x, b0, b1)] for x in (a0, a1)]
    return min(ends, key=lambda v: _dot(v, v))


def unit(vector):
    largest = max(map(abs, vector))
    direction = np.array([float(x / largest) for x in vector])
    return direction / np.linalg.norm(direction)


def direction_of_gap(kind, query, d, toc, touching):
    """The direction of the gap when it is first as short as d: at toc, or later by rounding. At `touching` they are
    within d."""

    def within(t):
        between = gap(kind, positions(query, t))
        return _dot(between, between) <= Fraction(d) ** 2

    low = max(Fraction(toc) - Fraction(1, 10**14), Fraction(0))
    width = Fraction(1, 10**12)
    while not within(high := min(low + width, Fraction(touching))):
        assert high < touching, "never within d"
        width *= 2
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (low, middle) if within(middle) else (middle, high)
    return unit(gap(kind, positions(query, low)))


def _moving_size(points):
    return max(max(abs(x - y) for x, y in zip(p, q, strict=True)) for p in points for q in points)


def excess(kind, query, toc, point):
    """By how much the point misses each of the features at toc beyond 1e-9 of its size, as multiples of what roundings
    of coordinates (2^-50) and of toc (2e-12 of the motion) allow: at most 1 where it lies on both."""
    q, t, x = _rational(query), Fraction(float(toc)), [Fraction(float(c)) for c in point]
    now = [[(1 - t) * c + t * d for c, d in zip(q[i], q[i + 4], strict=True)] for i in range(4)]
    coordinates = max(abs(c) for row in q for c in row)
    motion = max(abs(c - d) for i in range(4) for c, d in zip(q[i], q[i + 4], strict=True))
    allowed = Fraction(2) ** -50 * coordinates + Fraction(2, 10**12) * motion + Fraction(2) ** -1070
    if kind == VERTEX_FACE:
        features = [([now[0]], squared_distance_to_segment(x, now[0], now[0]))]
        features.append((now[1:], squared_distance_to_triangle(x, now[1:])))
    else:
        features = [(ends, squared_distance_to_segment(x, *ends)) for ends in (now[:2], now[2:])]
    squares = [d / (allowed + _moving_size(corners) / 10**9) ** 2 for corners, d in features]
    return float(max(squares)) ** 0.5
