# SPDX-License-Identifier: Apache-2.0
"""The work that the stages of a step must do: what the program counts, times what one of each takes, in one table.

It is counted in the sources of the core and kept low where it varies, so that the time that follows is a lower bound:
padding of lanes, indices and branches are left out, and what the scalar fallbacks of the tiers do.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from hpccd_ros.bench.sources import Step

STAGES = ("bounds", "refit", "nodes", "leaf pairs", "k-DOPs", "tests", "contacts")


@dataclasses.dataclass(frozen=True)
class Work:
    """read, written: bytes that come from, and go to, wherever the stage's data lie, once a step; touched: bytes that
    come again and again, at best from a core's second cache; comparisons: operations on floats, comparisons and minima
    most of them, and the arithmetic that every tier begins with; flops: the same in the tier's precision."""

    read: float = 0
    written: float = 0
    touched: float = 0
    comparisons: float = 0
    flops: float = 0

    def __add__(self, other: Work) -> Work:
        return Work(*(a + b for a, b in zip(dataclasses.astuple(self), dataclasses.astuple(other), strict=True)))

    def times(self, n: float) -> Work:
        return Work(*(n * x for x in dataclasses.astuple(self)))


@dataclasses.dataclass(frozen=True)
class Item:
    """What one of `count` (a name of `counts`) costs in a stage, and how that was counted."""

    stage: str
    count: str
    work: Work
    how: str


# Sizes of the core's structures, in bytes.
VERTEX_MOTION, ROUNDED_MOTION, VERTEX_KDOP, BOX, NODE, CONTACT, NUMBER = 64, 32, 64, 48, 64, 16, 4
COORDINATES = 6 * 4  # of a corner, at both ends
LEAF_ROWS, LEAF_CORNERS, LEAF_KDOP = 16 * COORDINATES, 128, 128
BOX_COMPARISONS = 12  # below and above, three axes, both ends: MotionBox::overlaps
KDOP_COMPARISONS = 2 * 16
# Operations of vec3.h and motion.h.
CROSS, DOT, VECTOR = 9, 5, 3
LOAD = 6 * VECTOR  # p, a, b at both ends
MAGNITUDES = 3 * 5 + 6  # largest coordinates, and in_range; absolute values are bit operations
CUBIC = 4 * CROSS + VECTOR + 6 * DOT + 2  # coplanarity()
ERROR = 4  # one of its error bounds
# certainly_outside(): sums, cross products, the largest coordinate, three quadratics, errors; then a beyond() of 20 for
# each condition, and what makes up the third one.
PROJECTION = 3 * VECTOR + 3 * CROSS + 9 + 3 * 13 + 6
BEYOND = {"vf": 3 * 20 + 10, "ee": 2 * 20 + 5}
ONE_ROOT = 10  # certainly_one_root()
NEWTON, NEWTON_STEPS = 13 + 14 + 11, 4  # value(), slope() and the bracket: from one half to 1e-16 in no less than four
ROOT_END = 14 + 2 * 13 + 12  # delta, and signs on both sides
QUICK_STEPS = 2 * (13 + 14 + 4) + 5 + 2 * 13 + 6  # certainly_apart_at_root(): two steps, delta, signs on both sides
# inside(): interpolation, cross products, the largest coordinate, signs, errors, and 11 for each condition.
INSIDE = {"vf": 28 + 3 * CROSS + 9 + 4 + 8 + 3 * 11 + 4, "ee": 28 + 3 * CROSS + 9 + 4 + 8 + 2 * 11 + 4}
VERTICES = 4 * VERTEX_MOTION  # in double precision, of those that are left
# Contacts as they are handed out: pairs or quadruples of numbers, and a time.
HANDED_OUT = {"vf": 2 * NUMBER + 8, "ee": 4 * NUMBER + 8}

TABLE = (
    Item("bounds", "position_bytes", Work(read=1), "motion_bounds.cpp: both ends, as they were given"),
    Item(
        "bounds",
        "vertices",
        Work(written=VERTEX_MOTION + ROUNDED_MOTION + BOX + VERTEX_KDOP, comparisons=18, flops=12 + 52),
        "copy_motion(): 6 coordinates of 2 operations, 16 values of a k-DOP of 3 and 4 doublings; extent_of(): "
        "minimum, maximum and range of 6 coordinates",
    ),
    Item(
        "refit",
        "vertices",
        Work(read=BOX + VERTEX_KDOP + NUMBER, written=COORDINATES, comparisons=BOX_COMPARISONS + KDOP_COMPARISONS),
        "leaf_bounds(), join_kdops(): box and k-DOP joined with the leaf's, coordinates written to their lanes; most "
        "vertices are corners of several leaves",
    ),
    Item("refit", "leaves", Work(written=LEAF_KDOP + BOX), "fit_leaf(): its k-DOP, and its lane of a block"),
    Item("refit", "nodes", Work(written=NODE, comparisons=BOX_COMPARISONS), "join_children()"),
    Item("nodes", "nodes", Work(read=NODE), "all of them once"),
    Item("nodes", "node_pairs", Work(touched=2 * NODE, comparisons=BOX_COMPARISONS), "Node::overlaps()"),
    Item(
        "nodes",
        "leaf_pairs",
        Work(touched=BOX + 2 * LEAF_KDOP, comparisons=BOX_COMPARISONS + KDOP_COMPARISONS),
        "block_pairs(): those that are found; nobody counts what was compared for nothing",
    ),
    Item("leaf pairs", "leaves", Work(read=LEAF_ROWS + LEAF_CORNERS + NODE), "rows of corners, once"),
    Item(
        "leaf pairs",
        "leaf_visits",
        Work(touched=LEAF_ROWS + LEAF_CORNERS + NODE, comparisons=16 * BOX_COMPARISONS),
        "leaf_features.inl: on which sides of the other leaf's box the corners lie; what is near is then compared one "
        "by one, which nobody counts",
    ),
    Item("leaf pairs", "candidates", Work(touched=2 * NUMBER), "two numbers written"),
    Item("k-DOPs", "vertices", Work(read=VERTEX_KDOP), "all of them once"),
    Item(
        "k-DOPs",
        "candidates",
        Work(touched=4 * VERTEX_KDOP + 2 * NUMBER, comparisons=4 * 16 + 2 * 16),
        "list_near(): four rows of 16, joined two and two by minimum and maximum, compared twice",
    ),
    Item("tests", "vertices", Work(read=ROUNDED_MOTION), "all of them once"),
    Item(
        "tests",
        "tested",
        Work(touched=4 * ROUNDED_MOTION, comparisons=LOAD + MAGNITUDES + CUBIC + ERROR + 12 + ONE_ROOT),
        "sort_out(), in single precision: the cubic, its error bound, the signs of its coefficients",
    ),
    *(
        Item(
            "tests",
            f"{kind}_outside",
            Work(comparisons=PROJECTION + BEYOND[kind]),
            "certainly_outside(); those that are not found outside cost as much, which nobody counts",
        )
        for kind in ("vf", "ee")
    ),
    *(
        Item(
            "tests",
            f"{kind}_rooted",
            Work(comparisons=QUICK_STEPS + INSIDE[kind]),
            "certainly_apart_at_root(); many_roots_test() does more",
        )
        for kind in ("vf", "ee")
    ),
    *(
        Item(
            "tests",
            f"{kind}_contacts",
            Work(
                touched=VERTICES,
                flops=LOAD + MAGNITUDES + CUBIC + ERROR + NEWTON * NEWTON_STEPS + ROOT_END + INSIDE[kind],
            ),
            "single_root_test(): four steps of Newton's method, then inside(); many_roots_test() does more",
        )
        for kind in ("vf", "ee")
    ),
    *(
        Item(
            "contacts",
            f"{kind}_contacts",
            Work(read=2 * CONTACT, written=CONTACT + HANDED_OUT[kind], comparisons=3),
            "order.cpp: distributed, read again and handed out; a bucket of eight is sorted",
        )
        for kind in ("vf", "ee")
    ),
)


def of_stage(stage: str, counts: dict[str, float]) -> Work:
    return sum((item.work.times(counts[item.count]) for item in TABLE if item.stage == stage), Work())


def counts(step: Step, stats: dict[str, float]) -> dict[str, float]:
    """Of one step, with what the core counted in it (`detector.stats`). Bounds of static meshes are kept."""
    moving = [mesh for mesh in step.meshes if not mesh.static]
    vertices, faces = (sum(n) for n in (map(_n_vertices, moving), (len(mesh.faces) for mesh in moving)))
    leaves = -(-faces // 8)  # at least: a leaf holds at most eight triangles
    found = {
        "vertices": vertices,
        "leaves": leaves,
        "nodes": 2 * leaves - 1 if leaves else 0,
        "position_bytes": 2 * 3 * step.vertices_t0.dtype.itemsize * vertices,
        "node_pairs": stats["node_pairs"],
        "leaf_pairs": stats["leaf_pairs"],
        # A leaf with itself is one.
        "leaf_visits": 2 * stats["leaf_pairs"] - min(leaves, stats["leaf_pairs"]),
        "candidates": _both(stats, "candidates"),
        "tested": _both(stats, "candidates") - _both(stats, "rejected_slabs"),
    }
    for kind in ("vf", "ee"):
        after = stats[f"{kind}_candidates"] - stats[f"{kind}_rejected_slabs"]
        found[f"{kind}_outside"] = stats[f"{kind}_rejected_projection"]
        found[f"{kind}_rooted"] = after - stats[f"{kind}_rejected_coplanarity"] - found[f"{kind}_outside"]
        found[f"{kind}_contacts"] = stats[f"{kind}_contacts"]
    return found


def average(many: Sequence[dict[str, float]]) -> dict[str, float]:
    return {name: sum(one[name] for one in many) / len(many) for name in many[0]}


def _n_vertices(mesh) -> int:
    return mesh.n_vertices


def _both(stats, name) -> float:
    return stats[f"vf_{name}"] + stats[f"ee_{name}"]
