# SPDX-License-Identifier: Apache-2.0
"""One detector in the hands of several Python threads."""

import threading
import time

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc


def run_all(jobs):
    """Each job on a thread of its own; the first exception of any is raised here."""
    errors = []

    def guarded(job):
        try:
            job()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=guarded, args=(job,)) for job in jobs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


@pytest.fixture(scope="module")
def meshes():
    return random_scenes.combine(random_scenes.crumpled_sheet(np.random.default_rng(4), 12))


@pytest.mark.parametrize("method", ["default", "published", "naive", "front"])
def test_calls_take_turns(meshes, method):
    frames = meshes.vertices_t0, meshes.vertices_t1
    options = {"accuracy": "balanced", "threads": 2, "method": method, "outputs": ("points", "normals", "weights")}
    alone, detector = (hc.Detector(meshes.scene(), **options) for _ in range(2))
    expected = [alone.detect(*frames), alone.detect(*frames[::-1])]
    done = threading.Event()

    def call(turn):
        for k in range(40):
            found, right = detector.detect(*frames[:: 1 - 2 * ((turn + k) % 2)]), expected[(turn + k) % 2]
            assert found.hash == right.hash
            for name, array in right.outputs.items():
                np.testing.assert_array_equal(found.outputs[name], array, err_msg=name)

    def calls():
        try:
            run_all([lambda turn=turn: call(turn) for turn in range(4)])
        finally:
            done.set()

    def look():
        while not done.is_set():
            stats, profile = detector.stats, detector.profile
            assert not stats or stats["ee_contacts"] in [len(e.ee) for e in expected]
            assert all(isinstance(ms, float) for ms in profile.values())
            assert detector.backend == "cpu" and detector.last_gpu_error == ""

    run_all([calls, look, look])


def test_steps_of_several_threads_follow_one_another(meshes):
    """Each step starts where another one has ended, whoever called it; a reset in between makes one a first step."""
    rng = np.random.default_rng(5)
    frames = [meshes.vertices_t0 + rng.normal(0, 0.3, meshes.vertices_t0.shape) for _ in range(3)]
    alone = hc.Detector(meshes.scene(), accuracy="balanced")
    possible = {alone.detect(a, b).hash for a in frames for b in frames} | {hc.Contacts.none().hash}
    detector = hc.Detector(meshes.scene(), accuracy="balanced", threads=2)

    def walk(first):
        for k in range(40):
            assert detector.step(frames[(first + k) % 3]).hash in possible
            if k % 10 == 9:
                detector.reset()

    run_all([lambda first=first: walk(first) for first in range(3)])


def test_cancel_does_not_wait_and_ends_all(meshes):
    detector = hc.Detector(meshes.scene(), threads=2)
    n_cancelled = []

    def call():
        with pytest.raises(hc.Cancelled):
            while True:
                detector.detect(meshes.vertices_t0, meshes.vertices_t1)
        n_cancelled.append(1)

    def cancel():
        time.sleep(0.1)
        detector.cancel()

    run_all([call, call, call, cancel])
    assert len(n_cancelled) == 3
