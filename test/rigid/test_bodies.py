# SPDX-License-Identifier: Apache-2.0
"""Whole meshes, the way that hpccd_core/rigid/__init__.py shows: a turning body, a link and a deforming sheet."""

from itertools import pairwise

import numpy as np
import pytest
from random_poses import random_screw

import hpccd_core as hc
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.cuts import Margin, bound, fewest_parts, grown
from hpccd_core.rigid.joints import Joint, JointStep, LinkMotion
from hpccd_core.rigid.merged import merged
from hpccd_core.rigid.motion import Linear, ScrewMotion
from hpccd_core.rigid.transform import IDENTITY, Rigid

BOX = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
BOX_FACES = np.array(
    [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ]
)
SAMPLES = 500


def sheet(rng):
    x, y = np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-3, 3, 7))
    start = np.stack([x, y, 0.2 * rng.standard_normal(x.shape)], axis=2).reshape(-1, 3)
    corner = np.array([row * 7 + column for row in range(6) for column in range(6)])
    faces = np.concatenate(
        [np.stack(f, 1) for f in ((corner, corner + 1, corner + 7), (corner + 1, corner + 8, corner + 7))]
    )
    return start, start + 0.3 * rng.standard_normal(start.shape), faces


def scene_of(sheet_faces):
    scene = hc.Scene()
    for name in ("box", "link"):
        scene.add_mesh(name, BOX_FACES, self_collision=False)
    scene.add_mesh("sheet", sheet_faces, self_collision=False)
    return scene


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("tolerance", [0.3, 0.01])
def test_bodies_and_a_sheet(seed, tolerance):
    rng = np.random.default_rng(seed)
    x0, x1, faces = sheet(rng)
    screw = random_screw(rng, rng.uniform(0.1, 2.0), 1.0)
    joints = [
        Joint.of("revolute", k - 1, Rigid(IDENTITY.quaternion, 1.5 * np.eye(3)[0]), rng.standard_normal(3))
        for k in range(3)
    ]
    values = rng.uniform(-1, 1, (2, 3))
    motions = [
        ScrewMotion(Body.of(BOX), screw),
        LinkMotion(
            JointStep(joints, *values, Rigid(IDENTITY.quaternion, np.array([-3.0, 0, 0.5]))), 2, Body.of(0.5 * BOX)
        ),
        Linear(x0, x1),
    ]
    cut = fewest_parts(motions, tolerance, 64)
    margins = [Margin.of(motion, cut.parts) for motion in motions]
    detector = hc.Detector(scene_of(faces), outputs=("points",))
    for a in range(3):
        for b in range(a):
            detector.set_separation(a, b, grown(0.0, margins[a], margins[b]))
    frames = [np.concatenate([m.vertices(j, cut.parts) for m in motions]) for j in range(cut.parts + 1)]
    found = merged([detector.detect(x, y) for x, y in pairwise(frames)], cut.parts)

    # The true motion, in pieces so short that straight lines deviate by next to nothing.
    exact = hc.Detector(scene_of(faces))
    fine = [np.concatenate([m.vertices(j, SAMPLES) for m in motions]) for j in range(SAMPLES + 1)]
    truth = merged([exact.detect(x, y) for x, y in pairwise(fine)], SAMPLES)
    assert len(truth) > 0 and len(found.points) == len(found)
    for kind in ("vf", "ee"):
        mine = dict(zip(map(tuple, getattr(found, kind).tolist()), getattr(found, f"{kind}_toc"), strict=True))
        for pair, toc in zip(map(tuple, getattr(truth, kind).tolist()), getattr(truth, f"{kind}_toc"), strict=True):
            assert mine[pair] <= toc + 1e-9

    # Spurious contacts were within twice the bound of the pair.
    limit = hc.Detector(scene_of(faces))
    for a in range(3):
        for b in range(a):
            limit.set_separation(a, b, 2 * bound((margins[a], margins[b])) + 1e-5)
    near = merged([limit.detect(x, y) for x, y in pairwise(fine)], SAMPLES)
    assert {*map(tuple, found.vf.tolist())} <= {*map(tuple, near.vf.tolist())}
    assert {*map(tuple, found.ee.tolist())} <= {*map(tuple, near.ee.tolist())}
