# SPDX-License-Identifier: Apache-2.0
"""Random calls of all interfaces of a node, valid and hostile; the same calls for the same seed."""

import importlib
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
from hpccd.msg import MeshVertices
from hpccd.srv import Detect
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterValue
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import mesh_messages
from hpccd_ros.params.table import MESH_ROWS, NODE_ROWS, Row

# This transition ends the node's life cycle, so it is requested last.
SHUTDOWN = {
    Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    Transition.TRANSITION_INACTIVE_SHUTDOWN,
    Transition.TRANSITION_ACTIVE_SHUTDOWN,
}
# Calls that leave each state.
ONWARD = {
    "unconfigured": (Transition.TRANSITION_CONFIGURE,),
    "inactive": (Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CLEANUP),
    "active": (Transition.TRANSITION_DEACTIVATE,),
}
TEXTS = ("", "x", "cloth", "/", "..", "%", "a b", "ü€😀", "a:b:c", "-1", "nan", "x" * 300, "y" * 100_000)
NUMBERS = (0, 1, -1, 2, 2**31, -(2**63), 2**63 - 1)
FLOATS = (0.0, -0.0, 1e-300, 1e300, -1.0, math.nan, math.inf, -math.inf, 0.5)
LABELS = ("configure", "activate", "deactivate", "cleanup", "create", "destroy", "transition_success", "no such")


class Monkey:
    """folder: for recordings and mesh files; meshes: of the node; n: their sheets have n * n vertices."""

    def __init__(self, seed: int, folder: Path, meshes: list[str], n: int) -> None:
        self.random = random.Random(seed)
        self._folder = folder
        self._meshes = meshes
        self._n = n
        self.rows = {row.name: row for row in NODE_ROWS}
        self.rows |= {f"mesh.{mesh}.{row.name}": row for mesh in meshes for row in MESH_ROWS}
        self._mesh_file = folder / "sheet.obj"
        lines = [f"v {x} {y} {z}" for x, y, z in sheet_positions(n, 0)]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in sheet_faces(n)]
        self._mesh_file.write_text("\n".join(lines))

    def request(self, kind: type, state: str) -> Any:
        """A request of the service type `kind`; state: of the node, as far as it is known."""
        request = kind.Request()
        if kind is ChangeState:
            request.transition = self._transition(state)
        elif kind is Detect:
            return self._detect()
        for field, type_name in kind.Request.get_fields_and_field_types().items():
            if field == "parameters":
                request.parameters = [self._parameter() for _ in range(self.random.choice((0, 1, 1, 1, 2, 5)))]
            elif field in ("names", "prefixes"):
                names = (*self.rows, "use_sim_time", "mesh", *TEXTS)
                setattr(request, field, self.random.choices(names, k=self.random.choice((0, 1, 3, 50))))
            elif type_name == "string":
                setattr(request, field, self.random.choice(("hpccd/msg/ContactArray", "RIHS01_00", *TEXTS)))
            elif type_name == "uint64":
                setattr(request, field, self.random.choice((0, 1, 2, 2**64 - 1)))
        return request

    def _transition(self, state: str) -> Transition:
        if self.random.random() < (0.1 if state == "active" else 0.6):  # active most of the time
            return Transition(id=self.random.choice(ONWARD[state]))
        if self.random.random() < 0.3:
            return Transition(id=self.random.randrange(256), label=self.random.choice(LABELS))
        return Transition(id=self.random.choice([k for k in range(256) if k not in SHUTDOWN]))

    def _parameter(self) -> Parameter:
        name = self.random.choice([*self.rows, "use_sim_time", "start_type_description_service", "no.such", ""])
        if name in self.rows and self.random.random() < 0.6:
            return Parameter(name=name, value=parameter_value(self.rows[name].kind, self._sensible(name)))
        value = ParameterValue(
            type=self.random.choice((*range(11), 255)),
            bool_value=self.random.random() < 0.5,
            integer_value=self.random.choice(NUMBERS),
            double_value=self.random.choice(FLOATS),
            string_value=self._place() if name == "record" else self.random.choice(TEXTS),
            byte_array_value=[b"\0", b"\xff"],
            bool_array_value=[True, False],
            integer_array_value=self.random.choices(NUMBERS, k=7),
            double_array_value=self.random.choices(FLOATS, k=self.random.choice((0, 7, 8))),
            string_array_value=self.random.choices(TEXTS, k=self.random.choice((0, 1, 3))),
        )
        if name in self.rows and self.random.random() < 0.7:  # hostile, but of the right type
            value.type = parameter_value(self.rows[name].kind, self.rows[name].default).type
        return Parameter(name=name, value=value)

    def _sensible(self, name: str) -> Any:
        row, choose = self.rows[name], self.random.choice
        if name == "record":
            return self._place()
        if self.random.random() < 0.7:  # that frames get through most of the time
            return row.default
        if name.endswith(".file"):
            return choose(("", "", str(self._mesh_file), "/nowhere.obj", "~nosuchuser/x.obj", "/" + "x" * 300 + ".obj"))
        if name.endswith(".pose"):
            return choose(([0.0] * 6 + [1.0], [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.0], [0.0] * 7, []))
        if name == "ignored_pairs":
            return choose(([], [":".join(self._meshes)], ["cloth:nothing"]))
        if name == "pair_accuracy":
            return choose(([], [":".join((*self._meshes, "fast"))], ["cloth:cloth:exact"], ["cloth"]))
        if name == "pair_features":
            return choose(([], [":".join((*self._meshes, "vertex_face"))], ["cloth:cloth:edge_edge"], ["cloth:cloth"]))
        return sensible(row, self.random)

    def _place(self) -> str:
        here = self._folder / f"run{self.random.randrange(1000)}"
        return self.random.choice(
            ("", "", "", f"{here}.mcap", str(here), f"{here}-%H%M%S.mcap", f"{here}/deep/er.mcap", "/", "~nosuchuser/x")
            + (str(here) + "x" * 300, f"{here}/" + "d/" * 2000 + "x")
        )

    def _detect(self) -> Detect.Request:
        choose, n = self.random.choice, self._n
        odd = choose((True, False))
        names = choose((self._meshes, ["cloth"], ["other"], [], ["cloth", "cloth"] if odd else ["other", "cloth"]))
        request = Detect.Request(
            mesh_names=names,
            accuracy=choose(("", "", "fast", "balanced", "conservative", "exact", "sloppy" if odd else "")),
            report=choose(("", "all", "first", "any", "some" if odd else "")),
            query=choose(("", "contacts", "collision_free_step", "distances", "nearest" if odd else "")),
            features=choose(([], [], ["vertex_face"], ["edge_edge", "vertex_face"], [""] if odd else [])),
            time_limit=choose(FLOATS if odd else (0.0, 5.0, 1e10)),
        )
        many = len(names or self._meshes)
        if choose((True, not odd)):
            request.topologies = [mesh_messages.topology_message(sheet_faces(n), n * n) for _ in range(many)]
        for k in range(many):
            for step, ends in ((0, request.start), (1, request.end)):
                positions = sheet_positions(n, step + 2 * k, offset=0.003 * k, dtype=choose((np.float32, np.float64)))
                ends.append(mesh_messages.vertices_message(positions, step))
        if not odd:
            return request
        if self.random.random() < 0.3:
            self.spoil(choose([*request.start, *request.end]))
        if self.random.random() < 0.1:
            request.end = request.end[1:]
        if request.topologies and self.random.random() < 0.2:
            faces = request.topologies[0].faces
            faces[0] = choose((faces[1], n * n, 2**32 - 1))
        return request

    def spoil(self, message: MeshVertices) -> MeshVertices:
        """Make the message invalid in most cases."""
        field = "vertices_f32" if message.vertices_f32 else "vertices_f64"
        values = getattr(message, field)
        kind = self.random.randrange(6)
        if kind == 0 and values:
            values[self.random.randrange(len(values))] = self.random.choice((math.nan, math.inf, 1e30))
        elif kind == 1:
            setattr(message, field, values[: self.random.randrange(max(1, len(values)))])
        elif kind == 2:
            message.topology_version = self.random.choice((1, 2**32 - 1))
        elif kind == 3:
            message.header.frame_id = self.random.choice(TEXTS)
        elif kind == 4:
            message.header.stamp.sec = self.random.choice((-(2**31), -1, 2**31 - 1))
        else:
            message.vertices_f32 = message.vertices_f64 = []
        return message


def sensible(row: Row, generator: random.Random) -> Any:
    """A value that the row allows."""
    if row.kind == "bool":
        return generator.random() < 0.5
    if row.choices:
        return generator.sample(row.choices, k=1) if row.kind == "string[]" else generator.choice(row.choices)
    if row.span is not None:
        # A thousand threads, or a report an hour, would only make the test slow.
        low, high = row.span[0], min(row.span[1], 8 if row.kind == "int" else 1.0)
        return generator.randint(int(low), int(max(low, high))) if row.kind == "int" else generator.uniform(low, high)
    return row.default if row.kind != "string[]" else []


def parameter_value(kind: str, value: Any) -> ParameterValue:
    """`value` as a parameter of the table's type `kind`."""
    number, field = {
        "bool": (1, "bool_value"),
        "int": (2, "integer_value"),
        "float": (3, "double_value"),
        "string": (4, "string_value"),
        "float[]": (8, "double_array_value"),
        "string[]": (9, "string_array_value"),
    }[kind]
    return ParameterValue(type=number, **{field: value})


def service_class(type_name: str) -> type:
    """The class of "package/srv/Name"."""
    package, _, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.srv"), name)
