# SPDX-License-Identifier: Apache-2.0
"""When a moving point comes within a distance of a moving point or segment, by integers alone.

A point is within d of a segment at a time if it is within d of an end, or of the line at a foot inside. Not within at
the start, it is so first at a root of |P-A|^2 - d^2, of |P-B|^2 - d^2, or of |(P-A) x (B-A)|^2 - d^2 |B-A|^2 where the
foot lies inside. Roots are isolated by Sturm's theorem. Polynomials are lists of integers, constant first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

Polynomial = list[int]
BITS = 70  # of a time


def primitive(p: Polynomial) -> Polynomial:
    """A positive multiple without a common divisor."""
    while p and p[-1] == 0:
        p = p[:-1]
    divisor = math.gcd(*p)
    return [c // divisor for c in p] if divisor > 1 else p


def divided(a: Polynomial, b: Polynomial) -> tuple[Polynomial, Polynomial]:
    """Quotient and remainder, each times a positive number."""
    sign, size = (1, b[-1]) if b[-1] > 0 else (-1, -b[-1])
    quotient = [0] * max(len(a) - len(b) + 1, 0)
    while len(a) >= len(b):
        at, lead = len(a) - len(b), sign * a[-1]
        quotient = [size * c for c in quotient]
        quotient[at] = lead
        a = [size * c for c in a]
        for i, c in enumerate(b):
            a[at + i] -= lead * c
        a = a[:-1]
    return primitive(quotient), primitive(a)


class Roots:
    """Distinct real roots of a polynomial that is not zero, by its Sturm chain."""

    def __init__(self, p: Polynomial) -> None:
        chain = [primitive(p), primitive([i * c for i, c in enumerate(p)][1:])]
        while chain[-1]:
            chain.append([-c for c in divided(chain[-2], chain[-1])[1]])
        chain.pop()
        self.chain = [divided(q, chain[-1])[0] for q in chain]  # of the polynomial with simple roots

    def changes(self, at: Fraction) -> int:
        signs = [s for s in (sign_at(q, at) for q in self.chain) if s]
        return sum(s != t for s, t in zip(signs, signs[1:], strict=False))

    def count(self, low: Fraction, high: Fraction) -> int:
        """In (low, high]."""
        return self.changes(low) - self.changes(high)

    def isolated(self) -> list[tuple[Fraction, Fraction]]:
        """Intervals (low, high] with one root each, of all roots in (0, 1], ascending."""
        found, parts = [], [(Fraction(0), Fraction(1))]
        while parts:
            low, high = parts.pop()
            n = self.count(low, high)
            if n == 1:
                found.append((low, high))
            elif n > 1:
                parts += [((low + high) / 2, high), (low, (low + high) / 2)]
        return found

    def halved(self, low: Fraction, high: Fraction) -> tuple[Fraction, Fraction]:
        middle = (low + high) / 2
        return (low, middle) if self.count(low, middle) else (middle, high)

    def time(self, low: Fraction, high: Fraction) -> Fraction:
        while high - low > Fraction(1, 1 << BITS):
            low, high = self.halved(low, high)
        return high


def sign_at(p: Polynomial, at: Fraction) -> int:
    value, power = 0, 1
    for c in reversed(p):
        value = value * at.numerator + c * power
        power *= at.denominator
    return (value > 0) - (value < 0)


def plus(a: Polynomial, b: Polynomial, factor: int = 1) -> Polynomial:
    n = max(len(a), len(b))
    padded = [x + [0] * (n - len(x)) for x in (a, b)]
    return [x + factor * y for x, y in zip(*padded, strict=True)]


def times(a: Polynomial, b: Polynomial) -> Polynomial:
    product = [0] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            product[i + j] += x * y
    return product


def dot(u: Sequence[Polynomial], v: Sequence[Polynomial]) -> Polynomial:
    total: Polynomial = [0, 0, 0]
    for a, b in zip(u, v, strict=True):
        total = plus(total, times(a, b))
    return total


def minus(u: Sequence[Polynomial], v: Sequence[Polynomial]) -> list[Polynomial]:
    return [plus(a, b, -1) for a, b in zip(u, v, strict=True)]


def first_root(p: Polynomial) -> Fraction | None:
    """In (0, 1]."""
    if not any(p):
        return None
    roots = Roots(p)
    intervals = roots.isolated()
    return roots.time(*intervals[0]) if intervals else None


def certainly_positive(p: Polynomial, roots: Roots, low: Fraction, high: Fraction) -> bool:
    """At the only root in (low, high]."""
    if not any(p):
        return False
    own = Roots(p)
    a, b = roots.chain[0], own.chain[0]
    while b:
        a, b = b, divided(a, b)[1]
    if len(a) > 1 and Roots(a).count(low, high):
        return False  # zero
    while own.count(low, high):
        low, high = roots.halved(low, high)
    return sign_at(p, high) > 0


def first_within(start: Sequence, end: Sequence, distance: float) -> Fraction | None:
    """The first time in [0, 1], rounded up by less than 2^-70, at which a point is within a distance of another, or of
    a segment; None if never.

    start, end: the point, and the other point or both ends of the segment; three doubles each.
    """
    exact = [[Fraction(float(c)) for p in points for c in p] for points in (start, end)]
    unit = math.lcm(Fraction(float(distance)).denominator, *(c.denominator for points in exact for c in points))
    d2 = int(Fraction(float(distance)) * unit) ** 2
    line = [[int(a * unit), int((b - a) * unit)] for a, b in zip(*exact, strict=True)]
    point, *others = (line[i : i + 3] for i in range(0, len(line), 3))
    ways = [minus(point, other) for other in others]
    excess = [plus(dot(way, way), [d2], -1) for way in ways]
    if any(p[0] <= 0 for p in excess):
        return Fraction(0)
    found = [first_root(p) for p in excess]
    if len(others) == 2:
        edge = minus(others[1], others[0])
        before, length = dot(ways[0], edge), dot(edge, edge)
        after = plus(length, before, -1)
        off = plus(plus(times(dot(ways[0], ways[0]), length), times(before, before), -1), times([d2], length), -1)
        if off[0] <= 0 and before[0] > 0 and after[0] > 0:
            return Fraction(0)
        if any(off):
            roots = Roots(off)
            for interval in roots.isolated():
                if all(certainly_positive(p, roots, *interval) for p in (before, after)):
                    found.append(roots.time(*interval))
                    break
    return min((t for t in found if t is not None), default=None)
