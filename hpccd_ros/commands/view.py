# SPDX-License-Identifier: Apache-2.0
"""View recorded steps: pictures of shaded meshes with contacts coloured by time of impact, an interactive HTML page, or
the Rerun viewer.

  hpccd view run.mcap                       write the step with the most contacts to run.png
  hpccd view run.mcap --step 30 -o frame.png
  hpccd view run.mcap --every 1 -o frames   write every step as frames/000000.png, ..., for a video
  hpccd view run.mcap --html run.html       write an interactive page that needs no network
  hpccd view run.mcap --depth               draw how deep meshes penetrate, too
  hpccd view run.mcap --rerun               open the Rerun viewer; without a screen, write run.rrd
  hpccd view run.mcap -o run.rrd            write meshes, contacts, normals and curves for Rerun

Pictures need neither display nor graphics driver. Pages need the extra "page", Rerun the extra "rerun".
"""

import math

from hpccd_ros.base.errors import UserError


def configure(parser):
    parser.add_argument("file", metavar="FILE", help="recording: an .mcap file, or a folder of them")
    parser.add_argument(
        "-o",
        "--output",
        metavar="PATH",
        help="picture (.png, .jpg, .pdf), page (.html), Rerun recording (.rrd), in an existing folder; with --every, a "
        "folder",
    )
    parser.add_argument("--html", metavar="PATH", help="write an interactive HTML page that needs no network")
    parser.add_argument(
        "--rerun", action="store_true", help="open the Rerun viewer; without a screen, write a Rerun recording"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--step", type=int, metavar="N", help="step number (default: the one with the most contacts)")
    which.add_argument(
        "--every",
        type=int,
        metavar="K",
        help="every K-th step, into a folder, the page or the Rerun recording (the last two: default 1)",
    )
    parser.add_argument(
        "--azimuth",
        type=float,
        default=-60.0,
        metavar="DEG",
        help="view angle around z (default: %(default)s)",
    )
    parser.add_argument(
        "--elevation",
        type=float,
        default=26.0,
        metavar="DEG",
        help="view angle above the horizon (default: %(default)s)",
    )
    parser.add_argument(
        "--depth",
        action="store_true",
        help="an arrow for each pair of meshes that intersect or contain one another: the shortest translation found "
        "that frees the first one; it may take a second for each pair and step",
    )
    parser.add_argument("--title", help="default: the name of the file")
    parser.add_argument("--params", metavar="YAML", help="node parameters, instead of those in the recording")


def run(args) -> int:
    if args.every is not None and args.every < 1:
        raise UserError(f"--every {args.every}: must be at least 1")
    if not -89.9 <= args.elevation <= 89.9:
        raise UserError(f"--elevation {args.elevation}: must lie between -89.9 and 89.9 degrees")
    if not math.isfinite(args.azimuth):
        raise UserError(f"--azimuth {args.azimuth}: must be a number of degrees")
    if args.html is not None and (args.rerun or args.output is not None):
        raise UserError(f"--html {args.html}: takes neither --rerun nor --output")
    if args.depth and (args.rerun or str(args.output).endswith(".rrd")):
        raise UserError("--depth: only pictures and pages have arrows; leave out --depth for Rerun")
    from hpccd_ros.picture import view

    return view.main(args)
