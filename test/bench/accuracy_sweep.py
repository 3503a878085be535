# SPDX-License-Identifier: Apache-2.0
"""Errors of each tier on elementary queries at growing scale, at growing distance from the origin, and on hard queries,
each compared with the exact oracle on the same coordinates."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from fuzz import questions
from fuzz.generators import GENERATORS
from fuzz.questions import CONTACT, Batch

from bench import lab
from hpccd_ros.bench import truth

SCALES = tuple(10.0**k for k in (-150, -100, -60, -30, -20, -10, -3, 0, 3, 10, 20, 30, 60, 100, 148))
OFFSETS = (0.0, *(10.0**k for k in range(0, 13)))
# No short binary fractions: a shift by one of these rounds, as those of real scenes do.
DIRECTION = np.array([0.7312, -1.1379, 0.9151])


def sweep(tiers: list[str], n: int, seed: int) -> list[dict]:
    """Rows {"sweep", "at", "queries": "ordinary" or "degenerate", "accuracy", ...}; n queries of each kind a point."""
    points = [("scale", at) for at in SCALES] + [("offset", at) for at in OFFSETS]
    rows = []
    with lab.bar("sweeps", len(points) * 2) as done:
        for family in ("ordinary", "degenerate"):
            base = {kind: _queries(kind, family, n, seed) for kind in GENERATORS}
            for name, at in points:
                moved = [
                    Batch(CONTACT, kind, family, q * at if name == "scale" else q + at * DIRECTION, np.zeros(len(q)))
                    for kind, q in base.items()
                ]
                rows += [{"sweep": name, "at": at, "queries": family, **row} for row in ask(moved, tiers)]
                done()
    return rows


def adversarial(tiers: list[str], n: int, seed: int, question: str = CONTACT) -> list[dict]:
    """Rows {"generator", "accuracy", ...}: n queries of each kind from each generator of `make fuzz`, disturbed as
    there."""
    kinds = {kind: questions.generators_of(question, kind) for kind in questions.kinds_of(question)}
    names = sorted({name for generators in kinds.values() for name in generators})
    rows = []
    with lab.bar(f"hard queries, {question}", len(names)) as done:
        for number, name in enumerate(names):
            batches = [
                questions.generated(question, kind, name, np.random.default_rng([seed, number]), n)
                for kind, generators in kinds.items()
                if name in generators
            ]
            rows += [{"generator": name, **row} for row in ask(batches, tiers)]
            done()
    return rows


def _queries(kind, family, n, seed):
    """Sizes about one. ordinary: real coordinates without any relation; degenerate: small integers, so that borders,
    common planes and coincident points are hit exactly, as long as rounding leaves them so."""
    rng = np.random.default_rng([seed, kind == "edge-edge"])
    if family == "ordinary":
        return GENERATORS[kind]["generic"](rng, n)
    return GENERATORS[kind]["meeting"](rng, n)


def ask(batches: list[Batch], tiers: list[str], known: list[questions.Results] | None = None) -> Iterator[dict]:
    """A row for each tier, of all batches together; `known`: the truth of each batch, by default the oracle's."""
    true = known or [questions.truth(batch) for batch in batches]
    sizes = np.concatenate([questions.size_of(batch) for batch in batches])
    for tier in tiers:
        results = [questions.results(batch, tier, "auto") for batch in batches]
        parts = [
            np.concatenate(part) for part in zip(*((*a, *t) for a, t in zip(results, true, strict=True)), strict=True)
        ]
        hit, toc, true_hit, true_toc = parts
        both, wrong = hit & true_hit, ((true_hit, true_hit & ~hit, hit & ~true_hit))
        errors = truth.errors(*(int(of.sum()) for of in wrong), (toc[both] - true_toc[both]) / sizes[both])
        total = len(sizes)
        yield {
            "accuracy": tier,
            "n": total,
            "true": errors.true,
            "missed": errors.missed,
            "invented": errors.invented,
            "wrong_share": (errors.missed + errors.invented) / total,
            "toc_worst": errors.toc_worst,
            "toc_p99": errors.toc_p99,
            "latest": errors.latest,
        }
