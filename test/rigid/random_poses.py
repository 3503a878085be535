# SPDX-License-Identifier: Apache-2.0
"""Poses, and the true way between them in 64 bits."""

import numpy as np
from oracle.rigid_paths import ScrewPaths

from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import Rigid


def quaternion(axis, angle):
    axis = np.array(axis, float) / np.linalg.norm(axis)
    return np.append(axis * np.sin(angle / 2), np.cos(angle / 2))


def random_screw(rng, angle, far=0.0, way=1.0):
    """A turn by about ``angle`` from a random pose."""
    first = Rigid.of(far * rng.standard_normal(3), unit(rng.standard_normal(4)))
    turn = Rigid.of(np.zeros(3), quaternion(rng.standard_normal(3), angle))
    second = Rigid(turn.after(first).quaternion, first.shift + way * rng.standard_normal(3))
    return Screw.between(first, second)


def true_vertices(screw, points, t):
    """(n,3) longdouble at the fraction t, less the first shift."""
    start, end = screw.start, screw.end
    paths = ScrewPaths(
        points[None].astype(float),
        np.array([[start.quaternion, end.quaternion]]),
        np.array([[start.shift, end.shift]]),
        start.shift[None],
    )
    return paths.at(np.zeros(1, int), np.array([t]), np.longdouble)[0][0]


def unit(vector):
    return vector / np.linalg.norm(vector)
