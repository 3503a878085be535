# SPDX-License-Identifier: Apache-2.0
"""Compare the tiers of the core with the exact oracle, query by query."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

import hpccd_core as hc
from hpccd_core import reference

from .disturbances import disturb
from .generators import EDGE_EDGE, GENERATORS, VERTEX_FACE

Answers = tuple[np.ndarray, np.ndarray]  # hit (Q,) bool, toc (Q,) float64

ORACLE = {VERTEX_FACE: reference.vertex_face, EDGE_EDGE: reference.edge_edge}
CORE = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}

SIMD = ("scalar", "avx2", "avx512")

# Promised to be within this of the true time of contact (`exact`).
TOC_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Batch:
    """Queries of one kind from one generator; the same seed and number give the same batch."""

    kind: str
    generator: str
    queries: np.ndarray


@dataclass(frozen=True)
class Disagreement:
    """How one tier's answers differ from the oracle's, for each query; late: toc - true toc, NaN without both."""

    missed: np.ndarray
    invented: np.ndarray
    late: np.ndarray
    uneven: np.ndarray  # instruction sets that should agree to the bit do not

    def broken_promises(self, accuracy: str) -> np.ndarray:
        """Mask of the queries at which the tier does not do what its name promises.

        fast and balanced promise nothing but the same answer from all instruction sets.
        """
        if accuracy == "exact":
            return self.uneven | self.missed | self.invented | (np.abs(self.late) > TOC_TOLERANCE)
        if accuracy == "conservative":
            return self.uneven | self.missed | (self.late > 0)
        return self.uneven


@dataclass
class Tally:
    """Sums over all batches for one accuracy and kind."""

    queries: int = 0
    hits: int = 0
    missed: int = 0
    invented: int = 0
    uneven: int = 0
    broken: int = 0
    worst_toc_error: float = 0.0
    latest: float = 0.0
    failing: list[np.ndarray] = field(default_factory=list)

    def add(self, queries: np.ndarray, hit: np.ndarray, difference: Disagreement, accuracy: str) -> None:
        self.queries += len(queries)
        self.hits += int(hit.sum())
        self.missed += int(difference.missed.sum())
        self.invented += int(difference.invented.sum())
        self.uneven += int(difference.uneven.sum())
        both = difference.late[~np.isnan(difference.late)]
        self.worst_toc_error = max(self.worst_toc_error, np.abs(both).max(initial=0.0))
        self.latest = max(self.latest, both.max(initial=0.0))
        broken = difference.broken_promises(accuracy)
        self.broken += int(broken.sum())
        if broken.any() and sum(map(len, self.failing)) < 1000:
            self.failing.append(queries[broken])


def batches(seed: int, size: int) -> Iterator[Batch]:
    """Batches without end, kinds and generators in turn."""
    turns = [(kind, name) for kind, generators in GENERATORS.items() for name in generators]
    number = 0
    while True:
        kind, name = turns[number % len(turns)]
        rng = np.random.default_rng([seed, number])
        yield Batch(kind, name, disturb(rng, GENERATORS[kind][name](rng, size), kind))
        number += 1


def compare(kind: str, queries: np.ndarray, accuracy: str, simd: Sequence[str], truth: Answers) -> Disagreement:
    """Ask one tier on each instruction set; the first one's answers are compared with the truth.

    Raises AssertionError where an answer is not one at all: NaN, or a time outside [0,1].
    """
    true_hit, true_toc = truth
    (hit, toc), *others = (CORE[kind](queries, accuracy=accuracy, simd=s) for s in simd)
    if not ((toc[hit] >= 0) & (toc[hit] <= 1)).all():
        raise AssertionError(f"{accuracy} {kind}: time of contact outside [0,1]: {toc[hit][:5]}")
    uneven = np.zeros(len(queries), bool)
    for other_hit, other_toc in others:
        uneven |= (other_hit != hit) | (hit & (other_toc != toc))
    both = hit & true_hit
    late = np.where(both, toc, np.nan) - np.where(both, true_toc, np.nan)
    return Disagreement(missed=true_hit & ~hit, invented=hit & ~true_hit, late=late, uneven=uneven)


def add_batch(
    tallies: dict[tuple[str, str], Tally],
    batch: Batch,
    accuracies: Sequence[str],
    *,
    simd: Sequence[str] = ("auto",),
    threads: int = 0,
) -> None:
    """Ask the oracle (on so many threads) and each tier, and add what comes out to tallies[accuracy, kind]."""
    truth = ORACLE[batch.kind](batch.queries, threads)
    for accuracy in accuracies:
        difference = compare(batch.kind, batch.queries, accuracy, simd, truth)
        tallies[accuracy, batch.kind].add(batch.queries, truth[0], difference, accuracy)


def new_tallies() -> dict[tuple[str, str], Tally]:
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
