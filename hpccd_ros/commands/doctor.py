# SPDX-License-Identifier: Apache-2.0
"""Check recordings record by record, with their checksums and their index; recover the readable part of a damaged one.

  hpccd doctor run.mcap                          its content, and whether it is sound
  hpccd doctor run.mcap --recover saved.mcap     copy every whole message into a new, finished file
  hpccd doctor run/                              every file of a split recording

A recorder that is killed (SIGKILL) leaves a file without an index. The data it had flushed, by default all but the
last half second, is intact; --recover writes it into a complete recording.
Exit status: 0 sound or recovered; 1 damaged; 2 unusable: not a recording, nothing to recover, or not a regular file.
"""

from hpccd_ros.base.errors import UserError


def configure(parser):
    parser.add_argument("file", metavar="FILE", help="an .mcap file, or a folder of them")
    parser.add_argument("--recover", metavar="OUT", help="write the readable messages into this new file")
    parser.add_argument(
        "--compression",
        choices=("none", "lz4", "zstd"),
        help="compression of the recovered file (default: as the damaged one)",
    )


def run(args) -> int:
    if args.compression and not args.recover:
        raise UserError("--compression belongs to --recover")
    from hpccd_ros.replay import doctor

    return doctor.main(args)
