# SPDX-License-Identifier: Apache-2.0
"""Read and change the life-cycle state of a running node, as `ros2 lifecycle` does.

  hpccd lifecycle get
  hpccd lifecycle deactivate && hpccd lifecycle cleanup    now parameters can change that are read when it is configured
  hpccd lifecycle configure && hpccd lifecycle activate
  hpccd lifecycle shutdown --node /arm/hpccd

Prints the state, after a transition the new one.
Exit status: 0 done, 1 the transition failed (the node's log says why), 2 the state has no such transition, or no node
is found.
"""

from hpccd_ros.commands.asking import add_node, add_wait, check_wait


def configure(parser):
    actions = ("get", "configure", "activate", "deactivate", "cleanup", "shutdown")
    parser.add_argument("action", choices=actions, help="get, or a transition")
    add_node(parser)
    add_wait(parser, "the node")


def run(args) -> int:
    check_wait(args)
    from hpccd_ros.introspection import life_cycle

    return life_cycle.main(args)
