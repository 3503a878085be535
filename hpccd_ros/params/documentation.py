# SPDX-License-Identifier: Apache-2.0
"""docs/parameters.md, generated from table.py.

``python -m hpccd_ros.params.documentation > docs/parameters.md``
"""

from hpccd_ros.middleware.qos_overrides import DEEPEST
from hpccd_ros.params.table import (
    ALWAYS,
    MESH_ROWS,
    NEVER,
    NODE_GROUPS,
    PAIR_ROWS,
    PLANE_ROWS,
    ROBOT_ROWS,
    UNCONFIGURED,
    Row,
)
from hpccd_ros.params.values import allowed

_HEAD = """\
# Parameters of the node

<!-- Made by `python -m hpccd_ros.params.documentation > docs/parameters.md`; a test compares. -->

[config/hpccd.yaml](../config/hpccd.yaml) contains all parameters with their defaults. Copy it, enter your meshes, and
start the node with it:

<!-- not run: my.yaml is yours -->
```sh
hpccd_node --ros-args --params-file my.yaml
```

`-p accuracy:=balanced` on the command line sets one parameter. [Profiles](node.md#profiles) are parameter files for
common purposes. The node does not start (exit status 2) with an invalid value, or with an unknown name that resembles
one of these or begins with `mesh.`, `robot.`, `plane.`, `pairs.` or `stop`; it prints the reason and the nearest name.
Any other unknown name is taken for a parameter of another node: it has no effect, and the log has a warning. In a file
for several nodes, write the parameters of each under the name of the node, not under `/**`.

**When a parameter can change:**

- *at run time*: at any time, through the node's parameter services. An invalid change is rejected with a reason.
- *unconfigured*: while the node is unconfigured. Deactivate, clean up, set it, configure and activate again.
- *start*: only at the start.

An empty list of strings is written `[""]`, because YAML parameters have no empty one. A string with colons is quoted,
twice on the command line: `-p pair_separation:="['robot:cloth:0.01']"`. A float may be written without a decimal point,
and so may all numbers of a list: `[0, 0, 1, 0, 0, 0, 1]`. ROS rejects a list that mixes both forms.
"""

_QUALITY_OF_SERVICE = """\
## Quality of service

These parameters change the QoS of a topic, given by its full name with the namespace:

| parameter | type | allowed | can change |
|---|---|---|---|
| `qos_overrides.TOPIC.KIND.history` | string | `keep_last`, `keep_all` | start |
| `qos_overrides.TOPIC.KIND.depth` | int | 1 .. {deepest:,} | start |
| `qos_overrides.TOPIC.KIND.reliability` | string | `reliable`, `best_effort` | start |

KIND is `publisher` for outputs and `subscription` for inputs, for example
`qos_overrides./contacts.publisher.reliability: best_effort` or
`qos_overrides./meshes/cloth/vertices.subscription.depth: 50`. The node's own recording uses the same QoS.
"""

_CHANGE = {ALWAYS: "at run time", UNCONFIGURED: "unconfigured", NEVER: "start"}


def page() -> str:
    """The page in Markdown."""
    groups = [(heading, "", rows) for heading, rows in NODE_GROUPS.items()]
    groups.append(("Meshes: each NAME in `meshes`", "mesh.NAME.", MESH_ROWS))
    groups.append(("Robots: each NAME in `robots`", "robot.NAME.", ROBOT_ROWS))
    groups.append(("Planes: each NAME in `planes`", "plane.NAME.", PLANE_ROWS))
    groups.append(("Pairs of meshes: each with a NAME of your choice", "pairs.NAME.", PAIR_ROWS))
    return "\n".join([_HEAD, *(_group(*group) for group in groups), _QUALITY_OF_SERVICE.format(deepest=DEEPEST)])


def _group(heading: str, prefix: str, rows: tuple[Row, ...]) -> str:
    lines = [
        f"## {heading}",
        "",
        "| parameter | type | default | allowed | unit | can change | meaning |",
        "|---|---|---|---|---|---|---|",
        *(_line(prefix, row) for row in rows),
    ]
    return "\n".join(lines) + "\n"


def _line(prefix: str, row: Row) -> str:
    cells = (f"`{prefix}{row.name}`", row.kind, _default(row), allowed(row), row.unit, _CHANGE[row.change], row.text)
    return f"| {' | '.join(cells)} |"


def _default(row: Row) -> str:
    if row.default is None:
        return "not set"
    return f"`{str(row.default).lower()}`" if row.kind == "bool" else f"`{row.default!r}`".replace("'", '"')


if __name__ == "__main__":
    print(page(), end="")
