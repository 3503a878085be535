# SPDX-License-Identifier: Apache-2.0
"""The cheapest setting that keeps bounds on wrong answers and on the error of times."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Sequence

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as output
from hpccd_ros.bench.settings import ALL, Setting

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
    return [o for mine in alike for o in unbeaten(mine, lambda o: (o.ms, o.wrong, o.values["error"]))]


def unbeaten(things: Sequence, values: Callable) -> list:
    """Those that no other one beats: none is as small in all values and smaller in one."""

    def beats(a, b) -> bool:
        return a != b and all(x <= y for x, y in zip(a, b, strict=True))

    return [thing for thing in things if not any(beats(values(other), values(thing)) for other in things)]


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


def choose(report, bounds: Sequence[Bound]) -> None:
    """Prints, and marks the rows of the chosen setting in the report, which fails where none keeps the bounds."""
    rows = [row for row in report.rows if row["part"] == "scene"]
    found = outcomes(rows)
    asked, contacts = _most_contacts(rows)
    taken = cheapest(found, bounds) if contacts > 0 else None
    _show(found, taken, bounds)
    wanted = ", ".join(map(str, bounds))
    more = "record more" if report.arguments.get("steps") == 0 else "take --steps 0 for all steps, or record more"
    if contacts == 0:
        report.failure(
            f"--choose: no contact in the steps measured (asked for: {asked}), so nothing tells the "
            f"settings apart; {more}"
        )
        return
    # A share smaller than one in all true contacts cannot be seen.
    unseen = [str(b) for b in bounds if b.quantity in ("misses", "inventions") and 0 < b.limit < 1 / contacts]
    if unseen:
        report.note(
            f"at most {contacts:g} true contacts (asked for: {asked}): whether {', '.join(unseen)} holds shows "
            f"in more of them only; {more}"
        )
    if taken is None:
        near = nearest(found, bounds)
        broken = ", ".join(f"{b.quantity} {near.values[b.quantity]:.2g}" for b in near.broken(bounds))
        report.failure(
            f"--choose: no setting keeps {wanted}; the nearest is {near.setting} with {broken}: "
            f"{near.setting.as_written()}"
        )
        return
    for row in rows:
        row["chosen"] = Setting(row["accuracy"], row["backend"], row["asked"]) == taken.setting
    print(f"{wanted}: {taken.setting.as_written()}")


def _most_contacts(rows) -> tuple[str, float]:
    """What was asked for with the fewest true contacts in the scene that has most of them, and how many."""
    most: dict[str, float] = {}
    for row in rows:
        most[row["asked"]] = max(most.get(row["asked"], 0), row["true"])
    return min(most.items(), key=lambda item: item[1])


def _show(found: Sequence[Outcome], taken: Outcome | None, bounds: Sequence[Bound]) -> None:
    unbeaten_ones = front(found)

    def verdict(o: Outcome) -> str:
        broken = ", ".join(map(str, o.broken(bounds)))
        return "chosen" if o is taken else f"breaks {broken}" if broken else "keeps them"

    output.show(
        "all settings, the cheapest first",
        ["accuracy", "backend", "asked", "ms a step", *QUANTITIES, "front", "bounds"],
        [
            [
                o.setting.accuracy,
                o.setting.backend,
                o.setting.asked,
                o.ms,
                *o.values.values(),
                "*" if o in unbeaten_ones else "",
                verdict(o),
            ]
            for o in sorted(found, key=lambda o: o.ms)
        ],
        "shares, of the worst scene, against the truth of the file or else the tier exact; front: no other setting "
        "that asks for the same is at least as good in everything",
    )
