# SPDX-License-Identifier: Apache-2.0
"""Record the inputs of a running node (topologies, vertices, points, transforms that it uses), its results (contacts,
smallest distances, pairs, stop), both as the bytes on the wire, and its parameters.

  hpccd record                          the node /hpccd, into ./hpccd-<date>.mcap, until Ctrl-C
  hpccd record -o run.mcap --node /arm/hpccd --duration 60
  hpccd record -o run --split-size 512 --compression zstd
                                        a folder run/ in rosbag2's layout, with a new file every 512 MB
                                        (before compression)

`hpccd replay` verifies a recording. Ctrl-C (SIGINT) and SIGTERM complete the file. After SIGKILL it lacks at most the
last half second (--flush); `hpccd doctor` recovers it. After a power failure it may lack more, unless it was made with
--sync. On a write error (full disk), the file ends at its last whole chunk, lost messages are counted (exit status 1),
and a new file is tried every 5 seconds.
A node can also record itself: see its parameter `record`. If the node's topics are remapped, give the same remappings
here, after --ros-args.
"""

import math

from hpccd_ros.base.errors import UserError
from hpccd_ros.params.table import LEAST_SPLIT_SIZE, LEAST_SPLIT_TIME, MOST_SPLIT


def configure(parser):
    parser.add_argument(
        "-o",
        "--output",
        metavar="PATH",
        help="new file NAME.mcap, or new folder for a split recording, in an existing folder",
    )
    parser.add_argument("--node", default="/hpccd", help="full name of the node to record (default: %(default)s)")
    parser.add_argument(
        "--topic",
        action="append",
        default=[],
        metavar="NAME=TYPE",
        help="record this topic too, for example /joints=sensor_msgs/msg/JointState; may be repeated",
    )
    parser.add_argument(
        "--compression",
        choices=("none", "lz4", "zstd"),
        default="none",
        help="lz4: about half the write speed of none; zstd: smaller files, a fifth of it (default: %(default)s)",
    )
    parser.add_argument(
        "--split-size", type=float, default=0, metavar="MB", help="size at which a new file begins, before compression"
    )
    parser.add_argument("--split-time", type=float, default=0, metavar="S", help="time after which a new file begins")
    parser.add_argument(
        "--flush",
        type=float,
        default=0.5,
        metavar="S",
        help="seconds of messages that SIGKILL can lose at most (default: %(default)s)",
    )
    parser.add_argument(
        "--sync",
        action="store_true",
        help="make the file durable (fsync) each time that messages are flushed: a power failure loses no more than "
        "--flush and the time of two syncs",
    )
    parser.add_argument(
        "--depth",
        type=int,
        default=50,
        metavar="N",
        help="queue of each topic, in messages (default: %(default)s)",
    )
    parser.add_argument("--duration", type=float, default=0, metavar="S", help="end after this time")
    parser.add_argument("--frames", type=int, default=0, metavar="N", help="end after N contact messages")
    parser.add_argument(
        "--wait",
        type=float,
        default=10,
        metavar="S",
        help="seconds to wait for the node (default: %(default)s)",
    )
    parser.add_argument("--ros-args", nargs="...", default=[], help="ROS arguments, such as remappings")


def run(args) -> int:
    for name in ("split_size", "split_time", "flush", "duration", "wait", "frames"):
        if getattr(args, name) < 0:
            raise UserError(f"--{name.replace('_', '-')} {getattr(args, name)}: must not be negative")
        if math.isnan(getattr(args, name)):
            raise UserError(f"--{name.replace('_', '-')} nan: must be a number")
    for name, least in (("split_size", LEAST_SPLIT_SIZE), ("split_time", LEAST_SPLIT_TIME)):
        if 0 < getattr(args, name) < least:
            raise UserError(f"--{name.replace('_', '-')} {getattr(args, name)}: must be 0 or at least {least:g}")
        if getattr(args, name) > MOST_SPLIT:
            raise UserError(f"--{name.replace('_', '-')} {getattr(args, name)}: must be at most {MOST_SPLIT:g}")
    if args.depth < 1:
        raise UserError(f"--depth {args.depth}: must be at least 1")
    from hpccd_ros.record import recorder

    return recorder.main(args)
