# SPDX-License-Identifier: Apache-2.0
"""Read and set the parameters of a running node. The value is typed as YAML types it: true, 5, 0.1, exact, [points].

  hpccd param list                          all parameters with their values
  hpccd param list mesh.cloth               those of mesh cloth
  hpccd param get stop_distance
  hpccd param set accuracy balanced
  hpccd param set outputs "[points, normals]"
  hpccd param set pair_separation "['robot:cloth:0.01']"
  hpccd param set stop_distance 0.05 --node /arm/hpccd

A value that the node rejects is not set, and the reason is shown (exit status 2). docs/parameters.md lists all
parameters and when each can change.
"""

from hpccd_ros.base.errors import UserError, require_utf8
from hpccd_ros.commands.asking import add_node, add_wait, check_wait, node_named

# Action -> how many of NAME and VALUE it takes, at least and at most.
_ACTIONS = {"get": (1, 1), "set": (2, 2), "list": (0, 1)}


def configure(parser):
    parser.add_argument("action", choices=_ACTIONS, help="what to do")
    parser.add_argument("name", nargs="?", metavar="NAME", help="of a parameter; of list: its beginning")
    parser.add_argument("value", nargs="?", metavar="VALUE", help="of set, in YAML")
    add_node(parser)
    add_wait(parser, "the node")


def run(args) -> int:
    given = [text for text in (args.name, args.value) if text is not None]
    if node := node_named(given[:1]):
        raise UserError(f"{args.action}: {node} is no parameter; name the node with --node {node}")
    least, most = _ACTIONS[args.action]
    if not least <= len(given) <= most:
        raise UserError(
            f"{args.action}: got {' '.join(given) or 'no NAME'}; write hpccd param "
            + {"get": "get NAME", "set": "set NAME VALUE", "list": "list [NAME]"}[args.action]
        )
    check_wait(args)
    require_utf8(*given)
    from hpccd_ros.introspection import parameter_values

    return parameter_values.main(args)
