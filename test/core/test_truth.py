# SPDX-License-Identifier: Apache-2.0
"""Published scenes and queries with exact ground truth."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core import _core

CORE = {"vertex-face": hc.test_vertex_face, "edge-edge": hc.test_edge_edge}
SCENES = pytest.mark.parametrize("name", ["cloth-ball", "n-body", "cloth-funnel"])


def detect(scene_file, accuracy, **options):
    scene = hc.Scene()
    scene.add_mesh("scene", scene_file["faces"], n_vertices=len(scene_file["vertices_t0"]))
    detector = hc.Detector(scene, accuracy=accuracy, **options)
    return detector.detect(scene_file["vertices_t0"], scene_file["vertices_t1"])


def matched(pairs, true_pairs):
    """Positions in pairs of each true pair, -1 where it is missing."""
    index = {row: i for i, row in enumerate(map(tuple, pairs.tolist()))}
    return np.array([index.get(row, -1) for row in map(tuple, true_pairs.tolist())])


@SCENES
def test_exact(data_folder, name):
    with np.load(data_folder / f"{name}.npz") as truth:
        contacts = detect(truth, "exact")
        for kind in ("vf", "ee"):
            np.testing.assert_array_equal(getattr(contacts, kind), truth[kind])
            np.testing.assert_allclose(getattr(contacts, kind + "_toc"), truth[kind + "_toc"], rtol=0, atol=1e-12)
        assert contacts.first_toc == min(contacts.vf_toc.min(), contacts.ee_toc.min())


@SCENES
def test_conservative(data_folder, name):
    # False positives of Tight-Inclusion at its tolerance 1e-6 (vertex-face, edge-edge).
    allowed = {"cloth-ball": (2, 3), "n-body": (1, 5), "cloth-funnel": (65, 156)}[name]
    with np.load(data_folder / f"{name}.npz") as truth:
        contacts = detect(truth, "conservative")
        for kind, invented in zip(("vf", "ee"), allowed, strict=True):
            found, toc = getattr(contacts, kind), getattr(contacts, kind + "_toc")
            where = matched(found, truth[kind])
            assert (where >= 0).all()
            assert (toc[where] <= np.nextafter(truth[kind + "_toc"], 2)).all(), "the truth is rounded down"
            assert len(found) - len(where) <= invented


@pytest.mark.parametrize(("name", "missed"), [("cloth-ball", 0)])
def test_balanced(data_folder, name, missed):
    with np.load(data_folder / f"{name}.npz") as truth:
        contacts = detect(truth, "balanced")
        for kind in ("vf", "ee"):
            where = matched(getattr(contacts, kind), truth[kind])
            assert (where < 0).sum() <= missed
            assert len(getattr(contacts, kind)) == len(truth[kind])


@SCENES
@pytest.mark.parametrize("simd", _core.simd_levels())
def test_fast(data_folder, name, simd):
    """It promises nothing, and yet: at most one contact in a thousand wrong."""
    with np.load(data_folder / f"{name}.npz") as truth:
        contacts = detect(truth, "fast", backend="cpu", simd=simd)
        true = sum(len(truth[kind]) for kind in ("vf", "ee"))
        wheres = [matched(getattr(contacts, kind), truth[kind]) for kind in ("vf", "ee")]
        missed = sum(int((where < 0).sum()) for where in wheres)
        assert missed <= 1e-3 * true
        assert len(contacts) - (true - missed) <= 1e-3 * true


@SCENES
def test_report_first(data_folder, name):
    with np.load(data_folder / f"{name}.npz") as truth:
        every, first = detect(truth, "exact"), detect(truth, "exact", report="first")
        assert first.first_toc == every.first_toc
        np.testing.assert_array_equal(first.vf, every.vf[every.vf_toc == every.first_toc])
        np.testing.assert_array_equal(first.ee, every.ee[every.ee_toc == every.first_toc])


@SCENES
def test_hash_is_the_same_on_any_number_of_threads(data_folder, name):
    with np.load(data_folder / f"{name}.npz") as truth:
        assert len({detect(truth, "exact", threads=threads).hash for threads in (1, 2, 5, 8)}) == 1


def test_queries(data_folder):
    with np.load(data_folder / "queries.npz") as file:
        names = [name.removesuffix("|q") for name in file.files if name.endswith("|q")]
        assert names
        for name in names:
            queries, true = file[name + "|q"], file[name + "|hit"]
            test = CORE[name.split("|")[1]]
            assert np.array_equal(test(queries, "exact")[0], true), name
            assert test(queries, "conservative")[0][true].all(), name
