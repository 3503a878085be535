# SPDX-License-Identifier: Apache-2.0
"""What a user may set, and what each way to ask less of a step has to find: one list for benchmarks and pictures.

Options have the names of hpccd_core.Detector, which are those of the node's parameters too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from hpccd_ros.bench import truth
from hpccd_ros.bench.truth import Errors


@dataclasses.dataclass(frozen=True, eq=False)
class Asked:
    """What is asked of a step. Wrong answers count against this, not against all contacts: to ask for less is a choice
    of the modelling.

    kinds  of contacts that are asked for
    one    "": all of them; "earliest", "any": one of them
    """

    name: str
    options: dict = dataclasses.field(default_factory=dict)
    kinds: tuple[str, ...] = ("vf", "ee")
    one: str = ""

    def errors(self, found, true: dict) -> Errors:
        """found: hpccd_core.Contacts; true: all contacts of the step."""
        wanted = {key: values for key, values in true.items() if key.split("_")[0] in self.kinds}
        return truth.of_one(found, wanted, self.one == "earliest") if self.one else truth.of_scene(found, wanted)


# A further option that asks for less is a line here. Its values are words, or tuples of words.
ASKED = (
    Asked("all"),
    Asked("first", {"report": "first"}, one="earliest"),
    Asked("any", {"report": "any"}, one="any"),
    Asked("vertex_face", {"features": ("vertex_face",)}, kinds=("vf",)),
    Asked("edge_edge", {"features": ("edge_edge",)}, kinds=("ee",)),
)
ALL = ASKED[0].name


def asked(names: Sequence[str]) -> list[Asked]:
    return [a for a in ASKED if a.name in names]


@dataclasses.dataclass(frozen=True)
class Setting:
    """A tier, a backend, and what is asked."""

    accuracy: str
    backend: str
    asked: str = ALL

    def options(self) -> dict:
        (what,) = asked([self.asked])
        return {"accuracy": self.accuracy, "backend": self.backend, **what.options}

    def __str__(self):
        return f"{self.accuracy} on {self.backend}" + ("" if self.asked == ALL else f", {self.asked}")

    def as_written(self) -> str:
        """In Python and as parameters of the node."""
        python = ", ".join(f"{name}={_quoted(value)}" for name, value in self.options().items())
        node = " ".join(f"-p {name}:={_as_parameter(value)}" for name, value in self.options().items())
        return f"hc.Detector(scene, {python}); hpccd_node --ros-args {node}"


def _quoted(value) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _as_parameter(value) -> str:
    return value if isinstance(value, str) else f'"[{", ".join(value)}]"'
