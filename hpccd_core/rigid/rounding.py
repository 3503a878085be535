# SPDX-License-Identifier: Apache-2.0
"""How far positions computed in double precision lie from those that poses, screws and joints mean: rigorous bounds.

The model: u = 2**-53; +, -, *, / and sqrt err by a relative u at most; sin, cos, atan2 of the C library by 4 u (two
units in the last place; glibc and musl state one). Terms in u**2 are a 1e-14 th of those kept, and the constants below
leave more room than that. Underflow is below `TINY`, which each bound contains. |.| is the Euclidean length; of
a matrix the spectral norm, at most the Frobenius norm.

What a pose means: x = R v + p, with R the rotation of its quaternion brought to length one exactly, v the vertex as
given (float32 becomes float64 without rounding).

`at_pose`: r >= |v|, P >= |p|.
    quaternion   normalised: sum of four squares 4 u, sqrt 4/2 + 1 u, division 1 u: each component off by a relative 5
                 u, of which at most 1 u are not common to all, that is, change the rotation rather than the length
    matrix       off the diagonal 2 (xy +- zw) with 2 (|xy| + |zw|) <= 1: off by 2 * 5 + 2 = 12 u; on it 1 - 2 (yy + zz)
                 with 2 (yy + zz) <= 2: off by 2 * (10 + 2) + 1 = 25 u; together sqrt(3 * 25**2 + 6 * 12**2) u < 53 u
    product      three products, two sums: 3 u a component, 3 sqrt(3) u r < 6 u r
    shift        one sum: u (r + P)
  The sum is 60 u r + u P; the bound says 64 u r + 4 u P.

`at_cut`: screw.py, at the fraction t = j/n of a screw; c = p_1 - p_0.
    turn d       the product q_1 q_0* has four products and three sums a component: 4 u each, 8 u together; its factors
                 are off by 5 u each; normalised 5 u more: < 24 u
    half angle h |sin h| of three squares and a root 3 u, which turn h by at most 3/2 u; atan2 4 u h < 7 u: < 9 u
    d at t       an error of d moves d(t) by no more (along the great circle it is scaled by t, across it by
                 sin(h t) / sin h <= 1): 24 u; t is off by a relative u, as is the product h t: < 4 u; h: 9 u;
                 sin, cos 4 u, axis 5 u, product 1 u: < 11 u. Together < 48 u
    q at t       the product with q_0: 8 u, q_0 itself 5 u, normalised 5 u: < 66 u as a unit quaternion
    rotation     |R(q) - R(q')| <= 2 |q - q'|: 132 u; from there as at a pose: 60 u. Together < 192 u; times r
    shift        p(t) = p_0 + t a + k_1 c' - k_2 (w x c), where w is the axis, a = (c.w) w, c' = c - a,
                 k_1 = sin(h t) cos(h (1 - t)) / sin h <= 1, k_2 = sin(h t) sin(h (1 - t)) / sin h <= tan(h / 2) / 2 <=
                 1/2. The axis is off by 24 u / sin h, but only k_1 - t and k_2 bring it in, which vanish with h:
                 k_2 / sin h <= 1 / (4 cos(h/2)**2) <= 1/2 and |k_1 - t| / sin h <= 1/4: 2 * 6 u + 12 u = 24 u;
                 h is off by 24 + 9 + 4 u, and k_1, k_2 change by at most that: the vector, of length k < 1, by < 64 u;
                 evaluation: c 1 u, a 8 u, c' 9 u, w x c 4 u, k_1 and k_2 15 u each, the sums 4 u: < 40 u. All times |c|
                 the last sum: u (P + |c|)
  The sum is 192 u r + 129 u |c| + u (r + 2 P); the bound says 256 u r + 192 u |c| + 4 u P.

`linear`: a + (b - a) (j/n): the difference u, j/n u, the product u, each times |b - a|; the sum u max(|a|, |b|).
  The bound says 4 u |b - a| + 2 u max(|a|, |b|). Nothing where the step is not cut.

`at_chain`: the product of m joints, joints.py. E >= all that reaches from the base to the farthest point of the link.
    a joint      two products of quaternions, 8 + 5 u each, the joint's own sin, cos, axis 11 u, half its angle 1 u:
                 < 48 u as a unit quaternion, 96 u as a rotation, which turns all that lies beyond: 96 u E
    its shift    the rotation's matrix 53 u, products 6 u, a sum 1 u; twice: 120 u times its offset, plus the sums
                 2 u E; offsets sum up to E at most: 120 u E for all joints together
    its value    q_0 + (q_1 - q_0) j/n: 4 u (|q_0| + |q_1 - q_0|), times E where it turns; where it slides at most 12 u
    E vertices     64 u E, as at a pose
  The sum is (110 m + 184) u E and 4 u E for each unit of |q_0| + |q_1 - q_0|; the bound says 128 m + 256.
"""

from collections.abc import Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

U = 2.0**-53
_UP = 1.0 + 2.0**-48  # more than what the sums and products of a bound itself may have lost
TINY = 1e-150  # lengths below it come from squares that underflow


Number = TypeVar("Number", float, NDArray[np.float64])


def up(bound: Number) -> Number:
    """Not below the number that a few operations on floats meant; 0 stays 0."""
    return bound * _UP


def length(vector: np.ndarray) -> float:
    """Not below the length of (3,); 0 of zeros."""
    return longest(vector[None, :]) if vector.any() else 0.0


def longest(vectors: np.ndarray) -> float:
    """Not below the greatest length of (n,3) float64; 0 of none."""
    if not len(vectors):
        return 0.0
    x, y, z = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    return up(float(np.sqrt((x * x + y * y + z * z).max()))) + TINY


def at_pose(radius: float, shift: float) -> float:
    """radius: of the mesh about its own origin; shift: length of the pose's."""
    return up(U * (64.0 * radius + 4.0 * shift) + TINY)


def at_cut(radius: float, shift: float, way: float) -> float:
    """shift: the greater of both ends'; way: length of the shifts' difference."""
    return up(U * (256.0 * radius + 192.0 * way + 4.0 * shift) + TINY)


def linear(way: float, far: float) -> float:
    """way: how far the farthest vertex goes; far: how far out the farthest is, at either end."""
    return up(U * (4.0 * way + 2.0 * far) + TINY)


def at_chain(joints: int, reach: float, values: float) -> float:
    """values: sum over all joints of |q_0| + |q_1 - q_0|; reach: from the world's origin, base included."""
    return up(U * reach * (128.0 * joints + 256.0 + 4.0 * values) + TINY)


def in_order(values: Iterable[float]) -> float:
    """One after the other, from 0.0 on, each rounded."""
    total = 0.0
    for value in values:
        total += value
    return total


def dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Dot product of two short vectors of equal length."""
    return in_order((a * b).tolist())
