# SPDX-License-Identifier: Apache-2.0
"""Growth of time and memory with the number of triangles: the same motion with coarser and finer meshes.

  python -m bench size                                two scenes at 1/4, 1 and 4 times the triangles
  python -m bench size n-body-like-lr --sizes 0.25,0.5,1,2,4

The power p of time ~ triangles^p is the least-squares slope of log time over log triangles; 1 is linear. Steps are
taken from the second half of each motion, where contacts grow like the triangles.
"""

from __future__ import annotations

import dataclasses

from bench import lab
from hpccd_ros import scenes
from hpccd_ros.bench.measure import Runner
from hpccd_ros.bench.sources import of_scene

COLUMNS = {
    "scene": "scene",
    "size": "size",
    "threads": "threads",
    "triangles": "triangles",
    "contacts": lab.whole("contacts"),
    "ms a step": "step_ms",
    "us / 1000 triangles": lambda row: 1e6 * row["step_ms"] / row["triangles"],
    "bytes / triangle": lambda row: round(row["bytes"] / row["triangles"]),
}


def configure(parser):
    lab.configure(parser, ("cloth-ball-like", "n-body-like-hr"), steps=4, leave_out=("size", "threads"))
    parser.add_argument("--sizes", default="0.25,1,4", metavar="X,...", help="factors (default: %(default)s)")
    parser.add_argument("--threads-list", metavar="N,...", help="default: 1 and all cores")
    lab.tier_option(parser)


def run(args) -> lab.Report:
    sizes = lab.numbers("--sizes", args.sizes, float)
    counts = lab.thread_counts(args.threads_list, [1, lab.cores()])
    names = args.sources or list(args.default_sources)
    if unknown := [name for name in names if name not in scenes.names()]:
        raise lab.UserError(f"{unknown[0]}: not a generated scene, so it has one size; see `hpccd scene --list`")
    result, _ = lab.begin(args)
    for name in names:
        for size in sizes:
            source = _second_half(of_scene(name, size))
            runners = [Runner(f"{n}", {"accuracy": args.accuracy, "backend": "cpu", "threads": n}) for n in counts]
            asked = {f"{n}": {"scene": name, "size": size, "threads": n} for n in counts}
            lab.compare(result, args, source, runners, f"{counts[0]}", asked)
    lab.show(f"time and memory against size ({args.accuracy})", COLUMNS, result.rows)
    for name in names if len(sizes) > 1 else ():
        for n in counts:
            mine = [row for row in result.rows if (row["scene"], row["threads"]) == (name, n)]
            triangles = [row["triangles"] for row in mine]
            time = lab.slope(triangles, [row["step_ms"] for row in mine])
            contacts = lab.slope(triangles, [max(1, row["contacts"]) for row in mine])
            result.note(f"{name}, {n} threads: time ~ triangles^{time:.3f}, contacts ~ triangles^{contacts:.3f}")
    return result


def _second_half(source):
    begin = source.n_steps - max(1, round(source.n_steps / 2))
    return dataclasses.replace(source, n_steps=source.n_steps - begin, step=lambda k: source.step(begin + k))
