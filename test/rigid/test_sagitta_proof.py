# SPDX-License-Identifier: Apache-2.0
"""The two claims of hpccd_core/rigid/screw.py about arc and chord, in rational intervals and in 40 digits."""

from decimal import Decimal, localcontext
from fractions import Fraction
from math import factorial

HALF_PI = Fraction(15708, 10000)  # a little more
TERMS = 16


class Interval:
    def __init__(self, low, high=None):
        self.low, self.high = Fraction(low), Fraction(low if high is None else high)

    def __add__(self, other):
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other):
        return Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other):
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        return Interval(min(ends), max(ends))


def series(x, coefficients):
    """Sum of coefficients times powers of the interval x >= 0, and what is left out: less than the last term."""
    last = abs(coefficients[-1]) * x.high ** (len(coefficients) - 1)
    total = Interval(0)
    for c in reversed(coefficients[:-1]):
        total = total * x + Interval(c)
    return total + Interval(-last, last)


# In x = u**2: sin(u) / u, its derivative over u, cos(u).
SINC = [Fraction((-1) ** k, factorial(2 * k + 1)) for k in range(TERMS)]
SLOPE = [Fraction((-1) ** k * 2 * k, factorial(2 * k + 1)) for k in range(1, TERMS)]
COS = [Fraction((-1) ** k, factorial(2 * k)) for k in range(TERMS)]


def test_k_rises_in_rational_intervals():
    """k'(u) / u = (sinc'(u) / u) (C - s) + s sinc(u) > 0 for all 0 <= u, h <= pi/2; and k(h) = 0 by itself."""
    n = 24
    squares = [(HALF_PI * i / n) ** 2 for i in range(n + 1)]
    boxes = [Interval(a, b) for a, b in zip(squares, squares[1:], strict=False)]
    least = None
    for h in boxes:
        s, c = series(h, SINC), series(h, COS)
        for u in boxes:
            slope = series(u, SLOPE) * (c - s) + s * series(u, SINC)
            assert slope.low > 0
            least = slope.low if least is None else min(least, slope.low)
    assert least > Fraction(1, 4)


def test_arc_and_chord_are_farthest_apart_in_the_middle():
    """f(u) <= f(0) = (1 - cos h)**2 for 0 <= u <= h, up to h = pi."""
    with localcontext() as context:
        context.prec = 60
        pi = Decimal("3.14159265358979323846264338327950288419716939937510582")
        for h in [pi * i / 40 for i in range(1, 41)] + [Decimal(10) ** -k for k in range(1, 13)]:
            c, s = cos(h), sin(h) / h
            for u in [h * i / 50 for i in range(51)] + [h * Decimal("1e-9"), h * (1 - Decimal("1e-9"))]:
                f = (cos(u) - c) ** 2 + (sin(u) - s * u) ** 2
                assert f <= (1 - c) ** 2 + Decimal("1e-57")


def sin(x):
    return sum((-1) ** k * x ** (2 * k + 1) / factorial(2 * k + 1) for k in range(40))


def cos(x):
    return 1 + sum((-1) ** k * x ** (2 * k) / factorial(2 * k) for k in range(1, 40))
