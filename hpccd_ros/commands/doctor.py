# SPDX-License-Identifier: Apache-2.0
"""Check recordings record by record, with their check sums and against their index; save what is readable of a damaged
one.

  hpccd doctor run.mcap                          what is in it, and whether it is sound
  hpccd doctor run.mcap --recover saved.mcap     copy every whole message into a new, finished file
  hpccd doctor run/                              every file of a split recording

A recorder that is killed (SIGKILL, power of its process, not of the machine) leaves a file without an index. All
that it had flushed, by default all but the last half second, is whole: --recover makes it a recording again.
Exit status: 0 sound (or recovered), 1 damaged, 2 unusable: no recording, nothing to save, no file (a pipe, a device).
"""

from hpccd_ros.base.errors import UserError


def configure(parser):
    parser.add_argument("file", metavar="FILE", help="an .mcap file, or a folder of them")
    parser.add_argument("--recover", metavar="OUT", help="write the readable messages into this new file")
    parser.add_argument(
        "--compression",
        choices=("none", "lz4", "zstd"),
        help="of the recovered file (default: that of the damaged one)",
    )


def run(args) -> int:
    if args.compression and not args.recover:
        raise UserError("--compression belongs to --recover")
    from hpccd_ros.replay import doctor

    return doctor.main(args)
