# SPDX-License-Identifier: Apache-2.0
"""The results about the parts of a step are that about the step."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.parts import hash_of
from hpccd_core.rigid.merged import merged

OUTPUTS = ("points", "normals", "closest")


def soup(seed, n=60):
    rng = np.random.default_rng(seed)
    scene = hc.Scene()
    scene.add_mesh("soup", np.arange(3 * n).reshape(-1, 3))
    return scene, rng.random((3 * n, 3)), rng.random((3 * n, 3))


def in_parts(detector, start, end, parts):
    frames = [start + (end - start) * (k / parts) for k in range(parts)] + [end]
    return [detector.detect(a, b) for a, b in pairwise(frames)]


def test_hash_as_of_the_core():
    scene, start, end = soup(0)
    found = hc.Detector(scene).detect(start, end)
    assert len(found.vf) and len(found.ee)
    assert hash_of(found) == found.hash
    assert hash_of(hc.Contacts.none()) == hc.Contacts.none().hash
    assert hash_of(replace(found, vf_toc=found.vf_toc / 2)) != found.hash


@pytest.mark.parametrize("separation", [0.0, 0.01])
@pytest.mark.parametrize("parts", [1, 2, 7])
def test_a_straight_step_in_parts_is_the_step(parts, separation):
    scene, start, end = soup(1)
    detector = hc.Detector(scene, outputs=OUTPUTS, minimum_separation=separation)
    whole = detector.detect(start, end)
    found = merged(in_parts(detector, start, end, parts), parts)
    assert len(whole) > 100
    for name in ("vf", "ee"):
        assert np.array_equal(getattr(found, name), getattr(whole, name))
    for name in ("vf_toc", "ee_toc", "points", "closest"):
        assert np.allclose(getattr(found, name), getattr(whole, name), rtol=0, atol=1e-9)
    assert found.first_toc == pytest.approx(whole.first_toc, abs=1e-12)
    assert found.hash == hash_of(found)
    assert len(found.normals) == len(found)


def test_each_pair_has_what_the_earliest_part_says():
    scene, start, end = soup(2)
    detector = hc.Detector(scene, outputs=OUTPUTS)
    parts = in_parts(detector, start, end, 4)
    found = merged(parts, 4)
    seen = {}
    for part, contacts in enumerate(parts):
        n = len(contacts.vf)
        for row, pair in enumerate(map(tuple, contacts.vf.tolist())):
            seen.setdefault(pair, ((part + contacts.vf_toc[row]) / 4, *contacts.normals[row]))
        for row, pair in enumerate(map(tuple, contacts.ee.tolist())):
            seen.setdefault(pair, ((part + contacts.ee_toc[row]) / 4, *contacts.normals[n + row]))
    mine = [tuple(pair) for pair in found.vf.tolist()] + [tuple(pair) for pair in found.ee.tolist()]
    assert mine == sorted(p for p in seen if len(p) == 2) + sorted(p for p in seen if len(p) == 4)
    said = zip(np.concatenate([found.vf_toc, found.ee_toc]).tolist(), found.normals.tolist(), strict=True)
    assert [seen[pair] for pair in mine] == [(toc, *normal) for toc, normal in said]


def test_rows_in_any_order_are_the_same_step():
    scene, start, end = soup(5)
    parts = in_parts(hc.Detector(scene), start, end, 4)
    rng = np.random.default_rng(5)
    shuffled = []
    for contacts in parts:
        of_vf, of_ee = rng.permutation(len(contacts.vf)), rng.permutation(len(contacts.ee))
        vf, vf_toc = contacts.vf[of_vf], contacts.vf_toc[of_vf]
        ee, ee_toc = contacts.ee[of_ee], contacts.ee_toc[of_ee]
        shuffled.append(replace(contacts, vf=vf, vf_toc=vf_toc, ee=ee, ee_toc=ee_toc))
    found, wanted = merged(shuffled, 4), merged(parts, 4)
    assert found.hash == wanted.hash
    for name in ("vf", "vf_toc", "ee", "ee_toc"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name))


def test_pairs_that_were_not_cut():
    """Self-contacts from one call, those of two meshes from parts: together what the scene has."""
    rng = np.random.default_rng(4)
    start, end = rng.random((2, 120, 3))
    faces = np.arange(60).reshape(-1, 3)

    def detector(selves, between):
        scene = hc.Scene()
        for name in "ab":
            scene.add_mesh(name, faces, self_collision=selves)
        if not between:
            scene.ignore_pair("a", "b")
        return hc.Detector(scene, outputs=OUTPUTS)

    whole = detector(True, True).detect(start, end)
    own = detector(True, False).detect(start, end)
    found = merged(in_parts(detector(False, True), start, end, 3), 3, own)
    assert len(whole) > len(own) > 0
    for name in ("vf", "ee"):
        assert np.array_equal(getattr(found, name), getattr(whole, name))
    for name in ("vf_toc", "ee_toc", "points"):
        assert np.allclose(getattr(found, name), getattr(whole, name), rtol=0, atol=1e-9)
    assert merged([detector(False, True).detect(start, end)], 1, own).hash == whole.hash


def test_without_contacts_and_without_outputs():
    none = hc.Contacts.none()
    found = merged([none, none, none], 3)
    assert (len(found), found.first_toc, found.hash, found.outputs) == (0, np.inf, none.hash, {})
    with_points = hc.Contacts.none(outputs=("points",))
    assert merged([with_points, with_points], 2).points.shape == (0, 3)


def test_a_detector_that_reports_the_first_needs_no_later_parts():
    scene, start, end = soup(3)
    parts = in_parts(hc.Detector(scene, report="first"), start, end, 6)
    k = next(k for k, contacts in enumerate(parts) if len(contacts))
    whole = hc.Detector(scene, report="first").detect(start, end)
    assert merged(parts[: k + 1], 6).first_toc == pytest.approx(whole.first_toc, abs=1e-12)


def test_errors():
    with pytest.raises(ValueError, match="has 1"):
        merged([hc.Contacts.none()] * 2, 1)
    with pytest.raises(ValueError, match="worlds"):
        merged([hc.Contacts.none(2)], 2)
    with pytest.raises(ValueError, match="as a detector returned them"):
        merged([replace(hc.Contacts.none(), vf_toc=np.zeros(1)), hc.Contacts.none()], 2)
