# SPDX-License-Identifier: Apache-2.0
"""Copy a part of a recording into a new one that replays on its own: the state at its beginning is copied too
(topologies, static meshes, shapes, descriptions, transforms, joint states), with the node's parameters and mesh files.

  hpccd cut run.mcap --from 10 --to 20 -o part.mcap      from second 10 to second 20
  hpccd cut run.mcap --to 12.5 -o before.mcap            two parts without a gap or overlap: messages received at
  hpccd cut run.mcap --from 12.5 -o after.mcap           second 12.5 are in the second part only
  hpccd cut run.mcap --from 1700000000123456789ns -o end.mcap
                                                         from the frame with this stamp, as `hpccd replay` prints it
  hpccd cut run/ --from 3600 -o late.mcap                a split recording, across all its files

Times are seconds since the first message of the recording was received, or stamps of frames in nanoseconds with the
suffix ns (the frame at --to is included). Results of steps that began before the part are kept but cannot be verified;
`hpccd replay` counts them. Channels with other encodings are copied unchanged.
"""

from pathlib import Path

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted


def configure(parser):
    parser.add_argument("file", metavar="FILE", help="recording: an .mcap file, or a folder of them")
    parser.add_argument("--from", dest="begin", metavar="TIME", help="where the part begins (default: as FILE)")
    parser.add_argument("--to", dest="end", metavar="TIME", help="where the part ends (default: as FILE)")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="new file, NAME.mcap")
    parser.add_argument("--compression", choices=("none", "lz4", "zstd"), help="compression of OUT (default: as FILE)")


def run(args) -> int:
    if args.begin is None and args.end is None:
        raise UserError("nothing to cut: give --from TIME, --to TIME or both")
    target = Path(args.output)
    if target.suffix != ".mcap":
        raise UserError(f"-o {args.output}: must end in .mcap; give NAME.mcap")
    from hpccd_core.progress import track
    from hpccd_ros.bag.cut import Time, cut, seconds
    from hpccd_ros.bag.reader import Recording

    times = []
    for option, text in (("--from", args.begin), ("--to", args.end)):
        try:
            times.append(None if text is None else Time.of(text))
        except ValueError as error:
            raise UserError(f"{option}: {error}") from error
    with Recording(args.file) as recording:
        try:
            part = cut(
                recording,
                target,
                *times,
                args.compression,
                watch=lambda messages: track(messages, "cut", True, recording.message_count or None),
            )
        except FileExistsError as error:
            raise UserError(f"-o {args.output}: already exists; give another name") from error
        except OSError as error:
            raise UserError(f"-o {args.output}: {error.strerror}") from error
    print(
        f"{args.output}: {counted(part.count, 'message')}, from {seconds(part.begin)} to {seconds(part.end)} s of "
        f"{args.file}"
    )
    if part.in_force:
        print(f"  {part.in_force:,} of them were received earlier and were in force at its beginning")
    return 0
