# SPDX-License-Identifier: Apache-2.0
"""Recompute recordings without DDS, at full speed, and compare every contact, time, hash and smallest distance with the
recorded results of the node. Or publish a recording over DDS (--publish).

  hpccd replay run.mcap                     verify; exit status 1 names the first frame and pair that differ
  hpccd replay run.mcap --threads 1 --backend cpu
                                            contacts do not depend on either
  hpccd replay run.mcap --csv steps.csv     one row per step: contacts, first time, separation, ms, hash
  hpccd replay run.mcap --from 10 --step    from second 10, one step per Enter
  hpccd replay bugs/*.mcap --json all.json  many at once, in local processes, as one table
  hpccd replay bugs/*.mcap --scheduler tcp://head:8786
                                            on a Dask cluster whose workers see the files under the same names
  hpccd replay run.mcap --publish --rate 2  publish the meshes at twice the recorded speed

FILE is an .mcap file or a folder of them. Recordings of other MCAP writers need --params, the parameter file of the
node; parameters that the node rejects are rejected here too. Recordings without contacts are computed, not compared.
Many at once need the extra "cluster" (Dask).
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
        help="fast, balanced, conservative, exact (default: as recorded); results of another tier may differ",
    )
    verify.add_argument(
        "--features",
        default=(),
        type=feature_list,
        metavar="KIND[,KIND]",
        help="vertex_face, edge_edge or both (default: as recorded); results of other features differ",
    )
    verify.add_argument(
        "--csv", metavar="FILE", help="write a table with one row per step; of many recordings, one row per recording"
    )
    verify.add_argument("--json", metavar="FILE", help="write the result of each recording")
    verify.add_argument("--keep-going", action="store_true", help="list every step that differs, not only the first")
    when = parser.add_argument_group("when, of one recording")
    when.add_argument(
        "--rate",
        type=float,
        metavar="X",
        help="speed; 1: as recorded, 0: without pauses (default: 0; with --publish 1)",
    )
    when.add_argument(
        "--from",
        dest="begin",
        type=float,
        default=0.0,
        metavar="S",
        help="start at second S of the recording (default: %(default)s)",
    )
    when.add_argument("--to", dest="end", type=float, default=float("inf"), metavar="S", help="end at second S")
    when.add_argument("--step", action="store_true", help="wait for Enter at each frame")
    many = parser.add_argument_group("many recordings at once")
    many.add_argument("--scheduler", metavar="ADDRESS", help="address of a Dask cluster (default: local processes)")
    many.add_argument("--jobs", type=int, default=0, metavar="N", help="local processes; 0: one per core (default)")
    play = parser.add_argument_group("play over DDS")
    play.add_argument("--publish", action="store_true", help="publish the recorded meshes instead of verifying")
    play.add_argument("--all", action="store_true", help="publish all recorded topics but stop, contacts too")
    play.add_argument(
        "--wait", type=float, default=10.0, metavar="S", help="seconds to wait for subscribers (default: %(default)s)"
    )
    play.add_argument(
        "--subscribers",
        type=int,
        default=1,
        metavar="N",
        help="number to wait for; 2 for a node and a recorder (default: %(default)s)",
    )
    play.add_argument("--ros-args", nargs="...", default=[], help="ROS arguments, such as remappings")


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
