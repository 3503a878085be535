# SPDX-License-Identifier: Apache-2.0
"""Motions of rigid meshes, which a detector of straight-line motion approximates with a proven bound.

A detector moves vertices on straight lines. A mesh that moves by poses is taken to follow a screw: it rotates about a
fixed axis and slides along it, at constant speed, by at most half a turn. `deviation` bounds how far the straight
lines are from that motion. The step is divided into the fewest equal parts that keep the bound below a tolerance, and
the separation of each pair of meshes grows by the bounds of both, so that no contact of the true motion is missed or
reported late. Positions and bounds are in the unit of the coordinates.

Examples
--------
A blade turns by 60 degrees through a wall. Straight lines from start to end pass in front of the wall:

>>> from itertools import pairwise
>>> import numpy as np
>>> import hpccd_core as hc
>>> from hpccd_core import rigid
>>> scene = hc.Scene()
>>> _ = scene.add_mesh("blade", [[0, 1, 2]], self_collision=False)
>>> _ = scene.add_mesh("wall", [[0, 1, 2]], static=True)
>>> blade = rigid.Body.of(np.array([[0, 0, 0], [1, -0.1, 0], [1, 0.1, 0]]))
>>> wall = np.array([[0.99, -5, -5], [0.99, 5, -5], [0.99, 0, 5]])
>>> half = np.deg2rad(60) / 2
>>> before, after = (rigid.Rigid.of((0, 0, 0), (0, 0, side * np.sin(half), np.cos(half))) for side in (-1, 1))
>>> motions = [rigid.ScrewMotion(blade, rigid.Screw.between(before, after)), rigid.Linear(wall, wall)]
>>> detector = hc.Detector(scene)
>>> len(detector.detect(*(np.vstack([motion.vertices(k, 1) for motion in motions]) for k in (0, 1))))
0

Divided into parts, with the separation grown by the bounds, the contact is found:

>>> cut = rigid.fewest_parts(motions, tolerance=1e-3, most=64)
>>> margins = [rigid.Margin.of(motion, cut.parts) for motion in motions]
>>> detector.set_separation("blade", "wall", rigid.grown(0.0, *margins))
>>> frames = [np.vstack([motion.vertices(k, cut.parts) for motion in motions]) for k in range(cut.parts + 1)]
>>> contacts = rigid.merged([detector.detect(a, b) for a, b in pairwise(frames)], cut.parts)
>>> cut.parts, rigid.bound(margins) < 1e-3, len(contacts) > 0
(24, True, True)

Notes
-----
Pairs of meshes that both go straight, as a cloth with itself, need no cut and no margin: ask them in a detector of
their own, whose scene ignores the other pairs, once for the whole step, and give its result to `merged` as ``whole``.
The other detector ignores them (a mesh with itself: ``self_collision=False``). Where most triangles are cloth that
saves most of the time of a step that is cut.

Why no contact is missed. At any time t of a part each point of a mesh on its true motion is within `deviation` of where
it would be if the vertices, exact at both ends of the part, went on straight lines (motion.py, screw.py, joints.py);
and that is within `rounding` of where it is on straight lines between the positions as they were computed
(rounding.py): what is true of vertices is true of the points of edges and faces, which are averages of theirs with
fixed weights. So two features that on their true motions come within d of each other at t are, on the lines that the
detector is given, within

    d' = d + B_a + B_b + rho_a + rho_b

at the same t: they are reported, no later than it is true. And what is reported at d' is, on the true motions and at
the time that is reported, within d' + B_a + B_b + rho_a + rho_b, which is the excess of at most twice the bound.
"""

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.cuts import Cut, Margin, all_grown, bound, fewest_parts, grown
from hpccd_core.rigid.merged import merged
from hpccd_core.rigid.motion import Linear, Motion, ScrewMotion
from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import IDENTITY, Rigid

__all__ = [
    "Body",
    "Cut",
    "IDENTITY",
    "Linear",
    "Margin",
    "Motion",
    "Rigid",
    "Screw",
    "ScrewMotion",
    "all_grown",
    "bound",
    "fewest_parts",
    "grown",
    "merged",
]
