# SPDX-License-Identifier: Apache-2.0
"""Stamps and names as programs have them: Time, seconds by mistake, whole robots; the examples of the reference."""

import doctest
import importlib
import inspect
import itertools
import math
import pkgutil
import time
import warnings

import numpy as np
import pytest
from builtin_interfaces.msg import Time as TimeMessage
from hpccd.msg import DistanceArray, PairSummary, PairSummaryArray
from rclpy.clock import ClockType
from rclpy.time import Time

from hpccd_ros import client

VERTICES = np.zeros((3, 3))


@pytest.mark.parametrize(
    "stamp",
    [
        5_000_000_007,
        np.int64(5_000_000_007),
        Time(seconds=5, nanoseconds=7),
        Time(seconds=5, nanoseconds=7, clock_type=ClockType.ROS_TIME),
        TimeMessage(sec=5, nanosec=7),
    ],
)
def test_stamps(stamp):
    for message in (client.vertices_message(VERTICES, stamp), client.topology_message([[0, 1, 2]], 3, stamp_ns=stamp)):
        assert message.header.stamp == TimeMessage(sec=5, nanosec=7)


@pytest.mark.parametrize(
    "stamp, error, words",
    [
        (1795815944.9, TypeError, r"stamp_ns: expected an integer, nanoseconds .*got float \(seconds\?\); give a Time"),
        (np.float64(0.5), TypeError, "stamp_ns: expected an integer, nanoseconds .*got float64"),
        (TimeMessage(sec=-1), ValueError, "stamp_ns: stamp has sec -1 .* sec must not be negative"),
        (Time(seconds=2**31), ValueError, "stamp_ns: must lie in"),
        (None, TypeError, "stamp_ns: expected an integer, got NoneType"),
        (True, TypeError, "stamp_ns: expected an integer, got bool"),
    ],
)
def test_stamps_that_are_rejected(stamp, error, words):
    with pytest.raises(error, match=words):
        client.vertices_message(VERTICES, stamp)


def test_seconds_as_nanoseconds_are_noticed():
    with pytest.warns(UserWarning, match=r"stamp_ns: \d+ is the present time in seconds, but counts as nanoseconds"):
        message = client.vertices_message(VERTICES, int(time.time()))
    assert message.header.stamp.sec <= 2, "it is taken as it is"


def test_simulated_time_raises_no_alarm():
    """From 0, in steps of a 240th of a second; a stamp as near to the present time in seconds would be by chance."""
    now = time.time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for stamp in [0, 1, *range(0, 10 * 10**9, 10**9 // 240)]:
            if abs(stamp - now) > 60:
                client.vertices_message(VERTICES, stamp)
        client.vertices_message(VERTICES, time.time_ns())


def summaries():
    pairs = [
        ("arm/hand", "cloth", 2, 0.25, 0.5),
        ("arm/elbow", "cloth", 1, 0.75, 0.25),
        ("arm/hand", "table", 0, math.inf, math.nan),
        ("arm/elbow", "table", 0, math.inf, 2.0),
        ("arm/elbow", "arm/hand", 4, 0.5, 0.125),
        ("cloth", "table", 3, 0.0, 0.0),
        ("cloth", "arms", 7, 0.5, 0.0),
    ]
    names = ("mesh_a", "mesh_b", "count", "first_toc", "distance")
    return PairSummaryArray(pairs=[PairSummary(**dict(zip(names, pair, strict=True))) for pair in pairs])


@pytest.mark.parametrize(
    "names, expected",
    [
        (("arm", "cloth"), ("arm", "cloth", 3, 0.25, 0.25)),
        (("cloth", "arm"), ("arm", "cloth", 3, 0.25, 0.25)),
        (("arm/hand", "cloth"), ("arm/hand", "cloth", 2, 0.25, 0.5)),
        (("table", "arm"), ("arm", "table", 0, math.inf, math.nan)),
        (("arm", "arm"), ("arm", "arm", 4, 0.5, 0.125)),
        (("arm", "arm/hand"), ("arm", "arm/hand", 4, 0.5, 0.125)),
        (("table", "cloth"), ("cloth", "table", 3, 0.0, 0.0)),
    ],
)
def test_summaries_of_whole_robots(names, expected):
    found = client.pair_summary(summaries(), *names)
    assert (found.mesh_a, found.mesh_b, found.count, found.first_toc) == expected[:4]
    assert found.distance == pytest.approx(expected[4], abs=0, nan_ok=True)


def test_summaries_are_those_of_the_pairs_selected_one_by_one():
    random, meshes = np.random.default_rng(5), ["arm/hand", "arm/elbow", "arm2/hand", "cloth"]
    is_in = lambda mesh, name: name in (mesh, mesh.partition("/")[0])  # noqa: E731
    for _ in range(50):
        pairs = [
            PairSummary(
                mesh_a=a,
                mesh_b=b,
                count=int(random.integers(9)),
                first_toc=random.random(),
                distance=0.5,
                inside=int(random.choice([0, 0, 1, 2, 3])) if a != b else 0,
            )
            for k, a in enumerate(meshes)
            for b in meshes[k:]
            if random.random() < 0.8
        ]
        for x, y in itertools.product(["arm", "arm2", *meshes], repeat=2):
            chosen = [
                pair
                for pair in pairs
                if any(is_in(pair.mesh_a, a) and is_in(pair.mesh_b, b) for a, b in ((x, y), (y, x)))
            ]
            if chosen:
                found = client.pair_summary(PairSummaryArray(pairs=pairs), x, y)
                assert {found.mesh_a, found.mesh_b} == {x, y} and found.count == sum(pair.count for pair in chosen)
                assert found.first_toc == min(pair.first_toc for pair in chosen)
                if is_in(x, y) or is_in(y, x):
                    continue  # both links are of both sides
                into = [(p.mesh_a, p.mesh_b) for p in chosen if p.inside & PairSummary.INSIDE_A]
                into += [(p.mesh_b, p.mesh_a) for p in chosen if p.inside & PairSummary.INSIDE_B]
                for bit, a, b in ((1, found.mesh_a, found.mesh_b), (2, found.mesh_b, found.mesh_a)):
                    assert bool(found.inside & bit) == any(is_in(p, a) and is_in(q, b) for p, q in into)


@pytest.mark.parametrize("name", [1, None, b"arm"])
def test_names_that_are_no_strings(name):
    with pytest.raises(TypeError, match="mesh_b: expected a string, the name of a mesh or a robot, got"):
        client.pair_summary(summaries(), "arm", name)


@pytest.mark.parametrize(
    "names, words",
    [
        (("arm", "cloht"), "mesh_b: no mesh is named 'cloht'; there are .*did you mean cloth[?]"),
        (("Arm", "cloth"), "mesh_a: no mesh is named 'Arm'.*did you mean arm[?]"),
        (("arms", "table"), "'arms' and 'table' are not a tested pair; the tested pairs are arm/hand and cloth"),
        (("ar", "cloth"), "mesh_a: no mesh is named 'ar'"),
    ],
)
def test_names_of_no_pair(names, words):
    with pytest.raises(ValueError, match=words):
        client.pair_summary(summaries(), *names)


def test_distances_of_whole_robots():
    message = DistanceArray(
        mesh_names=["cloth", "arm/hand", "arm/elbow"],
        kind=[0, 0, 0],
        mesh_a=[0, 2, 1],
        mesh_b=[1, 0, 2],
        distance=[0.5, 0.25, 0.125],
        features_a=[0] * 6,
        features_b=[0] * 6,
        points=[0.0] * 18,
    )
    found = client.distances_from_message(message)
    assert found.between("arm", "cloth") == found.between("cloth", "arm") == 0.25
    assert (found.between("arm/hand", "cloth"), found.between("arm", "arm")) == (0.5, 0.125)
    assert found.between("cloth", "cloth") == math.inf
    with pytest.raises(ValueError, match="mesh_a: no mesh is named 'arn'.*did you mean arm[?]"):
        found.between("arn", "cloth")


MODULES = ["hpccd_ros.client", *(m.name for m in pkgutil.iter_modules(client.__path__, "hpccd_ros.client."))]


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


FUNCTIONS = [name for name in client.__all__ if inspect.isfunction(getattr(client, name))]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_document_their_arguments(name):
    function = getattr(client, name)
    if inspect.signature(function).parameters:
        doc = inspect.getdoc(function)
        assert "\nParameters\n----------\n" in doc and "\nReturns\n-------\n" in doc
        assert all(f"{argument}" in doc for argument in inspect.signature(function).parameters)
