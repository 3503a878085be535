# SPDX-License-Identifier: Apache-2.0
"""Results are compared row by row."""

import dataclasses

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc
from hpccd_core.parts import contacts_of_step, hash_of

QUERIES = {
    "contacts": lambda d, m: d.detect(m.vertices_t0, m.vertices_t1),
    "proximity": lambda d, m: d.proximity(m.vertices_t0, 0.3),
    "intersections": lambda d, m: d.intersections(m.vertices_t0),
}
OUTPUTS = ("points", "normals", "closest")


@pytest.fixture(scope="module")
def meshes():
    return random_scenes.many_meshes(np.random.default_rng(1))


@pytest.mark.parametrize("query", QUERIES)
def test_results_are_equal_where_all_rows_are(meshes, query):
    ask = QUERIES[query]
    found = ask(hc.Detector(meshes.scene(), outputs=OUTPUTS, backend="cpu"), meshes)
    again = ask(hc.Detector(meshes.scene(), outputs=OUTPUTS, backend="cpu", threads=1), meshes)
    assert len(found) > 1 and found == again and not found != again
    outputs = getattr(found, "outputs", {})
    arrays = {f.name: getattr(found, f.name) for f in dataclasses.fields(found) if f.compare} | outputs
    for name, value in arrays.items():
        if isinstance(value, np.ndarray) and len(value):
            changed = value.copy()
            changed.flat[-1] += 1
            for other in (changed, value[:-1], value.astype(np.float16)):
                given = {"outputs": outputs | {name: other}} if name in outputs else {name: other}
                assert found != dataclasses.replace(found, **given), name
    for name in outputs:
        others = {other: rows for other, rows in outputs.items() if other != name}
        assert found != dataclasses.replace(found, outputs=others), name
    assert found != dataclasses.replace(found, hash=found.hash ^ 1)
    assert found != None and found != 3  # noqa: E711
    with pytest.raises(TypeError, match="unhashable"):
        hash(found)


@pytest.mark.parametrize("query", QUERIES)
def test_worlds_are_equal_where_each_is(meshes, query):
    class Two:
        vertices_t0, vertices_t1 = (np.stack([v, v + 1]) for v in (meshes.vertices_t0, meshes.vertices_t1))

    ask = QUERIES[query]
    together = ask(hc.Detector(meshes.scene(), worlds=2, backend="cpu"), Two)
    assert together == ask(hc.Detector(meshes.scene(), worlds=2, backend="cpu"), Two)
    alone = ask(hc.Detector(meshes.scene(), backend="cpu"), meshes)
    assert together.world(0) == alone and together != alone


def test_gaps(meshes):
    found, again = (hc.Detector(meshes.scene(), backend="cpu").distances(meshes.vertices_t0) for _ in range(2))
    assert found == again and found[0] != found[1]
    assert dataclasses.replace(found[0], points=found[0].points + 1) != found[0]
    with pytest.raises(TypeError, match="unhashable"):
        hash(found[0])


def _two_parts(meshes, **options):
    detector = hc.Detector(meshes.scene(), backend="cpu", **options)
    middle = (meshes.vertices_t0 + meshes.vertices_t1) / 2
    return detector.detect(meshes.vertices_t0, middle), detector.detect(middle, meshes.vertices_t1)


@pytest.mark.parametrize(
    ("part", "parts", "error", "text"),
    [
        (5, 2, ValueError, r"results\[0\], part: must lie in \[0, 1\], got 5"),
        (-1, 2, ValueError, r"results\[0\], part: must lie in \[0, 1\], got -1"),
        (0, 0, ValueError, r"results\[0\], parts: must lie in \[1,"),
        (0, -1, ValueError, r"results\[0\], parts: must lie in \[1,"),
        (float("nan"), 1, TypeError, r"results\[0\], part: expected an integer, got float"),
        (0, 1.5, TypeError, r"results\[0\], parts: expected an integer, got float"),
    ],
)
def test_parts_that_a_step_does_not_have(meshes, part, parts, error, text):
    first, _ = _two_parts(meshes)
    with pytest.raises(error, match=text):
        contacts_of_step([(first, part, parts)])


def test_results_that_do_not_belong_to_one_step(meshes):
    first, second = _two_parts(meshes)
    _, with_points = _two_parts(meshes, outputs=("points",))
    assert len(first) and len(second)
    with pytest.raises(ValueError, match="results: some have points and others do not; use detectors with the same"):
        contacts_of_step([(first, 0, 2), (with_points, 1, 2)])
    assert len(contacts_of_step([(hc.Contacts.none(), 0, 2), (with_points, 1, 2)]).points) == len(with_points)
    with pytest.raises(TypeError, match=r"results\[1\]: expected hpccd_core.Contacts, got Proximity"):
        contacts_of_step([(first, 0, 2), (QUERIES["proximity"](hc.Detector(meshes.scene()), meshes), 1, 2)])
    with pytest.raises(TypeError, match=r"results\[0\]: expected \(contacts, part, parts\), got Contacts"):
        contacts_of_step([first])
    for bad in (first.vf.astype(np.int64), first.vf.tolist(), first.vf[:, :1]):
        with pytest.raises(TypeError, match=r"contacts: vf is not an array as detectors return it"):
            hash_of(dataclasses.replace(first, vf=bad))
    with pytest.raises(ValueError, match="contacts: contacts of many worlds"):
        hash_of(hc.Contacts.none(2))
