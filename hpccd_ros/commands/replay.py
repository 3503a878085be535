# SPDX-License-Identifier: Apache-2.0
"""Compute a recording again, without DDS and as fast as it goes, and compare every contact, every time and the
hash with what the node had answered. Or play it over DDS instead, to a node (--publish).

  hpccd replay run.mcap                     verify; exit status 1 names the first frame and pair that differ
  hpccd replay run.mcap --threads 1 --backend cpu
                                            the contacts may not depend on either
  hpccd replay run.mcap --csv steps.csv     one row for each step: contacts, first time, ms, hash
  hpccd replay run.mcap --publish --rate 2  play the meshes to a node, twice as fast as they were recorded
  hpccd replay run.mcap --publish --from 10 --step
                                            from the tenth second, one frame at each Enter

FILE is an .mcap file or a folder of them. Recordings of `ros2 bag record` work too, with --params naming the
parameter file of the node. Recordings without contacts are computed only, from each frame to the next.
"""

from hpccd_ros.errors import UserError


def configure(parser):
    parser.add_argument("file", metavar="FILE", help="recording: an .mcap file, or a folder of them")
    parser.add_argument("--params", metavar="YAML", help="node parameters, instead of those in the recording")
    verify = parser.add_argument_group("verify")
    verify.add_argument("--backend", default="auto", metavar="NAME", help="auto, cpu, hybrid, gpu (default: auto)")
    verify.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores (default)")
    verify.add_argument("--accuracy", default="", metavar="TIER",
                        help="fast, balanced, conservative, exact (default: as recorded); another one may differ")
    verify.add_argument("--csv", metavar="FILE", help="write a table with one row for each step")
    verify.add_argument("--keep-going", action="store_true", help="list every step that differs, not only the first")
    play = parser.add_argument_group("play over DDS")
    play.add_argument("--publish", action="store_true", help="publish the recorded meshes instead of verifying")
    play.add_argument("--rate", type=float, default=1.0, metavar="X",
                      help="speed, 1: as recorded, 0: without pauses (default: %(default)s)")
    play.add_argument("--from", dest="begin", type=float, default=0.0, metavar="S",
                      help="start so many seconds into the recording (default: %(default)s)")
    play.add_argument("--to", dest="end", type=float, default=float("inf"), metavar="S", help="end there")
    play.add_argument("--step", action="store_true", help="wait for Enter before each frame")
    play.add_argument("--all", action="store_true", help="publish every recorded topic, contacts too")
    play.add_argument("--wait", type=float, default=10.0, metavar="S",
                      help="how long to wait for subscribers (default: %(default)s)")
    play.add_argument("--ros-args", nargs="...", default=[], help="remappings and the like, as for any ROS program")


def run(args) -> int:
    if args.rate < 0 or args.begin < 0 or args.end < args.begin or args.wait < 0:
        raise UserError("--rate, --from and --wait must not be negative, and --to not before --from")
    if args.threads < 0:
        raise UserError(f"--threads {args.threads}: must not be negative")
    if args.publish:
        from hpccd_ros import playback

        return playback.main(args)
    from hpccd_ros import replay_report

    return replay_report.main(args)
