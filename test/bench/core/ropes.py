# SPDX-License-Identifier: Apache-2.0
"""Ropes as edges, beside the same ropes as thin triangles and beside cloth with as many edges.

  python -m bench ropes                       100,000 segments
  python -m bench ropes --segments 10000,100000 --segments-a-rope 100

Ropes lie in a tangle and move by a fifth of a segment's length. "edges": as they are. "thin triangles": each segment as
a triangle that names a vertex twice, which is how a rope is faked where a library knows triangles only; its edge-edge
contacts are compared with those of the edges. "cloth": two nets that sink through each other, with as many edges.
Everything a step asks for is timed: bounds, refit, traversal, tests, and the answer's arrays.
"""

from __future__ import annotations

import time

import numpy as np

import hpccd_core as hc
from bench import command
from bench.core import two_nets
from bench.report import progress
from bench.report.timing import times
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores


def configure(parser):
    what = parser.add_argument_group("what is measured")
    what.add_argument(
        "--segments", default="100000", metavar="N,...", help="how many in a scene (default: %(default)s)"
    )
    what.add_argument("--segments-a-rope", type=int, default=500, metavar="N", help="default: %(default)s")
    command.repeat_option(what, 15)
    command.tier_option(parser, "exact")
    command.threads_option(parser)
    command.output_options(parser)


def run(args) -> int:
    counts = command.numbers("--segments", args.segments, int)
    if args.segments_a_rope < 1:
        raise UserError(f"--segments-a-rope {args.segments_a_rope}: a rope has at least one segment")
    report = command.begin_report(args)
    for segments in counts:
        _measure(report, max(1, segments // args.segments_a_rope), args)
    _print(report)
    return command.end(args, report)


def tangle(ropes: int, segments: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (ropes segments, 2), and start and end (V, 3) float32: smooth random ways through a box in which there is a
    segment for each cube of its length."""
    rng = np.random.default_rng(0)
    side = (1.0 * ropes * segments) ** (1 / 3)
    turns = rng.normal(0, 0.35, (ropes, segments + 1, 3)).cumsum(axis=1) + rng.normal(0, 2, (ropes, 1, 3))
    ways = turns / np.linalg.norm(turns, axis=2, keepdims=True)
    points = rng.uniform(0, side, (ropes, 1, 3)) + ways.cumsum(axis=1)
    # Back from the walls, as light in a room of mirrors.
    points = side - np.abs(points % (2 * side) - side)
    start = points.reshape(-1, 3).astype(np.float32)
    sway = rng.normal(0, 0.2 / np.sqrt(3), (ropes, 1, 3)) + rng.normal(0, 0.02, points.shape)
    first = (np.arange(ropes)[:, None] * (segments + 1) + np.arange(segments)).reshape(-1, 1)
    return np.hstack([first, first + 1]), start, (points + sway).reshape(-1, 3).astype(np.float32)


def _measure(report, ropes, args):
    edges, start, end = tangle(ropes, args.segments_a_rope)
    as_edges, as_triangles = hc.Scene(), hc.Scene()
    as_edges.add_mesh("ropes", edges=edges)
    as_triangles.add_mesh("ropes", edges[:, [0, 1, 1]])
    nets = two_nets.step(max(2, round((len(edges) / 6) ** 0.5)))
    options = {"backend": "cpu", "accuracy": args.accuracy, "threads": args.threads}
    steps = {
        "edges": (hc.Detector(as_edges, **options), start, end),
        "thin triangles": (hc.Detector(as_triangles, **options), start, end),
        "cloth": (hc.Detector(nets.scene(), **options), nets.vertices_t0, nets.vertices_t1),
    }
    ms, found = {name: [] for name in steps}, {}
    with progress.bar(f"{len(edges):,} segments", (args.repeat + 1) * len(steps)) as bar:
        for lap in range(args.repeat + 1):
            for name, (detector, t0, t1) in steps.items():
                began = time.perf_counter()
                found[name] = detector.detect(t0, t1)
                if lap:
                    ms[name].append(1e3 * (time.perf_counter() - began))
                bar.step()
    rope, faked = found["edges"], found["thin triangles"]
    if not np.array_equal(rope.ee, faked.ee) or rope.ee_toc.tobytes() != faked.ee_toc.tobytes():
        report.failure(f"{len(edges):,} segments: contacts of edges are not those of thin triangles")
    for name, (detector, *_) in steps.items():
        report.add(
            way=name,
            accuracy=args.accuracy,
            threads=args.threads or cores(),
            edges=len(edges) if name != "cloth" else _n_edges(nets),
            triangles=detector.stats["triangles"],
            contacts=len(found[name]),
            ms=times(ms[name]).median,
            bytes=detector.stats["bytes"],
        )


def _n_edges(step) -> int:
    of_meshes = (np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1) for mesh in step.meshes)
    return sum(len(np.unique(edges, axis=0)) for edges in of_meshes)


def _print(report):
    tables.show(
        f"ropes, {report.rows[0]['accuracy']}, threads: {report.rows[0]['threads']}",
        ["as", "edges", "triangles", "contacts", "ms a step", "MB"],
        [[r["way"], r["edges"], r["triangles"], r["contacts"], r["ms"], r["bytes"] / 1e6] for r in report.rows],
        "medians of the rounds, all ways in turn in each",
    )
