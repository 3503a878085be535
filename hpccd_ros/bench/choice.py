# SPDX-License-Identifier: Apache-2.0
"""Settings, the contacts that each of them must find, and the cheapest setting within bounds on its errors.

Options have the names of hpccd_core.Detector, which are those of the node's parameters too.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as output
from hpccd_ros.bench import truth


@dataclasses.dataclass(frozen=True, eq=False)
class Asked:
    """The requested contacts of a step. Errors are relative to these, not to all contacts: requesting fewer is a choice
    of the model. kinds: of contacts. one: "" for all of them, or one of them: "earliest", "any". of_meshes: only which
    different meshes touch, and when first; no mesh is tested against itself."""

    name: str
    options: dict = dataclasses.field(default_factory=dict)
    kinds: tuple[str, ...] = ("vf", "ee")
    one: str = ""
    of_meshes: bool = False

    def change(self, scene) -> None:
        """Change the core's scene to what is asked for."""
        if self.of_meshes:
            for name in scene.mesh_names:
                scene.ignore_pair(name, name)

    def errors(self, found, true: dict, step=None, faces=None) -> truth.Errors:
        """found: hpccd_core.Contacts; true: all contacts of the step. Of meshes: the step, and the faces (F,3) to which
        the result refers, by default those of the step."""
        if self.of_meshes:
            mesh = np.repeat(np.arange(len(step.meshes)), [mesh.n_vertices for mesh in step.meshes])
            own = step.faces()
            of_pairs = truth.of_pairs_of_meshes(found, true, mesh, own, own if faces is None else faces)
            if not self.one:
                return of_pairs
            there, here = of_pairs.true > 0, of_pairs.true - of_pairs.missed + of_pairs.invented > 0
            return truth.errors(int(there), int(there and not here), int(here and not there), np.empty(0))
        wanted = {key: values for key, values in true.items() if key.split("_")[0] in self.kinds}
        return truth.of_one(found, wanted, self.one == "earliest") if self.one else truth.of_scene(found, wanted)


# Options that request fewer contacts, one per line. Values are words, or tuples of words.
ASKED = (
    Asked("all"),
    Asked("first", {"report": "first"}, one="earliest"),
    Asked("any", {"report": "any"}, one="any"),
    Asked("vertex_face", {"features": ("vertex_face",)}, kinds=("vf",)),
    Asked("edge_edge", {"features": ("edge_edge",)}, kinds=("ee",)),
    Asked("meshes", of_meshes=True),
    Asked("any_meshes", {"report": "any"}, one="any", of_meshes=True),
)
ALL, OF_MESHES = ASKED[0].name, tuple(asked.name for asked in ASKED if asked.of_meshes)
FULL = 1.0  # detail: the part of the faces that stays
# Quantities that may be bounded, as --help explains. The worst of several scenes counts.
QUANTITIES = {
    "misses": lambda row: row["missed"] / max(1, row["true"]),
    "spurious": lambda row: row["invented"] / max(1, row["reported"]),
    "late": lambda row: row["latest"],
    "early": lambda row: row["earliest"],
    "error": lambda row: row["toc_worst"],
    "deviation": lambda row: row.get("deviation", 0.0),
}
EXAMPLE = '--choose "misses<1e-4, late<1e-3"'
# Settings within this ratio count as equally fast: the more accurate one is selected.
AS_FAST = 1.05
_BOUND = re.compile(r"(?P<quantity>[a-z]+)\s*(?P<sign><=?)\s*(?P<limit>[^<=>\s]+)")


@dataclasses.dataclass(frozen=True)
class Setting:
    """A tier, a backend, the requested contacts, and the detail of all meshes."""

    accuracy: str
    backend: str
    asked: str = ALL
    detail: float = FULL

    def __str__(self):
        detail = "" if self.detail == FULL else f", detail {self.detail:g}"
        return f"{self.accuracy} on {self.backend}" + ("" if self.asked == ALL else f", {self.asked}") + detail

    @staticmethod
    def of(row: dict) -> Setting:
        return Setting(row["accuracy"], row["backend"], row.get("asked", ALL), row.get("detail", FULL))

    def as_written(self) -> str:
        """The setting as Python code and as parameters of the node."""
        asked = next(a.options for a in ASKED if a.name == self.asked)
        options = {"accuracy": self.accuracy, "backend": self.backend, **asked}
        python, node = [], []
        for name, value in options.items():
            several = isinstance(value, tuple)
            python.append(f'{name}="{value}"' if isinstance(value, str) else f"{name}={value!r}")
            node.append(f'-p {name}:="[{", ".join(value)}]"' if several else f"-p {name}:={value}")
        if self.detail != FULL:
            python.append(f"detail={self.detail:g}")
            node.append(f'-p stop_detail:="[NAME:{self.detail:g}]" for each mesh NAME')
        alone = "; all meshes with self_collision false" if self.asked in OF_MESHES else ""
        return f"hc.Detector(scene, {', '.join(python)}); hpccd_node --ros-args {' '.join(node)}{alone}"


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
    """Parse bounds such as "misses<1e-4, late<=1e-3"; UserError for anything else."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise UserError(f"--choose: name at least one bound, as in {EXAMPLE}")
    bounds: dict[str, Bound] = {}
    for word in words:
        found = _BOUND.fullmatch(word)
        if not found:
            raise UserError(
                f"--choose {word!r}: write QUANTITY<NUMBER or QUANTITY<=NUMBER, bounds with commas "
                f"between, as in {EXAMPLE}; quantities: {', '.join(QUANTITIES)}"
            )
        quantity, sign, number = found.groups()
        if quantity not in QUANTITIES:
            raise UserError(f"--choose {word!r}: {quantity} is not known; choose from {', '.join(QUANTITIES)}")
        if quantity in bounds:
            raise UserError(f"--choose: {quantity} is bounded twice; keep one bound")
        try:
            limit = float(number)
        except ValueError:
            raise UserError(f"--choose {word!r}: {number} is not a number; write a share such as 1e-4") from None
        if not (math.isfinite(limit) and limit >= 0):
            raise UserError(f"--choose {word!r}: {number} bounds nothing; write a share such as 1e-4")
        if sign == "<" and limit == 0:
            raise UserError(f"--choose {word!r}: nothing is below 0; write {quantity}<=0 for none at all")
        bounds[quantity] = Bound(quantity, limit, sign == "<")
    return list(bounds.values())


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Results of one setting on all scenes: ms of an average step, and the worst of each quantity."""

    setting: Setting
    ms: float
    values: dict[str, float]

    @property
    def wrong(self) -> float:
        return self.values["misses"] + self.values["spurious"]

    def broken(self, bounds: Sequence[Bound]) -> list[Bound]:
        return [bound for bound in bounds if not bound.keeps(self.values[bound.quantity])]


def outcomes(rows: Sequence[dict]) -> list[Outcome]:
    """From rows of `hpccd bench accuracy` about whole scenes: one for each setting that every scene was tested with,
    with the first of several instruction sets."""
    of: dict[Setting, dict[str, dict]] = {}
    for row in rows:
        of.setdefault(Setting.of(row), {}).setdefault(row["scene"], row)
    found = {setting: mine.values() for setting, mine in of.items() if mine.keys() == {row["scene"] for row in rows}}
    return [
        Outcome(
            setting,
            sum(row["step_ms"] for row in mine) / len(mine),
            {name: max(map(value, mine)) for name, value in QUANTITIES.items()},
        )
        for setting, mine in found.items()
    ]


def front(found: Sequence[Outcome]) -> list[Outcome]:
    """The Pareto front: settings that no other one which asks for the same beats in time, in wrong results, in the
    error of times and in the deviation of the meshes."""

    def values(o: Outcome) -> tuple[float, ...]:
        return o.ms, o.wrong, o.values["error"], o.values["deviation"]

    def beats(a: Outcome, b: Outcome) -> bool:
        alike = a.setting.asked == b.setting.asked and values(a) != values(b)
        return alike and all(x <= y for x, y in zip(values(a), values(b), strict=True))

    return [o for o in found if not any(beats(other, o) for other in found)]


def cheapest(found: Sequence[Outcome], bounds: Sequence[Bound]) -> Outcome | None:
    """None if no setting is within all bounds."""
    keep = [o for o in found if not o.broken(bounds)]
    fast = [o for o in keep if o.ms <= AS_FAST * min(o.ms for o in keep)]
    return min(fast, key=lambda o: (o.wrong, o.values["error"], o.ms), default=None)


def nearest(found: Sequence[Outcome], bounds: Sequence[Bound]) -> Outcome:
    """The setting that exceeds its worst bound by the smallest factor."""

    def beyond(o: Outcome) -> float:
        least = 1e-300  # so that any result is far beyond a bound of zero
        return max((o.values[b.quantity] / max(b.limit, least) for b in o.broken(bounds)), default=0.0)

    return min(found, key=lambda o: (beyond(o), o.ms))


def choose(report, bounds: Sequence[Bound]) -> None:
    """Prints, and marks the rows of the chosen setting in the report, which fails where none keeps the bounds."""
    rows = report.rows
    if not any(row["true"] for row in rows if row["asked"] in OF_MESHES):  # coarse meshes cannot be judged
        rows = [row for row in rows if row["asked"] not in OF_MESHES] or rows
        if len(rows) < len(report.rows):
            report.note("no two meshes touch in the steps measured: coarse meshes are left out of the choice")
    found = outcomes(rows)
    # The request with the fewest true contacts in the scene that has most of them, and their number.
    most: dict[str, float] = {}
    for row in rows:
        most[row["asked"]] = max(most.get(row["asked"], 0), row["true"])
    asked, contacts = min(most.items(), key=lambda item: item[1])
    taken = cheapest(found, bounds) if contacts > 0 else None
    _show(found, taken, bounds)
    wanted = ", ".join(map(str, bounds))
    more = "record more" if report.arguments.get("steps") == 0 else "take --steps 0 for all steps, or record more"
    if contacts == 0:
        nothing = f"no contact in the steps measured (asked for: {asked}), so nothing tells the settings apart"
        report.failure(f"--choose: {nothing}; {more}")
        return
    # A share smaller than one in all true contacts cannot be seen.
    unseen = [str(b) for b in bounds if b.quantity in ("misses", "spurious") and 0 < b.limit < 1 / contacts]
    if unseen:
        report.note(
            f"at most {contacts:g} true contacts (asked for: {asked}): whether {', '.join(unseen)} holds shows "
            f"in more of them only; {more}"
        )
    if taken is None:
        near = nearest(found, bounds)
        broken = ", ".join(f"{b.quantity} {near.values[b.quantity]:.2g}" for b in near.broken(bounds))
        it = f"{near.setting} with {broken}: {near.setting.as_written()}"
        report.failure(f"--choose: no setting keeps {wanted}; the nearest is {it}")
        return
    for row in rows:
        row["chosen"] = Setting.of(row) == taken.setting
    print(f"{wanted}: {taken.setting.as_written()}")


def _show(found: Sequence[Outcome], taken: Outcome | None, bounds: Sequence[Bound]) -> None:
    unbeaten, rows = front(found), []
    for o in sorted(found, key=lambda o: o.ms):
        broken = ", ".join(map(str, o.broken(bounds)))
        verdict = "chosen" if o is taken else f"breaks {broken}" if broken else "keeps them"
        setting = {**dataclasses.asdict(o.setting), "ms a step": o.ms, **o.values}
        rows.append({**setting, "Pareto front": "*" if o in unbeaten else "", "bounds": verdict})
    output.show(
        "all settings, the cheapest first",
        {key: key for key in rows[0]},
        rows,
        "shares, of the worst scene, against the truth of the file or else the tier exact; Pareto front: no other "
        "setting that asks for the same is at least as good in everything",
    )
