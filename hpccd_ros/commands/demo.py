# SPDX-License-Identifier: Apache-2.0
"""Start the node, a publisher of a moving scene and a recorder as processes over DDS, for about half a minute; show the
contacts as they arrive, verify the recording, and draw the frame with the most contacts.
No frame is dropped: each waits for the result of the one before, so a slow machine plays the scene slower.

  hpccd demo                                a small cloth falls on a ball, which then rotates
  hpccd demo --scene n-body-like-lr --rate 10
  hpccd demo --scene cloth-ball-like --rate 5 --out big
  hpccd demo --scene arm-and-cloth --rate 60   an arm drags a cloth across a table
  hpccd demo --small                        a coarse mesh, compressed: a few hundred kilobytes

Leaves DIR/demo.mcap and DIR/demo.png, and the logs of the processes. A run that succeeds replaces the files of the run
before; one that fails or is interrupted leaves them as they are.
Uses a DDS domain of its own unless ROS_DOMAIN_ID is set. Ctrl-C ends all processes.
"""

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.feature_list import feature_list
from hpccd_ros.base.quoting import nearest
from hpccd_ros.params.table import ACCURACIES, NODE_ROWS

MOST_THREADS = next(row.span[1] for row in NODE_ROWS if row.name == "threads")


def configure(parser):
    parser.add_argument(
        "--out", default="hpccd-demo", metavar="DIR", help="folder for the results (default: %(default)s)"
    )
    parser.add_argument(
        "--scene", default="cloth-drop", metavar="NAME", help="see `hpccd scene --list` (default: %(default)s)"
    )
    parser.add_argument(
        "--size", type=float, default=1.0, metavar="X", help="factor on the number of triangles (default: %(default)s)"
    )
    parser.add_argument("--frames", type=int, metavar="N", help="number of frames (default: the scene's own)")
    parser.add_argument(
        "--rate", type=float, default=15.0, metavar="HZ", help="frames per second (default: %(default)s)"
    )
    parser.add_argument("--accuracy", metavar="TIER", help="accuracy of the node (default: the node's own)")
    parser.add_argument(
        "--features",
        default=(),
        type=feature_list,
        metavar="KIND[,KIND]",
        help="features that the node tests: vertex_face, edge_edge or both (default: the node's own)",
    )
    parser.add_argument(
        "--threads", type=int, default=0, metavar="N", help="threads of the node; 0: all cores (default)"
    )
    parser.add_argument(
        "--compression",
        choices=("none", "lz4", "zstd"),
        default="none",
        help="compression of the recording (default: %(default)s)",
    )
    parser.add_argument("--small", action="store_true", help="a coarse mesh, compressed")


def run(args) -> int:
    if not 0 < args.rate <= 1000:
        raise UserError(f"--rate {args.rate}: must be above 0, at most 1000 Hz")
    if not 0 <= args.threads <= MOST_THREADS:
        raise UserError(f"--threads {args.threads}: must be from 0 to {MOST_THREADS}")
    if args.accuracy is not None and args.accuracy not in ACCURACIES:
        near = nearest(args.accuracy, ACCURACIES)
        remedy = f"did you mean {near}?" if near else f"use one of {', '.join(ACCURACIES)}"
        raise UserError(f"--accuracy {args.accuracy}: not a tier; {remedy}")
    if args.small:
        args.size, args.compression = 0.15, "zstd"
    from hpccd_ros.demo import run as demo

    return demo.main(args)
