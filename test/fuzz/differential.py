# SPDX-License-Identifier: Apache-2.0
"""Compare the tiers of the core with the exact oracle, query by query."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

import hpccd_core as hc

from . import mixed, questions, solids
from .motions import break_promises
from .questions import (
    CONTACT,
    CONTAINMENT,
    DEPTH,
    DISTANCES,
    INTERSECTIONS,
    MIXED,
    MOTION,
    POINTS,
    PROXIMITY,
    SEPARATION,
    SIGNED,
    STEP,
    TRANSLATION,
    WINDING,
    Batch,
    Results,
)
from .steps import EARLY, contradict

SIMD = ("scalar", "avx2", "avx512", "neon")
QUESTIONS = (CONTACT, SEPARATION, PROXIMITY, INTERSECTIONS, DISTANCES, STEP, MOTION)
QUESTIONS += (CONTAINMENT, WINDING, SIGNED, TRANSLATION, DEPTH, POINTS, MIXED)

# Guarantee of `exact`: error of the time; error of the distance, relative to the size of the query.
TOLERANCE = 1e-12
# Results that are times: `conservative` may report them too early but not too late.
OF_A_STEP = (CONTACT, SEPARATION, MIXED)

Tallies = dict[tuple[str, str, str], "Tally"]  # by question, accuracy and kind


@dataclass(frozen=True)
class Disagreement:
    """How the results of one tier differ from the oracle's, for each query.

    late: time - true time, or distance - true distance in sizes of the query; NaN without both.
    """

    missed: np.ndarray
    invented: np.ndarray
    late: np.ndarray
    uneven: (
        np.ndarray
    )  # instruction sets or queries of a step that should be bit-identical differ; or a motion is wrong
    question: str = CONTACT

    def broken_promises(self, accuracy: str) -> np.ndarray:
        """Mask of the queries that violate the guarantees of the tier.

        `fast` and `balanced` guarantee only the same result with all instruction sets.
        """
        if self.question == MOTION and accuracy in ("exact", "conservative"):
            return self.uneven | self.missed | self.invented
        if self.question == STEP and accuracy in ("exact", "conservative"):
            return self.uneven | self.invented | ~((self.late <= 0) & (self.late >= -EARLY))
        if self.question == DEPTH:  # an upper bound of the true one, in every tier
            return self.uneven | self.missed | (self.late < -TOLERANCE)
        if accuracy == "exact":
            return self.uneven | self.missed | self.invented | (np.abs(self.late) > TOLERANCE)
        if accuracy != "conservative":
            return self.uneven
        broken = self.uneven | self.missed
        broken |= self.late > 0 if self.question in OF_A_STEP else np.abs(self.late) > TOLERANCE
        if self.question not in (CONTACT, MIXED):  # the same pairs as exact
            broken |= self.invented
        return broken


@dataclass
class Tally:
    """Sums over all batches for one question, accuracy and kind."""

    queries: int = 0
    hits: int = 0
    missed: int = 0
    invented: int = 0
    uneven: int = 0
    broken: int = 0
    worst_error: float = 0.0
    latest: float = 0.0
    failing: list[Batch] = field(default_factory=list)

    def add(self, batch: Batch, hit: np.ndarray, difference: Disagreement, accuracy: str) -> None:
        self.queries += len(batch.queries)
        self.hits += int(hit.sum())
        self.missed += int(difference.missed.sum())
        self.invented += int(difference.invented.sum())
        self.uneven += int(difference.uneven.sum())
        both = difference.late[~np.isnan(difference.late)]
        self.worst_error = max(self.worst_error, np.abs(both).max(initial=0.0))
        self.latest = max(self.latest, both.max(initial=0.0))
        broken = difference.broken_promises(accuracy)
        self.broken += int(broken.sum())
        if broken.any() and sum(len(b.queries) for b in self.failing) < 1000:
            self.failing.append(batch.part(broken))


def batches(seed: int, size: int, asked: Sequence[str] = QUESTIONS) -> Iterator[Batch]:
    """Endless batches: cycle through questions, kinds and generators.

    The same seed and number give the same batch.
    """
    turns = [(question, kind) for question in asked for kind in questions.kinds_of(question)]
    number = 0
    while True:
        question, kind = turns[number % len(turns)]
        names = list(questions.generators_of(question, kind))
        name = names[number // len(turns) % len(names)]
        yield questions.generated(question, kind, name, np.random.default_rng([seed, number]), size)
        number += 1


def compare(batch: Batch, accuracy: str, simd: Sequence[str], truth: Results) -> Disagreement:
    """Query one tier with each instruction set; the results of the first are compared with the truth.

    Raises AssertionError for an invalid result: NaN, or a time outside [0,1].
    """
    true_hit, true_value = truth
    (hit, value), *others = (questions.results(batch, accuracy, s) for s in simd)
    # A distance of meshes is told whether or not they touch; it is infinite where they have no pair of features.
    # A step is told where nothing touches too, and a smallest factor.
    always = batch.question in (
        DISTANCES,
        CONTAINMENT,
        STEP,
        MOTION,
        WINDING,
        SIGNED,
        TRANSLATION,
        DEPTH,
        POINTS,
        MIXED,
    )
    told = np.ones_like(hit) if always else hit
    largest = 1.0 if batch.question in (CONTACT, SEPARATION, STEP, MOTION, MIXED) else np.inf
    if not ((value[told] >= 0) & (value[told] <= largest)).all():
        raise AssertionError(f"{accuracy} {batch.question} {batch.kind}: value out of range: {value[told][:5]}")
    uneven = np.zeros(hit.shape, bool)
    for other_hit, other_value in others:
        uneven |= (other_hit != hit) | (told & (other_value != value))
    different = told & (always | true_hit) & (value != true_value)
    late = np.where(told & (always | true_hit), 0.0, np.nan)
    late[different] = value[different] - true_value[different]
    late = (late.T / questions.size_of(batch)).T
    missed, invented = true_hit & ~hit, hit & ~true_hit
    if batch.question == STEP:
        missed &= true_value < 1  # a contact just at the end
        for s in simd:
            uneven |= contradict(batch.kind, batch.queries, batch.distances, accuracy, s)
    if batch.question == MOTION:  # the value is a factor, to which others than the true step may be right
        late[:] = np.nan
        uneven |= break_promises(batch.kind, batch.queries, batch.distances, accuracy, simd, true_value)
    if batch.question == MIXED:
        uneven |= mixed.break_promises(batch.kind, batch.queries, batch.distances, accuracy, simd)
    if batch.question == DEPTH:
        for s in simd:
            uneven |= solids.break_promises(batch.kind, batch.queries, accuracy, s, true_value)
    if late.ndim == 2:  # of several results for each scene the worst
        worst = np.abs(late).argmax(axis=1)[:, None]
        late = np.take_along_axis(late, worst, axis=1)[:, 0]
        missed, invented, uneven = (results.any(axis=1) for results in (missed, invented, uneven))
    return Disagreement(missed, invented, late, uneven, batch.question)


def add_batch(
    tallies: Tallies, batch: Batch, accuracies: Sequence[str], *, simd: Sequence[str] = ("auto",), threads: int = 0
) -> None:
    """Query the oracle (on `threads` threads) and each tier, and add the results to tallies."""
    truth = questions.truth(batch, threads)
    for accuracy in accuracies:
        difference = compare(batch, accuracy, simd, truth)
        hit = truth[0].reshape(len(batch.queries), -1).any(axis=1)
        tallies[batch.question, accuracy, batch.kind].add(batch, hit, difference, accuracy)


def new_tallies() -> Tallies:
    return defaultdict(Tally)


def usable_simd() -> list[str]:
    """The instruction sets of this machine and build, the default first."""
    default = hc.Detector(hc.Scene()).simd
    usable = [default]
    for simd in SIMD:
        if simd == default:
            continue
        try:
            hc.test_vertex_face(np.empty((0, 8, 3)), simd=simd)
        except ValueError:
            continue
        usable.append(simd)
    return usable
