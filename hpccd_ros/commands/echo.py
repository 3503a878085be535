# SPDX-License-Identifier: Apache-2.0
"""Print the messages of a topic, of any message type that is installed here. The type is that of the topic's
publishers, and the quality of service is what they offer.

  hpccd echo                               the topics that there are, with their types
  hpccd echo /contacts                     every message, until Ctrl-C
  hpccd echo /meshes/cloth/vertices --once
  hpccd echo /diagnostics -n 5
  hpccd echo /robot_description --once --full
                                           long arrays and texts whole

The text has the form of YAML, with a line --- after each message.
"""

from hpccd_ros.base.errors import UserError, require_utf8
from hpccd_ros.commands.asking import add_wait, check_wait


def configure(parser):
    parser.add_argument("topic", nargs="?", metavar="TOPIC", help="for example /contacts (default: list them)")
    how_many = parser.add_mutually_exclusive_group()
    how_many.add_argument("--once", action="store_const", const=1, dest="count", help="one message, then end")
    how_many.add_argument("-n", type=int, dest="count", metavar="N", help="end after N messages")
    parser.add_argument("--full", action="store_true", help="arrays and texts of any length whole")
    add_wait(parser, "the topic to appear")


def run(args) -> int:
    if args.count is not None and args.count < 1:
        raise UserError(f"-n {args.count}: must be at least 1")
    check_wait(args)
    require_utf8(args.topic)
    from hpccd_ros.introspection import echo

    return echo.main(args)
