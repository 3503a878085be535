# SPDX-License-Identifier: Apache-2.0
"""The page of the node's parameters, made from table.py.

``python -m hpccd_ros.params.documentation > docs/parameters.md``
"""

from hpccd_ros.middleware.qos_overrides import DEEPEST
from hpccd_ros.params.table import ALWAYS, MESH_ROWS, NEVER, NODE_GROUPS, PAIR_ROWS, ROBOT_ROWS, UNCONFIGURED, Row
from hpccd_ros.params.values import allowed

_HEAD = """\
# Parameters of the node

<!-- Made by `python -m hpccd_ros.params.documentation > docs/parameters.md`; a test compares. -->

For those who configure `hpccd_node`. [config/hpccd.yaml](../config/hpccd.yaml) holds them all with their defaults. Copy
it, put your meshes in, and start the node with it:

```sh
hpccd_node --ros-args --params-file my.yaml
```

Or give one on the command line: `-p accuracy:=balanced`. Files for a purpose: [profiles](node.md#profiles).
A value that is not allowed ends the start with one sentence (status 2). An unknown name is warned of.

**When a parameter can change:**

- *at run time*: at any moment, by the node's parameter services. A change that is refused says why.
- *unconfigured*: it is read when the node is configured. Deactivate, clean up, set it, configure and activate again.
- *start*: only given at the start.

An empty list of strings is written `[""]`: YAML parameters know no empty one. A text with colons is quoted, on the
command line twice: `-p pair_separation:="['robot:cloth:0.01']"`. A float may be written without a point, and so may all
numbers of a list: `[0, 0, 1, 0, 0, 0, 1]`. A list in which some have a point and some have none is refused by ROS.
"""

_QUALITY_OF_SERVICE = """\
## Quality of service

Every topic may be given another QoS, by its whole name, namespace included:

| parameter | type | allowed | can change |
|---|---|---|---|
| `qos_overrides.TOPIC.KIND.history` | string | `keep_last`, `keep_all` | start |
| `qos_overrides.TOPIC.KIND.depth` | int | 1 .. {deepest:,} | start |
| `qos_overrides.TOPIC.KIND.reliability` | string | `reliable`, `best_effort` | start |

KIND is `publisher` for what the node publishes, `subscription` for what it listens to.
For example `qos_overrides./contacts.publisher.reliability: best_effort`, or
`qos_overrides./meshes/cloth/vertices.subscription.depth: 50`. The node's own recording asks as the node does.
"""

_CHANGE = {ALWAYS: "at run time", UNCONFIGURED: "unconfigured", NEVER: "start"}


def page() -> str:
    """The whole page in Markdown."""
    groups = [(heading, "", rows) for heading, rows in NODE_GROUPS.items()]
    groups.append(("Of each mesh NAME in `meshes`", "mesh.NAME.", MESH_ROWS))
    groups.append(("Of each robot NAME in `robots`", "robot.NAME.", ROBOT_ROWS))
    groups.append(("Of pairs of meshes, each with a NAME of your choice", "pairs.NAME.", PAIR_ROWS))
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
