# SPDX-License-Identifier: Apache-2.0
"""A step in brief: the entry of two meshes."""

from hpccd.msg import PairSummary, PairSummaryArray


def pair_summary(message: PairSummaryArray, mesh_a: str, mesh_b: str) -> PairSummary:
    """That of two meshes, whichever comes first; of one mesh: its name twice.

    Raises ValueError where they are not tested against each other, or there are no such meshes.
    """
    for pair in message.pairs:
        if {pair.mesh_a, pair.mesh_b} == {mesh_a, mesh_b}:
            return pair
    there = ", ".join(f"{pair.mesh_a} and {pair.mesh_b}" for pair in message.pairs) or "none"
    raise ValueError(f"mesh_a, mesh_b: {mesh_a!r} and {mesh_b!r} are no pair that is tested; there are {there}")
