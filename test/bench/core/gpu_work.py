# SPDX-License-Identifier: Apache-2.0
"""The least that the stages of a GPU frame must do, and which arithmetic decided its pairs: what the program counts,
times what one of each takes, in one table.

It is counted in the sources of the core and kept low: each array is read or written once, however often it is touched;
what was compared for nothing, indices and branches are left out, and so is the arithmetic of integers. A double of
twice the precision takes ten operations at the very least. Bytes over the device memory's rate, operations over their
rates: the largest of the three is the floor of a stage.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from bench.core.limit_work import (
    BEYOND,
    BOX_COMPARISONS,
    CUBIC,
    ERROR,
    INSIDE,
    KDOP_COMPARISONS,
    LOAD,
    MAGNITUDES,
    NEWTON,
    NEWTON_STEPS,
    ONE_ROOT,
    PROJECTION,
    QUICK_STEPS,
    ROOT_END,
)
from hpccd_ros.bench.sources import Step


@dataclasses.dataclass(frozen=True)
class Work:
    """moved: bytes between the device and its memory; singles, doubles: operations in that precision."""

    moved: float = 0
    singles: float = 0
    doubles: float = 0

    def __add__(self, other: Work) -> Work:
        return Work(self.moved + other.moved, self.singles + other.singles, self.doubles + other.doubles)

    def times(self, n: float) -> Work:
        return Work(n * self.moved, n * self.singles, n * self.doubles)


@dataclasses.dataclass(frozen=True)
class Item:
    """What one of `count` (a name of `counts`) costs in a stage, and how that was counted."""

    stage: str
    count: str
    work: Work
    how: str


# Sizes of the device's structures, in bytes: launch_params.cuh, device_box.cuh, bvh/kdop.h.
POINT, KDOP_OF_VERTEX, BOX, KDOP, LEAF, FEATURE, PAIR, NUMBER = 32, 64, 64, 128, 16, 8, 8, 4
FOUND = 8 + 8  # a key and a time
SIGNS = 12  # certainly_no_root()
FIRST_FILTER = LOAD + MAGNITUDES + CUBIC + ERROR + SIGNS
ROOT = LOAD + MAGNITUDES + CUBIC + ERROR + NEWTON * NEWTON_STEPS + ROOT_END
EXTENDED = 10

TABLE = (
    Item("bounds", "position_bytes", Work(moved=1), "both ends, as they were given, once"),
    Item("bounds", "end_bytes", Work(moved=1), "both ends of a vertex beside each other, written"),
    Item(
        "bounds",
        "vertices",
        Work(moved=POINT + KDOP_OF_VERTEX, singles=52, doubles=12 + 12),
        "extent_kernel: minimum and maximum of 6 coordinates; vertices_kernel: their map, 16 values of a k-DOP",
    ),
    Item("bounds", "groups", Work(moved=NUMBER), "counts of pairs of each vertex and edge, cleared"),
    Item(
        "refit",
        "vertices",
        Work(moved=POINT + KDOP_OF_VERTEX, singles=BOX_COMPARISONS + KDOP_COMPARISONS),
        "refit_leaf(), leaf_kdops_kernel: each vertex in one leaf; most are corners of several",
    ),
    Item("refit", "leaves", Work(moved=LEAF + BOX + KDOP), "read; box and k-DOP written"),
    Item("refit", "nodes", Work(moved=BOX + 2 * NUMBER, singles=BOX_COMPARISONS), "written, with parent and arrivals"),
    Item("traverse", "nodes", Work(moved=BOX), "all boxes once"),
    Item("traverse", "node_pairs", Work(singles=BOX_COMPARISONS), "traverse_kernel: those that it compares"),
    Item("traverse", "leaf_pairs", Work(moved=PAIR), "written"),
    Item("candidates", "leaf_pairs", Work(moved=PAIR, singles=KDOP_COMPARISONS), "read, k-DOPs compared"),
    Item("candidates", "leaves", Work(moved=LEAF + BOX + KDOP), "all of them once"),
    Item("candidates", "features", Work(moved=FEATURE), "edges and faces of leaves once"),
    Item("candidates", "vertices", Work(moved=POINT), "all of them once"),
    Item(
        "candidates",
        "candidates",
        Work(singles=BOX_COMPARISONS + FIRST_FILTER),
        "boxes of features, the cubic, its error bound, the signs of its coefficients; what is compared before is not "
        "counted",
    ),
    Item("candidates", "survivors", Work(moved=PAIR), "written"),
    Item("sort_survivors", "survivors", Work(moved=PAIR, singles=FIRST_FILTER + ONE_ROOT), "read; the same again"),
    *(
        Item(
            "sort_survivors", f"{kind}_one_root", Work(singles=QUICK_STEPS + INSIDE[kind]), "certainly_apart_at_root()"
        )
        for kind in ("vf", "ee")
    ),
    *(
        Item("sort_survivors", f"{kind}_outside", Work(singles=PROJECTION + BEYOND[kind]), "certainly_outside()")
        for kind in ("vf", "ee")
    ),
    Item("sort_survivors", "vertices", Work(moved=POINT), "all of them once"),
    Item("sort_survivors", "rooted", Work(moved=PAIR), "written, to one of two lists"),
    *(
        Item(
            f"{roots}_root{'s' if roots == 'many' else ''}",
            f"{kind}_{roots}",
            Work(moved=PAIR, doubles=ROOT + INSIDE[kind]),
            "four steps of Newton's method, then inside(); more than one root takes more",
        )
        for roots in ("single", "many")
        for kind in ("vf", "ee")
    ),
    Item("single_root", "end_bytes_of_single", Work(moved=1), "vertices of so many pairs; all of them at most"),
    Item("many_roots", "end_bytes_of_many", Work(moved=1), "vertices of so many pairs; all of them at most"),
    Item(
        "last_resort",
        "undecided",
        Work(moved=PAIR, doubles=EXTENDED * (LOAD + CUBIC)),
        "the cubic in twice the precision; what follows is not counted",
    ),
    Item("integers", "for_integers", Work(moved=PAIR), "read"),
    Item("sort", "groups", Work(moved=2 * NUMBER), "counts read, their sums written"),
    Item("sort", "contacts", Work(moved=2 * FOUND), "what was found read, and put where its feature's pairs are"),
    Item("results", "contacts", Work(moved=FOUND), "read"),
    Item("results", "vf_contacts", Work(moved=2 * NUMBER + 8), "rows written"),
    Item("results", "ee_contacts", Work(moved=4 * NUMBER + 8 + 2 * 2 * NUMBER), "ends of edges read, rows written"),
    Item("area", "nodes", Work(moved=BOX), "all boxes once"),
)


def _both(stats, name):
    return stats[f"vf_{name}"] + stats[f"ee_{name}"]


def counts(step: Step, stats: dict[str, float], worlds: int = 1) -> dict[str, float]:
    """Of a call that found all contacts of so many worlds, each with the triangles of `step`."""
    faces = np.sort(step.faces(), axis=1)
    sides = np.concatenate([faces[:, :2], faces[:, 1:], faces[:, ::2]])
    edges = len(np.unique(sides[:, 0] * (faces.max() + 1) + sides[:, 1]))
    vertices, leaves = len(step.vertices_t0) * worlds, -(-len(faces) // 8) * worlds  # at least: of eight triangles
    item = step.vertices_t0.dtype.itemsize
    ends = {4: 32, 8: 64}[item]  # GivenEnds
    found = {
        "vertices": vertices,
        "leaves": leaves,
        "nodes": 2 * leaves - worlds,
        "groups": vertices + edges * worlds,
        "features": edges + len(faces),
        "position_bytes": 2 * 3 * item * vertices,
        "end_bytes": ends * vertices,
        "node_pairs": stats["node_pairs"],
        "leaf_pairs": stats["leaf_pairs"],
        "candidates": _both(stats, "candidates"),
        "survivors": _both(stats, "candidates") - _both(stats, "rejected_coplanarity"),
        "rooted": _both(stats, "single_root") + _both(stats, "many_roots"),
        "undecided": _both(stats, "undecided"),
        "for_integers": _both(stats, "by_integers"),
        "contacts": _both(stats, "contacts"),
    }
    for kind in ("vf", "ee"):
        of = {
            name: stats[f"{kind}_{name}"]
            for name in (
                "single_root",
                "many_roots",
                "undecided",
                "rejected_roots",
                "proven_contacts",
                "rejected_projection",
                "contacts",
            )
        }
        # Single precision rejects some at their only root, which the core counts with those that doubles reject there.
        missed = of["rejected_roots"] + of["proven_contacts"] + of["undecided"] - of["single_root"] - of["many_roots"]
        found |= {
            f"{kind}_single": of["single_root"],
            f"{kind}_many": of["many_roots"],
            f"{kind}_one_root": of["single_root"] + missed,
            f"{kind}_contacts": of["contacts"],
            f"{kind}_outside": of["rejected_projection"],
        }
    for roots in ("single", "many"):
        pairs = found[f"vf_{roots}"] + found[f"ee_{roots}"]
        # A vertex may be in many pairs, and each pair has four.
        found[f"end_bytes_of_{roots}"] = min(found["end_bytes"], pairs * ends)
    return found


def floors(args, of: dict[str, float]) -> dict[str, dict[str, float]]:
    """By stage: what it must do (`counts`), and the ms that this takes at the rates of the options."""
    made = {}
    for stage in dict.fromkeys(item.stage for item in TABLE):
        work = sum((item.work.times(of[item.count]) for item in TABLE if item.stage == stage), Work())
        ms = (work.moved / args.memory / 1e6, work.singles / args.single_rate / 1e9, work.doubles / args.rate / 1e9)
        made[stage] = {**dataclasses.asdict(work), "ms": max(ms)}
    return made


def decided(stats: dict[str, float]) -> dict[str, float]:
    """How many candidate pairs each arithmetic decided; together they are the candidates."""
    candidates, rooted = _both(stats, "candidates"), _both(stats, "single_root") + _both(stats, "many_roots")
    first = _both(stats, "rejected_coplanarity")
    return {
        "first_filter": first,
        "sieve": candidates - first - rooted,
        "doubles": rooted - _both(stats, "undecided"),
        "tolerance": _both(stats, "by_tolerance"),
        "extended": _both(stats, "by_extended"),
        "integers": _both(stats, "by_integers"),
        "cpu": stats["gpu_exact_on_cpu"],
    }
