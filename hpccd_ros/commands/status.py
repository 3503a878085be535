# SPDX-License-Identifier: Apache-2.0
"""Show the state of a running node: its life-cycle state, what each mesh receives and when, the rate of results, what
was rejected last and why, whether stop is true, and, in words, what is wrong and how to fix it.

  hpccd status                  every hpccd node on this ROS_DOMAIN_ID
  hpccd status /arm/hpccd       this one
  hpccd status --json           the same for programs
  ROS_DOMAIN_ID=7 hpccd status  on another domain

Waits for the next message of the node on /diagnostics, by default at most a second away.
Exit status: 0 nothing is wrong, 1 something is wrong, 2 no node is found.
"""

from hpccd_ros.commands.asking import add_wait, check_wait


def configure(parser):
    named = parser.add_mutually_exclusive_group()
    named.add_argument("node", nargs="?", default="", metavar="NODE", help="full name of a node (default: all)")
    named.add_argument("--node", default="", dest="named", metavar="NODE", help="the same, as in other commands")
    parser.add_argument("--json", action="store_true", help="as a JSON list with one object a node")
    add_wait(parser, "a node, and for its diagnostics")


def run(args) -> int:
    check_wait(args)
    args.node = args.node or args.named
    from hpccd_ros.introspection import status

    return status.main(args)
