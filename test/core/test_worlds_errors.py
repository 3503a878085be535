# SPDX-License-Identifier: Apache-2.0
"""An error in one of many worlds names its number, and leaves the detector unchanged."""

import threading

import many_worlds
import numpy as np
import pytest
from many_worlds import assert_contacts

import hpccd_core as hc
from hpccd_core import device_arrays


@pytest.fixture
def worlds():
    return many_worlds.crumpled(9)


@pytest.mark.parametrize(
    ("value", "error", "why"),
    [
        (0, ValueError, r"worlds: must lie in \[1, 65536\], got 0"),
        (-1, ValueError, r"got -1"),
        (65537, ValueError, r"got 65537"),
        (10**30, ValueError, r"got 1e30"),
        (True, TypeError, "worlds: expected an integer, got bool"),
        (1.5, TypeError, "worlds: expected an integer, got float"),
        ("4", TypeError, "worlds: expected an integer, got str"),
        ([4], TypeError, "worlds: expected an integer, got list"),
    ],
)
def test_how_many(worlds, value, error, why):
    with pytest.raises(error, match=why):
        hc.Detector(worlds.scene, worlds=value)


@pytest.mark.parametrize("value", [np.int32(2), np.uint8(2), 2])
def test_any_integer_will_do(worlds, value):
    assert hc.Detector(worlds.scene, backend="cpu", worlds=value).worlds == 2


def test_shapes(worlds):
    detector = worlds.detector()
    v = worlds.start
    for wrong in (v[0], v[:8], v[:, :-1], v[..., :2], v[None], v.reshape(-1, 3), np.empty((0, *v.shape[1:]))):
        for ask in (
            lambda x: detector.detect(v, x),
            detector.step,
            detector.intersections,
            detector.distances,
            lambda x: detector.proximity(x, 0.1),
            lambda x: detector.collision_free_step(x, v),
        ):
            with pytest.raises(ValueError, match=rf"vertices\S*: expected shape \(9, {v.shape[1]}, 3\), for each"):
                ask(wrong)
    with pytest.raises(ValueError, match=rf"expected shape \({v.shape[1]}, 3\), one row"):
        hc.Detector(worlds.scene, backend="cpu").detect(v, v)


@pytest.mark.parametrize("threads", [1, 2, 3, 16])
def test_a_bad_coordinate_is_named_and_nothing_else_is_lost(worlds, threads):
    detector = worlds.detector(threads=threads)
    expected = [d.detect(a, b) for d, a, b in zip(worlds.alone(), worlds.start, worlds.end, strict=True)]
    bad_start, bad_end = worlds.start.copy(), worlds.end.copy()
    bad_start[7, 17, 2] = np.nan
    bad_end[3, 5, 1] = -np.inf
    for _ in range(3):
        with pytest.raises(ValueError, match=r"^vertices_t0\[7, 17, 2\] is NaN; all coordinates must be finite"):
            detector.detect(bad_start, worlds.end)
        with pytest.raises(ValueError, match=r"^vertices_t1\[3, 5, 1\] is infinite"):  # the first bad world
            detector.detect(bad_start, bad_end)
        with pytest.raises(ValueError, match=r"^vertices_t1\[3, 5, 1\] is infinite"):
            detector.collision_free_step(bad_start, bad_end)
        for ask in (detector.intersections, detector.distances, lambda x: detector.proximity(x, 0.1)):
            with pytest.raises(ValueError, match=r"^vertices\[7, 17, 2\] is NaN"):
                ask(bad_start)
        assert detector.stats == {}
        assert_contacts(detector.detect(worlds.start, worlds.end), expected)


def test_a_rejected_step_does_not_count(worlds):
    detector = worlds.detector()
    bad = worlds.end.copy()
    bad[2, 0, 0] = np.nan
    with pytest.raises(ValueError, match=r"vertices\[2, 0, 0\] is nan"):
        detector.step(bad)
    detector.step(worlds.start)
    with pytest.raises(ValueError, match=r"vertices\[2, 0, 0\] is NaN"):
        detector.step(bad)
    expected = [d.detect(a, b) for d, a, b in zip(worlds.alone(), worlds.start, worlds.end, strict=True)]
    assert_contacts(detector.step(worlds.end), expected)


@pytest.mark.parametrize("k", [9, -1, 10**9])
def test_a_world_that_is_not_there(worlds, k):
    detector = worlds.detector()
    for result in (
        detector.detect(worlds.start, worlds.end),
        detector.proximity(worlds.start, 0.1),
        detector.intersections(worlds.start),
    ):
        with pytest.raises(ValueError, match=r"world: must lie in \[0, 8\]"):
            result.world(k)
    with pytest.raises(ValueError, match=r"world: must lie in \[0, 0\]"):
        hc.Detector(worlds.scene, backend="cpu").detect(worlds.start[0], worlds.end[0]).world(k)


@pytest.mark.parametrize("k", [1.0, "0", None, True])
def test_a_world_has_a_number(worlds, k):
    with pytest.raises(TypeError, match="world: expected an integer"):
        worlds.detector().detect(worlds.start, worlds.end).world(k)


@pytest.mark.parametrize("threads", [1, 2, 16])
def test_cancelled(threads):
    worlds = many_worlds.crumpled(400)
    detector = worlds.detector(threads=threads)
    timer = threading.Timer(0.05, detector.cancel)
    timer.start()
    with pytest.raises(hc.Cancelled):
        while True:
            detector.detect(worlds.start, worlds.end)
    with pytest.raises(hc.Cancelled):
        detector.collision_free_step(worlds.start, worlds.end)
    timer.join()


def test_a_separation_from_the_next_call_on_in_every_world(worlds):
    together, alone = worlds.detector(), worlds.alone()
    for separation in (0.1, 0.0, 0.02):
        for detector in (together, *alone):
            detector.set_separation(0, 0, separation)
        expected = [d.detect(a, b) for d, a, b in zip(alone, worlds.start, worlds.end, strict=True)]
        assert_contacts(together.detect(worlds.start, worlds.end), expected)


class OnDevice:
    """Stands for an array in a GPU's memory; nobody looks there."""

    def __init__(self, shape, strides=None):
        self.__cuda_array_interface__ = {"shape": shape, "typestr": "<f8", "data": (4096, False), "strides": strides}


@pytest.mark.parametrize(
    ("shape", "strides"),
    [
        ((4, 5, 3), None),
        ((4, 5, 3), (120, 24, 8)),
        ((1, 5, 3), (7, 24, 8)),
        ((4, 1, 3), (24, 0, 8)),
        ((0, 5, 3), (1,) * 3),
    ],
)
def test_arrays_on_the_device(shape, strides):
    place = device_arrays.positions("vertices", OnDevice(shape, strides), shape)
    assert place == (4096, True, None)


@pytest.mark.parametrize(
    ("array", "why"),
    [
        (OnDevice((5, 3)), r"expected shape \(4, 5, 3\), for each world one row per vertex of the scene, got \(5, 3\)"),
        (OnDevice((3, 5, 3)), r"got \(3, 5, 3\)"),
        (OnDevice((4, 5, 3), (240, 24, 8)), "must be C-contiguous"),
    ],
)
def test_other_arrays_on_the_device(array, why):
    with pytest.raises(ValueError, match=f"vertices: {why}" if why.startswith("exp") else why):
        device_arrays.positions("vertices", array, (4, 5, 3))


def test_a_scene_without_vertices():
    detector = hc.Detector(hc.Scene(), backend="cpu", worlds=3)
    nothing = np.empty((3, 0, 3))
    found = detector.detect(nothing, nothing)
    assert len(found) == 0 and found.vf_offsets.tolist() == [0, 0, 0, 0] and found.hash == 0
    assert detector.collision_free_step(nothing, nothing).tolist() == [1, 1, 1]
    assert detector.distances(nothing) == [[], [], []]
