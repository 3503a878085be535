# SPDX-License-Identifier: Apache-2.0
"""The oracle itself: against distances computed another way, and by symmetries that hold whatever it does."""

from fractions import Fraction

import numpy as np
import oracle
import pytest
from distances import distance_at
from fuzz.generators import EDGE_EDGE, GENERATORS, VERTEX_FACE

ORACLE = {VERTEX_FACE: oracle.vertex_face, EDGE_EDGE: oracle.edge_edge}
# Their coordinates are small integers: features that do not touch stay far apart compared with rounding.
INTEGER_GENERATORS = ("lattice", "still", "on_line", "parallel_at_root", "thin", "meeting", "chosen_roots")


@pytest.mark.parametrize("kind", GENERATORS)
@pytest.mark.parametrize("generator", INTEGER_GENERATORS)
def test_distance_is_zero_at_toc_and_not_before(kind, generator):
    queries = GENERATORS[kind][generator](np.random.default_rng(11), 800)
    hit, toc = ORACLE[kind](queries)
    assert hit.any() and not hit.all()
    assert distance_at(kind, queries, np.where(hit, toc, 0))[hit].max() < 1e-12

    fractions = {i / n for n in (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 100) for i in range(n + 1)}
    times = np.array(sorted(fractions))[:, None] + np.zeros(len(queries))
    touching = distance_at(kind, queries, times) < 1e-13
    assert not (touching & (times < toc - 1e-9)).any()


@pytest.mark.parametrize("kind", GENERATORS)
def test_reversed_time_and_swapped_axes_change_no_result(kind):
    for generator in GENERATORS[kind].values():
        queries = generator(np.random.default_rng(5), 300)
        hit, toc = ORACLE[kind](queries)
        assert np.array_equal(hit, ORACLE[kind](np.roll(queries, 4, axis=1))[0])
        for same in (queries[:, :, ::-1], -queries, 2.0**-400 * queries):
            same_hit, same_toc = ORACLE[kind](same)
            assert np.array_equal(hit, same_hit)
            assert np.array_equal(toc, same_toc)


def test_toc_is_rounded_down():
    # The vertex falls from height n to n - d through a still triangle: contact at n/d.
    for n, d in ((1, 3), (2, 3), (1, 10), (7, 11), (3, 4), (1, 1), (0, 5)):
        triangle = [[-1, -1, 0], [2, -1, 0], [-1, 2, 0]]
        hit, toc = oracle.vertex_face(np.array([[[0, 0, n], *triangle, [0, 0, n - d], *triangle]]))
        assert hit[0]
        assert Fraction(toc[0]) <= Fraction(n, d) < Fraction(np.nextafter(toc[0], 2))


def test_published_queries(data_folder):
    with np.load(data_folder / "queries.npz") as file:
        names = [name.removesuffix("|q") for name in file.files if name.endswith("|q")]
        assert names
        for name in names:
            kind = name.split("|")[1]
            hit, _ = ORACLE[kind](file[name + "|q"])
            assert np.array_equal(hit, file[name + "|hit"]), name


@pytest.mark.parametrize("scene", ["cloth-ball", "n-body", "cloth-funnel"])
def test_sample_of_published_contacts(data_folder, scene):
    rng = np.random.default_rng(0)
    with np.load(data_folder / f"{scene}.npz") as d:
        both = np.concatenate([d["vertices_t0"][None], d["vertices_t1"][None]]).astype(float)
        for kind, name in ((VERTEX_FACE, "vf"), (EDGE_EDGE, "ee")):
            rows = rng.permutation(len(d[name]))[:1000]
            pairs, true_toc = d[name][rows], d[name + "_toc"][rows]
            points = pairs if kind == EDGE_EDGE else np.hstack([pairs[:, :1], d["faces"][pairs[:, 1]]])
            hit, toc = ORACLE[kind](np.hstack([both[0][points], both[1][points]]))
            assert hit.all()
            np.testing.assert_allclose(toc, true_toc, rtol=0, atol=1e-15)


@pytest.mark.parametrize("bad", [np.zeros((3, 8)), np.zeros((1, 4, 3)), np.full((1, 8, 3), np.nan)])
def test_bad_queries_are_rejected(bad):
    with pytest.raises(ValueError, match="queries"):
        oracle.vertex_face(bad)
