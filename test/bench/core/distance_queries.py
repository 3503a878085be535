# SPDX-License-Identifier: Apache-2.0
"""The questions of `python -m bench distance`: what is asked of a step, and what the answer may cost."""

from __future__ import annotations

import dataclasses

import hpccd_core as hc
from bench.core import measure
from bench.core.variants import Variant
from hpccd_ros.bench.sources import Step

PLAIN = "plain"
BY_DISTANCE = ("separation", "proximity")
OF_A_SNAPSHOT = ("intersections", "distances")
QUERIES = (*BY_DISTANCE, *OF_A_SNAPSHOT)


class Gaps(list):
    """Smallest distances, with a hash to compare calls by, as the other answers have one."""

    @property
    def hash(self) -> int:
        return hash(tuple((gap.distance, gap.kind, gap.features) for gap in self)) & (1 << 64) - 1


@dataclasses.dataclass(frozen=True)
class Question:
    """query: one of QUERIES, or PLAIN; distance: None where the query has none."""

    query: str
    distance: float | None = None

    @property
    def name(self) -> str:
        return self.query if self.distance is None else f"{self.query} {self.distance:g}"

    def variant(self, options: dict, change=None, name: str | None = None) -> Variant:
        """The detector that is asked this, under the name of the question where no other is given."""
        own = {"minimum_separation": self.distance} if self.query == "separation" else {}
        return Variant(name or self.name, {**options, **own}, change)

    def ask(self, detector: hc.Detector, step: Step):
        """Of one snapshot: the end of the step."""
        if self.query == "proximity":
            return detector.proximity(step.vertices_t1, self.distance)
        if self.query == "intersections":
            return detector.intersections(step.vertices_t1)
        if self.query == "distances":
            return Gaps(detector.distances(step.vertices_t1))
        return measure.detect(detector, step)


@dataclasses.dataclass(frozen=True)
class Allowance:
    """What an answer may cost: `of_plain` times plain detection, where it holds at most `of_contacts` times as many
    pairs as there are contacts."""

    of_plain: float
    of_contacts: float

    def us_a_pair_beyond(self, ms: float, pairs: float, plain_ms: float, contacts: float, threads: int) -> float | None:
        """Microseconds of a thread for each further pair, of the time above that; None where there is no such pair."""
        beyond = pairs - self.of_contacts * contacts
        return max(0.0, 1e3 * threads * (ms - self.of_plain * plain_ms) / beyond) if beyond > 0 else None


ALLOWED = {"separation": Allowance(2.0, 1.5), "proximity": Allowance(0.5, 1.0)}


def questions(queries: list[str], distances: list[float]) -> list[Question]:
    """Plain detection first, then the queries, each with every distance that it takes."""
    found = [Question(PLAIN)]
    for query in queries:
        found += [Question(query, d) for d in distances] if query in BY_DISTANCE else [Question(query)]
    return found
