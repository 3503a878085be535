# SPDX-License-Identifier: Apache-2.0
"""The cheapest setting that keeps bounds on wrong answers and on the error of times."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.core.settings import ALL, Setting
from hpccd_ros.bench.report import pareto

# What may be bounded. Of several scenes the worst counts.
QUANTITIES = {
    "misses": "share of the true contacts that are missed",
    "inventions": "share of the reported contacts that are not true",
    "late": "by how much a time is later than the true one, share of the step",
    "early": "by how much it is earlier",
    "error": "the larger of both",
}
EXAMPLE = '--choose "misses<1e-4, late<1e-3"'
# Settings that are as near are equally fast as far as the clock can tell: the more accurate one is taken.
AS_FAST = 1.05
_BOUND = re.compile(r"(?P<quantity>[a-z]+)\s*(?P<sign><=?)\s*(?P<limit>[^<=>\s]+)")


@dataclasses.dataclass(frozen=True)
class Bound:
    quantity: str
    limit: float
    strict: bool

    def keeps(self, value: float) -> bool:
        return value < self.limit if self.strict else value <= self.limit

    def __str__(self):
        return f"{self.quantity}{'<' if self.strict else '<='}{self.limit:g}"


def parse(text: str) -> list[Bound]:
    """Bounds as "misses<1e-4, late<=1e-3"; UserError for all else."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise UserError(f"--choose: name at least one bound, as in {EXAMPLE}")
    bounds: list[Bound] = []
    for word in words:
        found = _BOUND.fullmatch(word)
        if not found:
            raise UserError(
                f"--choose {word!r}: write QUANTITY<NUMBER or QUANTITY<=NUMBER, bounds with commas "
                f"between, as in {EXAMPLE}; quantities: {', '.join(QUANTITIES)}"
            )
        quantity, strict = found["quantity"], found["sign"] == "<"
        if quantity not in QUANTITIES:
            raise UserError(f"--choose {word!r}: {quantity} is not known; choose from {', '.join(QUANTITIES)}")
        if any(bound.quantity == quantity for bound in bounds):
            raise UserError(f"--choose: {quantity} is bounded twice; keep one of both")
        limit = _number(word, found["limit"])
        if strict and limit == 0:
            raise UserError(f"--choose {word!r}: nothing is below 0; write {quantity}<=0 for none at all")
        bounds.append(Bound(quantity, limit, strict))
    return bounds


def _number(word, text) -> float:
    try:
        limit = float(text)
    except ValueError:
        raise UserError(f"--choose {word!r}: {text} is not a number; write a share such as 1e-4") from None
    if not (math.isfinite(limit) and limit >= 0):
        raise UserError(f"--choose {word!r}: {text} bounds nothing; write a share such as 1e-4")
    return limit


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What one setting did on all scenes: ms of an average step, and the worst of each quantity."""

    setting: Setting
    ms: float
    values: dict[str, float]

    @property
    def wrong(self) -> float:
        return self.values["misses"] + self.values["inventions"]

    def broken(self, bounds: Sequence[Bound]) -> list[Bound]:
        return [bound for bound in bounds if not bound.keeps(self.values[bound.quantity])]


def outcomes(rows: Sequence[dict]) -> list[Outcome]:
    """Of the rows of `hpccd bench accuracy` about whole scenes: one for each setting that every scene was tested with,
    with the first of several instruction sets."""
    scenes = {row["scene"] for row in rows}
    of: dict[Setting, dict[str, dict]] = {}
    for row in rows:
        mine = of.setdefault(Setting(row["accuracy"], row["backend"], row.get("asked", ALL)), {})
        mine.setdefault(row["scene"], row)
    return [
        Outcome(
            setting,
            sum(row["step_ms"] for row in mine.values()) / len(mine),
            {name: max(_value(row, name) for row in mine.values()) for name in QUANTITIES},
        )
        for setting, mine in of.items()
        if mine.keys() == scenes
    ]


def _value(row, quantity) -> float:
    if quantity == "misses":
        return row["missed"] / max(1, row["true"])
    if quantity == "inventions":
        return row["invented"] / max(1, row["reported"])
    return row[{"late": "latest", "early": "earliest", "error": "toc_worst"}[quantity]]


def front(found: Sequence[Outcome]) -> list[Outcome]:
    """Those that no other one which asks for the same beats in time, in wrong answers and in the error of times."""
    asked = dict.fromkeys(o.setting.asked for o in found)
    alike = ([o for o in found if o.setting.asked == what] for what in asked)
    return [o for mine in alike for o in pareto.front(mine, lambda o: (o.ms, o.wrong, o.values["error"]))]


def cheapest(found: Sequence[Outcome], bounds: Sequence[Bound]) -> Outcome | None:
    """None where no setting keeps all bounds."""
    keep = [o for o in found if not o.broken(bounds)]
    if not keep:
        return None
    fastest = min(o.ms for o in keep)
    return min((o for o in keep if o.ms <= AS_FAST * fastest), key=lambda o: (o.wrong, o.values["error"], o.ms))


def nearest(found: Sequence[Outcome], bounds: Sequence[Bound]) -> Outcome:
    """The one that goes beyond its worst bound by the smallest factor."""

    def beyond(o: Outcome) -> float:
        least = 1e-300  # so that any answer is far beyond a bound of zero
        return max((o.values[b.quantity] / max(b.limit, least) for b in o.broken(bounds)), default=0.0)

    return min(found, key=lambda o: (beyond(o), o.ms))
