# SPDX-License-Identifier: Apache-2.0
"""Arithmetic that gives the same bits on every machine.

IEEE 754 fixes the result of + - * / and sqrt, but not of sin or cos, and not of the order in which a
BLAS product or a SIMD sum adds. Scenes therefore use only what is here, element-wise numpy operations,
and `numpy.bincount`/`numpy.add.at`, which add in index order.
"""

from __future__ import annotations

import numpy as np

PI = 3.141592653589793

# pi/2 = HIGH + LOW; HIGH has 33 significant bits, so k * HIGH is exact for |k| < 2**20.
_HALF_PI_HIGH = 1.5707963267341256
_HALF_PI_LOW = 6.077100506506192e-11
_SIN = (1 / -1307674368000, 1 / 6227020800, 1 / -39916800, 1 / 362880, 1 / -5040, 1 / 120, 1 / -6, 1.0)
_COS = (1 / 20922789888000, 1 / -87178291200, 1 / 479001600, 1 / -3628800, 1 / 40320, 1 / -720, 1 / 24, -0.5, 1.0)


def _polynomial(coefficients, x):
    value = np.full_like(x, coefficients[0])
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value


def sincos(angle):
    """Sine and cosine of `angle` (radians, |angle| < 1e6), float64 arrays of its shape, error below 1e-14."""
    angle = np.asarray(angle, dtype=np.float64)
    quarter = np.rint(angle * (2 / PI))
    r = (angle - quarter * _HALF_PI_HIGH) - quarter * _HALF_PI_LOW
    r2 = r * r
    s, c = r * _polynomial(_SIN, r2), _polynomial(_COS, r2)
    quadrant = quarter.astype(np.int64) & 3
    odd, sine_negative, cosine_negative = quadrant & 1, quadrant >= 2, (quadrant == 1) | (quadrant == 2)
    sine, cosine = np.where(odd, c, s), np.where(odd, s, c)
    return np.where(sine_negative, -sine, sine), np.where(cosine_negative, -cosine, cosine)


def dot(a, b):
    """Dot products over the last axis (length 3), added x, y, z in this order."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def length(a):
    """Euclidean lengths over the last axis (length 3)."""
    return np.sqrt(dot(a, a))


def normalized(a):
    """Unit vectors along the last axis (length 3); a zero vector stays zero."""
    norm = length(a)
    return a / np.where(norm > 0, norm, 1.0)[..., None]


def cross(a, b):
    """Cross products over the last axis (length 3)."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)


def rotate(quaternion, points):
    """Rotate `points` (..., 3) by unit quaternions (..., 4; w first), broadcasting over leading axes."""
    w, axis = quaternion[..., :1], quaternion[..., 1:]
    twice = 2.0 * cross(axis, points)
    return points + w * twice + cross(axis, twice)


def axis_angle(axis, angle):
    """Unit quaternions (..., 4; w first) for unit axes (..., 3) and angles (...) in radians."""
    s, c = sincos(0.5 * np.asarray(angle, dtype=np.float64))
    return np.concatenate([c[..., None], np.asarray(axis) * s[..., None]], axis=-1)


def product(a, b):
    """The turns of unit quaternions `b`, then those of `a` (..., 4; w first)."""
    w = a[..., 0] * b[..., 0] - dot(a[..., 1:], b[..., 1:])
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + cross(a[..., 1:], b[..., 1:])
    return np.concatenate([w[..., None], v], axis=-1)


def random_stream(seed: int) -> np.random.RandomState:
    """RandomState, whose stream of `random_sample` numpy promises never to change (NEP 19)."""
    return np.random.RandomState(seed)
