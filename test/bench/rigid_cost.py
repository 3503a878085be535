# SPDX-License-Identifier: Apache-2.0
"""Cost of a step in which rigid meshes move by poses or joints, compared with the same step on straight lines."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

import hpccd_core as hc
from bench.lab import times
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.cuts import Margin, all_grown, bound, fewest_parts
from hpccd_core.rigid.joints import Joint, JointStep, LinkMotion
from hpccd_core.rigid.merged import merged
from hpccd_core.rigid.motion import Linear, Motion, ScrewMotion
from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros import scenes as generated
from hpccd_ros.scenes.scene import Mesh

_SCENE = "cloth-ball-like"
_LINKS = 7
_MOST_PARTS = 64


@dataclass(frozen=True, eq=False)
class _Subject:
    """A cloth, then rigid meshes with the faces of a ball; links in a row ignore their neighbours.

    `motions(degrees)`: motions of all meshes, computed for each step as a node does.
    """

    name: str
    cloth: Mesh
    ball: Mesh
    rigid: int
    motions: Callable[[float], list[Motion]]

    @property
    def triangles(self) -> int:
        return len(self.cloth.faces) + self.rigid * len(self.ball.faces)

    def scene(self, cloth_alone: bool = True, with_rigid: bool = True) -> hc.Scene:
        """Of the cloth with itself, of all other pairs, or of both."""
        scene = hc.Scene()
        scene.add_mesh("cloth", self.cloth.faces, n_vertices=self.cloth.n_vertices, self_collision=cloth_alone)
        names = [f"rigid {k}" for k in range(self.rigid)]
        for name in names:
            scene.add_mesh(name, self.ball.faces, n_vertices=self.ball.n_vertices, self_collision=False)
        for a, b in combinations(names, 2) if not with_rigid else pairwise(names):
            scene.ignore_pair(a, b)
        for name in names if not with_rigid else ():
            scene.ignore_pair("cloth", name)
        return scene


@dataclass(frozen=True, eq=False)
class _Detectors:
    """``line``: of all pairs, on straight lines. ``whole``: of the cloth with itself; ``cut``: of all other pairs."""

    line: hc.Detector
    whole: hc.Detector
    cut: hc.Detector


def rows(turns: list[float], tolerances: list[float], args) -> Iterator[dict]:
    for subject in _subjects(args.size):
        scenes = (subject.scene(), subject.scene(with_rigid=False), subject.scene(cloth_alone=False))
        options = {"accuracy": args.accuracy, "backend": "cpu", "threads": args.threads}
        detectors = _Detectors(*(hc.Detector(scene, **options) for scene in scenes))
        for turn in turns:
            for tolerance in tolerances:
                yield {
                    "scene": subject.name,
                    "triangles": subject.triangles,
                    "turn": turn,
                    "tolerance": tolerance,
                    **_measure(detectors, subject, turn, tolerance, args.repeat),
                }


def _measure(detectors, subject, turn, tolerance, rounds):
    linear_ms, moved_ms, outside_ms = [], [], []
    for number in range(rounds + 1):
        motions = subject.motions(turn)
        start, end = (np.concatenate([m.vertices(k, 1) for m in motions]) for k in (0, 1))
        began = time.perf_counter()
        straight = detectors.line.detect(start, end)
        straight_ms = 1e3 * (time.perf_counter() - began)
        began = time.perf_counter()
        found, cut, margins, in_core = _moved(detectors, subject.motions(turn), tolerance)
        ms = 1e3 * (time.perf_counter() - began)
        if number:
            linear_ms.append(straight_ms)
            moved_ms.append(ms)
            outside_ms.append(ms - in_core)
    linear, moved = times(linear_ms), times(moved_ms)
    return {
        "parts": cut.parts,
        "enough": cut.enough,
        "bound": max(bound((a, b)) for i, a in enumerate(margins) for b in margins[:i]),
        "linear_ms": linear["median_ms"],
        "moved_ms": moved["median_ms"],
        "least_linear_ms": linear["best_ms"],
        "least_moved_ms": moved["best_ms"],
        "over_linear": moved["median_ms"] / linear["median_ms"],
        "least_over_linear": moved["best_ms"] / linear["best_ms"],
        "least_outside_ms": min(outside_ms),
        "linear_contacts": len(straight),
        "contacts": len(found),
    }


def _moved(detectors, motions: list[Motion], tolerance):
    cut = fewest_parts(motions, tolerance, _MOST_PARTS)
    margins = [Margin.of(motion, cut.parts) for motion in motions]
    detectors.cut.set_separations(all_grown(np.zeros((len(margins), len(margins))), margins))
    frames = [np.concatenate([m.vertices(j, cut.parts) for m in motions]) for j in range(cut.parts + 1)]
    began = time.perf_counter()
    whole = detectors.whole.detect(frames[0], frames[-1])
    found = [detectors.cut.detect(x, y) for x, y in pairwise(frames)]
    in_core = 1e3 * (time.perf_counter() - began)
    return merged(found, cut.parts, whole), cut, margins, in_core


def _subjects(size):
    """A cloth draped on a ball that spins; and on an arm of seven links, as many balls, smaller."""
    made = generated.make(_SCENE, size, progress=True)
    frame = made.n_frames * 2 // 3
    (cloth, ball), (cloth_next, _) = made.frame(frame), made.frame(frame + 1)
    centre = ball.astype(np.float64).mean(axis=0)
    body = Body.of(ball - centre)
    cloth, cloth_next = cloth.astype(np.float64), cloth_next.astype(np.float64)

    def spun(degrees):
        half = math.radians(degrees) / 2
        pose = Rigid(IDENTITY.quaternion, centre)
        turned = Rigid.of(centre, (0.0, 0.6 * math.sin(half), 0.8 * math.sin(half), math.cos(half)))
        return [Linear(cloth, cloth_next), ScrewMotion(body, Screw.between(pose, turned))]

    yield _Subject("spinning ball", *made.meshes, 1, spun)

    small = Body.of(0.3 * (ball - centre))
    joints = [
        Joint.of("revolute", k - 1, Rigid(IDENTITY.quaternion, np.array([0.3 if k else 0.0, 0, 0])), axis)
        for k, axis in enumerate([(0, 0, 1), (0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1)])
    ]
    # Laid across the cloth: from its edge over the middle of the ball.
    base = Rigid(IDENTITY.quaternion, np.array([-0.9, 0.0, float(cloth[:, 2].max())]) + [centre[0], centre[1], 0.0])

    def swung(degrees):
        turn = math.radians(degrees) * np.array([1, -1, 1, -1, 1, -1, 1.0])
        step = JointStep(joints, np.zeros(_LINKS), turn, base)
        return [Linear(cloth, cloth_next), *(LinkMotion(step, k, small) for k in range(_LINKS))]

    yield _Subject("arm of seven links", *made.meshes, _LINKS, swung)
