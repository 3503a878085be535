# SPDX-License-Identifier: Apache-2.0
"""Ropes as edges, compared with the same ropes as thin triangles and with cloth of as many edges.

  python -m bench ropes --segments 10000,100000 --segments-a-rope 100

Ropes lie in a tangle and move by a fifth of a segment's length. "thin triangles": each segment is a triangle that names
a vertex twice; its edge-edge contacts must be those of the edges. "cloth": two nets that sink through each other.
"""

from __future__ import annotations

import numpy as np

import hpccd_core as hc
from bench import lab, shapes

COLUMNS = {
    "as": "way",
    "edges": "edges",
    "triangles": "triangles",
    "contacts": "contacts",
    "ms a step": "ms",
    "MiB": lambda row: row["bytes"] / 2**20,
}


def configure(parser):
    lab.configure(parser, rounds=15, leave_out=("data", "size"))
    parser.add_argument("--segments", default="100000", metavar="N,...", help="of a scene (default: %(default)s)")
    parser.add_argument("--segments-a-rope", type=int, default=500, metavar="N", help="default: %(default)s")
    lab.tier_option(parser, "exact")


def run(args) -> lab.Report:
    counts = lab.numbers("--segments", args.segments, int)
    if args.segments_a_rope < 1:
        raise lab.UserError(f"--segments-a-rope {args.segments_a_rope}: a rope has at least one segment")
    result, _ = lab.begin(args)
    options = {"backend": "cpu", "accuracy": args.accuracy, "threads": args.threads}
    for segments in counts:
        edges, start, end = shapes.tangle(max(1, segments // args.segments_a_rope), args.segments_a_rope)
        as_edges, as_triangles = hc.Scene(), hc.Scene()
        as_edges.add_mesh("ropes", edges=edges)
        as_triangles.add_mesh("ropes", edges[:, [0, 1, 1]])
        nets = shapes.two_nets(max(2, round((len(edges) / 6) ** 0.5)))
        detectors = {
            "edges": (hc.Detector(as_edges, **options), start, end, len(edges)),
            "thin triangles": (hc.Detector(as_triangles, **options), start, end, len(edges)),
            "cloth": (hc.Detector(nets.scene(), **options), nets.vertices_t0, nets.vertices_t1, _n_edges(nets)),
        }
        ways = {name: lambda d=d, a=a, b=b: d.detect(a, b) for name, (d, a, b, _) in detectors.items()}
        ms, found = lab.in_turn(f"{len(edges):,} segments", ways, args.repeat)
        rope, faked = found["edges"], found["thin triangles"]
        if not np.array_equal(rope.ee, faked.ee) or rope.ee_toc.tobytes() != faked.ee_toc.tobytes():
            result.failure(f"{len(edges):,} segments: contacts of edges are not those of thin triangles")
        for way, (detector, _, _, n) in detectors.items():
            stats = detector.stats
            row = {"triangles": stats["triangles"], "bytes": stats["bytes"], "contacts": len(found[way])}
            result.add(way=way, edges=n, ms=lab.times(ms[way])["median_ms"], **row)
    lab.show(f"ropes, {args.accuracy}", COLUMNS, result.rows, "medians of the rounds, all in turn in each")
    return result


def _n_edges(step) -> int:
    of_meshes = (np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1) for mesh in step.meshes)
    return sum(len(np.unique(edges, axis=0)) for edges in of_meshes)
