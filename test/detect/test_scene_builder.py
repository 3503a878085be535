# SPDX-License-Identifier: Apache-2.0
"""Which pairs of meshes a scene tests. Finding them takes time in proportion to pairs, not to pairs times names."""

from itertools import combinations

import numpy as np
import pytest

from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import JOINTS, MeshSettings, Topology

FACE = Topology(0, 3, np.array([[0, 1, 2]], np.uint32))


def pairs_by_definition(builder):
    ignored = {frozenset(pair) for pair in builder.ignored_pairs}
    found = {(a.name, a.name) for a in builder.meshes if a.self_collision and not a.static}
    return found | {
        (a.name, b.name)
        for a, b in combinations(builder.meshes, 2)
        if not (a.static and b.static) and frozenset((a.name, b.name)) not in ignored
    }


@pytest.mark.parametrize("seed", range(20))
def test_the_tested_pairs_are_those_of_rigid_meshes_and_the_others(seed):
    rng = np.random.default_rng(seed)
    meshes = tuple(
        MeshSettings(
            f"m{k}",
            static=bool(rng.random() < 0.3),
            self_collision=bool(rng.random() < 0.7),
            input=JOINTS if rng.random() < 0.4 else "vertices",
        )
        for k in range(8)
    )
    ignored = tuple(
        pair if rng.random() < 0.5 else pair[::-1]
        for pair in combinations([mesh.name for mesh in meshes], 2)
        if rng.random() < 0.3
    )
    builder = SceneBuilder(meshes, ignored)
    pairs = builder.tested_pairs
    assert list(pairs) == sorted(pairs) and set(pairs) == pairs_by_definition(builder)
    rigid = {mesh.name for mesh in meshes if mesh.rigid}
    others = {pair for pair in pairs if not rigid & set(pair)}
    left = builder.of_other_pairs()
    assert (set() if left is None else pairs_by_definition(left)) == others
    assert pairs_by_definition(builder.of_rigid_pairs()) == {(a, b) for a, b in pairs if a != b} - others
    assert builder.pairs == [(a, b) for a, b in pairs if a != b]


class CountedName(str):
    """Counts how often such a name is hashed or compared, which is the cost of looking it up."""

    looked_at = 0

    def __hash__(self):
        CountedName.looked_at += 1
        return super().__hash__()

    def __eq__(self, other):
        CountedName.looked_at += 1
        return super().__eq__(other)


@pytest.mark.parametrize("work", ["build", "tested_pairs", "of_rigid_pairs", "of_other_pairs", "among"])
def test_names_are_looked_at_a_few_times_a_pair_however_many_there_are(work):
    """Links fixed to one base: each pair is ignored. 1,000 of them took 20 s, which blocked everything else."""

    def cost(links):
        meshes = tuple(MeshSettings(CountedName(f"arm/{k}"), self_collision=False, input=JOINTS) for k in range(links))
        ignored = tuple(combinations([mesh.name for mesh in meshes], 2))
        builder = SceneBuilder((MeshSettings(CountedName("cloth")), *meshes), ignored)
        arguments = {"build": [(FACE,) * (links + 1)], "among": [[mesh.name for mesh in builder.meshes]]}
        CountedName.looked_at = 0
        found = getattr(builder, work)
        if callable(found):
            found(*arguments.get(work, []))
        return CountedName.looked_at / len(ignored)

    assert cost(80) < 1.2 * cost(20) and cost(80) < 15
