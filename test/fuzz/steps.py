# SPDX-License-Identifier: Apache-2.0
"""Collision-free steps of small scenes by the core and by the oracle; and consistency of all results for a step.

One detector computes all scenes of a topology, so an error in state kept from one start affects the next.
"""

from __future__ import annotations

import functools

import numpy as np
import oracle

import hpccd_core as hc
from hpccd_core.options import FEATURES

from .step_motions import MOTIONS, motions_of
from .step_scenes import MOTION_SCENES, SMALL_SCENES

# Guarantee of `exact` and `conservative`: the step ends at most this much before the true time.
EARLY = 1e-9
SHORTER = 0.625  # a part of the step that is asked for too, as line searches do

STEP_MOTIONS = {kind: {name: motions_of(scene, name) for name in MOTIONS} for kind, scene in SMALL_SCENES.items()}


def true_steps(kind: str, queries: np.ndarray, distances: np.ndarray, threads: int) -> tuple[np.ndarray, np.ndarray]:
    """hit: whether there is a contact; value: the collision-free step; queries: (Q,2V,3)."""
    scene = MOTION_SCENES[kind]
    starts, ends = ends_of(queries)
    toc = oracle.earliest_contacts(
        starts,
        ends,
        scene.faces,
        edges_per_mesh=scene.edges,
        n_vertices=scene.n_vertices,
        minimum_separation=distances,
        threads=threads,
    )
    return np.isfinite(toc), np.minimum(toc, 1.0)


def core_steps(
    kind: str, queries: np.ndarray, distances: np.ndarray, accuracy: str, simd: str
) -> tuple[np.ndarray, np.ndarray]:
    """The same by the core, which tells a contact just at the end from none by detection only: hit is below 1."""
    starts, ends = ends_of(queries)
    ask = _Asked(kind, accuracy, simd)
    steps = np.array([ask.step(*scene) for scene in zip(starts, ends, distances, strict=True)])
    return steps < 1, steps


def contradict(kind: str, queries: np.ndarray, distances: np.ndarray, accuracy: str, simd: str) -> np.ndarray:
    """Mask of the scenes with inconsistent results: `first` is not the earliest contacts of `all`; the step does not
    end at their time; it differs when the start repeats; or, if only one kind of feature is tested, contacts and step
    differ from those of this kind in the full result."""
    ask = _Asked(kind, accuracy, simd)
    starts, ends = ends_of(queries)
    return np.array([not ask.agrees(*scene) for scene in zip(starts, ends, distances, strict=True)], bool)


class _Asked:
    def __init__(self, kind: str, accuracy: str, simd: str) -> None:
        self._of = functools.partial(_detector, kind, accuracy, simd)
        self._n_meshes = len(SMALL_SCENES[kind].faces)
        self._promised = accuracy in ("exact", "conservative")

    def step(self, start: np.ndarray, end: np.ndarray, separation: float) -> float:
        return self._with(separation, "all").collision_free_step(start, end)

    def agrees(self, start: np.ndarray, end: np.ndarray, separation: float) -> bool:
        every, first = (self._with(separation, report).detect(start, end) for report in ("all", "first"))
        shorter = start + SHORTER * (end - start)
        steps = [self.step(start, end, separation) for _ in range(2)]
        trials = [
            self.step(start, shorter, separation),
            self._with(separation, "first").collision_free_step(start, shorter),
        ]
        fits = self._is_free(steps[0], every.first_toc) and steps[0] == steps[1] and trials[0] == trials[1]
        return (
            fits
            and is_first(first, every)
            and all(self._agrees_alone(feature, start, end, separation, every) for feature in FEATURES)
        )

    def _agrees_alone(
        self, feature: str, start: np.ndarray, end: np.ndarray, separation: float, every: hc.Contacts
    ) -> bool:
        detector = self._with(separation, "all", (feature,))
        step, alone = detector.collision_free_step(start, end), detector.detect(start, end)
        return is_alone(alone, feature, every) and self._is_free(step, alone.first_toc)

    def _is_free(self, step: float, first_toc: float) -> bool:
        earliest = min(first_toc, np.nextafter(1.0, 0)) if first_toc <= 1 else 1.0
        return earliest - EARLY <= step <= earliest if self._promised else step == earliest

    def _with(self, separation: float, report: str, features: tuple[str, ...] = FEATURES) -> hc.Detector:
        detector, now = self._of(report, features)
        if now != [separation]:
            detector.set_separations(np.full((self._n_meshes, self._n_meshes), separation))
            now[:] = [separation]
        return detector


def is_first(first: hc.Contacts, every: hc.Contacts) -> bool:
    """Whether `first` holds exactly those contacts of `every` that begin at the earliest time."""
    same = first.first_toc == every.first_toc
    for kind in ("vf", "ee"):
        toc = getattr(every, f"{kind}_toc")
        kept = toc == every.first_toc
        same = same and np.array_equal(getattr(first, kind), getattr(every, kind)[kept])
        same = same and getattr(first, f"{kind}_toc").tobytes() == toc[kept].tobytes()
    return same


def is_alone(alone: hc.Contacts, feature: str, every: hc.Contacts) -> bool:
    """Whether `alone` holds exactly those contacts of `every` that are of this feature."""
    for name, kind in zip(FEATURES, ("vf", "ee"), strict=True):
        pairs, toc = getattr(every, kind), getattr(every, f"{kind}_toc")
        kept = slice(None) if name == feature else slice(0)
        same = np.array_equal(getattr(alone, kind), pairs[kept])
        if not same or getattr(alone, f"{kind}_toc").tobytes() != toc[kept].tobytes():
            return False
    return True


def ends_of(queries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    half = queries.shape[1] // 2
    return np.ascontiguousarray(queries[:, :half]), np.ascontiguousarray(queries[:, half:])


@functools.cache
def _detector(
    kind: str, accuracy: str, simd: str, report: str, features: tuple[str, ...]
) -> tuple[hc.Detector, list[float]]:
    """And the separation that it has now."""
    small = SMALL_SCENES[kind]
    scene = hc.Scene()
    for number, (faces, edges, n) in enumerate(zip(small.faces, small.edges, small.n_vertices, strict=True)):
        scene.add_mesh(f"mesh{number}", faces, edges=edges, n_vertices=n)
    detector = hc.Detector(
        scene, accuracy=accuracy, simd=simd, report=report, features=features, backend="cpu", threads=1
    )
    return detector, [0.0]
