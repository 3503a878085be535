# SPDX-License-Identifier: Apache-2.0
"""Compute recordings again, without DDS and as fast as it goes, and compare every contact, every time, the hash
and every smallest distance with what the node had answered. Or play one over DDS instead, to a node (--publish).

  hpccd replay run.mcap                     verify; exit status 1 names the first frame and pair that differ
  hpccd replay run.mcap --threads 1 --backend cpu
                                            the contacts may not depend on either
  hpccd replay run.mcap --csv steps.csv     one row for each step: contacts, first time, separation, ms, hash
  hpccd replay run.mcap --from 10 --step    from the tenth second, one step at each Enter
  hpccd replay bugs/*.mcap --json all.json  many at once, in processes of this machine, as one table
  hpccd replay bugs/*.mcap --scheduler tcp://head:8786
                                            on a Dask cluster, whose workers see the files under the same names
  hpccd replay run.mcap --publish --rate 2  play the meshes to a node, twice as fast as they were recorded

FILE is an .mcap file or a folder of them. Recordings of `ros2 bag record` work too, with --params naming the
parameter file of the node; what the node would not start with is refused. Recordings without contacts are computed
only, from each frame to the next. Many at once need the extra "cluster" (Dask).
"""

import math

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.feature_list import feature_list


def configure(parser):
    parser.add_argument("files", metavar="FILE", nargs="+", help="recording: an .mcap file, or a folder of them")
    parser.add_argument("--params", metavar="YAML", help="node parameters, instead of those in the recording")
    verify = parser.add_argument_group("verify")
    verify.add_argument("--backend", default="auto", metavar="NAME", help="auto, cpu, hybrid, gpu (default: auto)")
    verify.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores (default)")
    verify.add_argument(
        "--accuracy",
        default="",
        metavar="TIER",
        help="fast, balanced, conservative, exact (default: as recorded); another one may differ",
    )
    verify.add_argument(
        "--features",
        default=(),
        type=feature_list,
        metavar="KIND[,KIND]",
        help="test vertex_face, edge_edge or both (default: as recorded); other ones differ",
    )
    verify.add_argument(
        "--csv", metavar="FILE", help="write a table with one row for each step, or of many recordings one for each"
    )
    verify.add_argument("--json", metavar="FILE", help="write what came of each recording")
    verify.add_argument("--keep-going", action="store_true", help="list every step that differs, not only the first")
    when = parser.add_argument_group("when, of one recording")
    when.add_argument(
        "--rate",
        type=float,
        metavar="X",
        help="speed, 1: as recorded, 0: without pauses (default: 0, with --publish 1)",
    )
    when.add_argument(
        "--from",
        dest="begin",
        type=float,
        default=0.0,
        metavar="S",
        help="start so many seconds into the recording (default: %(default)s)",
    )
    when.add_argument("--to", dest="end", type=float, default=float("inf"), metavar="S", help="end there")
    when.add_argument("--step", action="store_true", help="wait for Enter at each frame")
    many = parser.add_argument_group("many recordings at once")
    many.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster (default: processes of this machine)")
    many.add_argument("--jobs", type=int, default=0, metavar="N", help="local processes; 0: one a core (default)")
    play = parser.add_argument_group("play over DDS")
    play.add_argument("--publish", action="store_true", help="publish the recorded meshes instead of verifying")
    play.add_argument("--all", action="store_true", help="publish every recorded topic, contacts too")
    play.add_argument(
        "--wait", type=float, default=10.0, metavar="S", help="how long to wait for subscribers (default: %(default)s)"
    )
    play.add_argument(
        "--subscribers",
        type=int,
        default=1,
        metavar="N",
        help="how many to wait for: 2 for a node and a recorder (default: %(default)s)",
    )
    play.add_argument("--ros-args", nargs="...", default=[], help="remappings and the like, as for any ROS program")


def run(args) -> int:
    if any(map(math.isnan, (args.rate or 0, args.begin, args.end, args.wait))):
        raise UserError("--rate, --from, --to and --wait must be numbers, not nan")
    if (args.rate or 0) < 0 or args.begin < 0 or args.end < args.begin or args.wait < 0:
        raise UserError("--rate, --from and --wait must not be negative, and --to not before --from")
    if args.threads < 0:
        raise UserError(f"--threads {args.threads}: must not be negative")
    if args.jobs < 0:
        raise UserError(f"--jobs {args.jobs}: must not be negative")
    if len(args.files) > 1 or args.scheduler:
        for name, given in (("publish", args.publish), ("step", args.step), ("rate", args.rate is not None)):
            if given:
                raise UserError(f"--{name} is for one recording; {len(args.files)} are given")
        from hpccd_ros.replay import many_recordings

        return many_recordings.main(args)
    args.file = args.files[0]
    if args.publish:
        from hpccd_ros.replay import playback

        return playback.main(args)
    from hpccd_ros.replay import report

    return report.main(args)
