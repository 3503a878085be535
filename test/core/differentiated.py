# SPDX-License-Identifier: Apache-2.0
"""Scenes for the differentiable functions, and derivatives from differences of exact roots."""

from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np

import hpccd_core as hc
from hpccd_core import shapes

OUTPUTS = ("normals", "weights")
VERTEX_FACE = ((1, 0), (1, 2), (1, 3))  # the pairs of points between which p, a, b of p . (a x b) lie
EDGE_EDGE = ((0, 2), (0, 1), (2, 3))


def sheet_and_ball(seed=0, dtype=np.float64, **options):
    """A detector, and a step in which an uneven sheet falls on a ball that rises."""
    rng = np.random.default_rng(seed)
    sheet, sheet_faces = shapes.grid(6, 6)
    ball, ball_faces = shapes.icosphere(2)
    scene = hc.Scene()
    scene.add_mesh("sheet", sheet_faces)
    scene.add_mesh("ball", ball_faces, self_collision=False)
    start = np.concatenate([sheet + [0, 0, 1.2], ball])
    end = start + np.repeat([[0, 0, -0.5], [0, 0, 0.2]], [len(sheet), len(ball)], axis=0)
    start, end = ((x + rng.normal(0, 0.01, x.shape)).astype(dtype) for x in (start, end))
    return hc.Detector(scene, outputs=OUTPUTS, **options), start, end


def falling(**options):
    """A detector, and a step in which the corner of a triangle reaches the middle of another at 0.5."""
    scene = hc.Scene()
    scene.add_mesh("falling", [[0, 1, 2]])
    scene.add_mesh("ground", [[0, 1, 2]])
    start = np.array([[0, 0, 1], [1, 0, 3], [0, 1, 3], [-5, -5, 0], [5, -5, 0], [0, 5, 0]], float)
    return hc.Detector(scene, outputs=OUTPUTS, **options), start, start + np.repeat([[0, 0, -2], [0, 0, 0]], 3, axis=0)


def without_contact(**options):
    """As `falling`, but upwards."""
    detector, start, end = falling(**options)
    return detector, start, 2 * start - end


def _coefficients(spans, x0, x1):
    """p . (a x b) as a polynomial of the time, from the constant on."""
    vectors = []
    for begin, to in spans:
        at_start = [Fraction(b) - Fraction(a) for a, b in zip(x0[begin], x0[to], strict=True)]
        at_end = [Fraction(b) - Fraction(a) for a, b in zip(x1[begin], x1[to], strict=True)]
        vectors.append([np.array([a, b - a]) for a, b in zip(at_start, at_end, strict=True)])
    p, a, b = vectors
    return sum(
        np.convolve(p[k], np.convolve(a[i], b[j]) - np.convolve(a[j], b[i]))
        for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    )


def exact_slope(spans, x0, x1, toc, d0, d1):
    """The derivative of the root nearest to toc along (d0, d1), from a central difference; None if it is not simple by
    a margin. x0, x1, d0, d1: (4, 3)."""
    step = Fraction(1, 10**25)
    with localcontext() as context:
        context.prec = 90
        roots = []
        for sign in (-1, 1):
            ends = [
                [
                    [Fraction(float(c)) + sign * step * Fraction(float(e)) for c, e in zip(r, s, strict=True)]
                    for r, s in zip(x, d, strict=True)
                ]
                for x, d in ((x0, d0), (x1, d1))
            ]
            f = [Decimal(c.numerator) / Decimal(c.denominator) for c in _coefficients(spans, *ends)]
            t = Decimal(float(toc))
            for _ in range(60):
                value = sum(c * t**k for k, c in enumerate(f))
                slope = sum(k * c * t ** (k - 1) for k, c in enumerate(f) if k)
                if not slope:
                    return None
                t -= value / slope
                if abs(value / slope) < Decimal(10) ** -75:
                    break
            if abs(t - Decimal(float(toc))) > Decimal("1e-12") or abs(slope) < Decimal("1e-3") * sum(map(abs, f)):
                return None
            roots.append(t)
        return float((roots[1] - roots[0]) / (2 * Decimal(step.numerator) / Decimal(step.denominator)))


def exact_slopes(contacts, start, end, d0, d1):
    """`exact_slope` of each contact along a change of all positions; NaN where it is None."""
    slopes = []
    for row, v in enumerate(contacts.vertices):
        spans = VERTEX_FACE if row < len(contacts.vf) else EDGE_EDGE
        toc = np.concatenate([contacts.vf_toc, contacts.ee_toc])[row]
        slope = exact_slope(spans, start[v], end[v], toc, d0[v], d1[v]) if toc > 0 else None
        slopes.append(np.nan if slope is None else slope)
    return np.array(slopes)
