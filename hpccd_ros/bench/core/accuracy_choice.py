# SPDX-License-Identifier: Apache-2.0
"""`hpccd bench accuracy --choose`: all settings in a table, the front, and the one to take."""

from __future__ import annotations

from collections.abc import Sequence

from hpccd_ros.bench.core import choice
from hpccd_ros.bench.core.choice import Bound, Outcome
from hpccd_ros.bench.core.settings import Setting
from hpccd_ros.bench.report import table


def choose(report, bounds: Sequence[Bound]) -> None:
    """Prints, and marks the rows of the chosen setting in the report, which fails where none keeps the bounds."""
    rows = [row for row in report.rows if row["part"] == "scene"]
    found = choice.outcomes(rows)
    asked, contacts = _most_contacts(rows)
    taken = choice.cheapest(found, bounds) if contacts > 0 else None
    _show(found, taken, bounds)
    wanted = ", ".join(map(str, bounds))
    if contacts == 0:
        report.failure(
            f"--choose: no contact in the steps measured (asked for: {asked}), so nothing tells the "
            "settings apart; take --steps 0 for all steps, or record more"
        )
        return
    # A share smaller than one in all true contacts cannot be seen.
    unseen = [str(b) for b in bounds if b.quantity in ("misses", "inventions") and 0 < b.limit < 1 / contacts]
    if unseen:
        report.note(
            f"at most {contacts:g} true contacts (asked for: {asked}): whether {', '.join(unseen)} holds shows "
            "in more of them only; take --steps 0 for all steps, or record more"
        )
    if taken is None:
        near = choice.nearest(found, bounds)
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
    front = choice.front(found)

    def verdict(o: Outcome) -> str:
        broken = ", ".join(map(str, o.broken(bounds)))
        return "chosen" if o is taken else f"breaks {broken}" if broken else "keeps them"

    table.show(
        "all settings, the cheapest first",
        ["accuracy", "backend", "asked", "ms a step", *choice.QUANTITIES, "front", "bounds"],
        [
            [
                o.setting.accuracy,
                o.setting.backend,
                o.setting.asked,
                o.ms,
                *o.values.values(),
                "*" if o in front else "",
                verdict(o),
            ]
            for o in sorted(found, key=lambda o: o.ms)
        ],
        "shares, of the worst scene, against the truth of the file or else the tier exact; front: no other setting "
        "that asks for the same is at least as good in everything",
    )
