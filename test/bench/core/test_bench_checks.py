# SPDX-License-Identifier: Apache-2.0
"""The benchmarks' own checks see what is wrong."""

import dataclasses

import numpy as np

from bench.core import measure
from bench.core.variants import Variant
from hpccd_ros.bench import truth
from hpccd_ros.bench.sources import of_scene


def _later(step):
    """A step that moves half as far, as a variant with a defect might compute it."""
    middle = (step.vertices_t0 + step.vertices_t1) / 2
    return dataclasses.replace(step, vertices_t1=middle.astype(step.vertices_t0.dtype))


def test_other_contacts_are_seen():
    source = of_scene("folding-strip", 0.1)
    right, wrong = Variant("right", {"backend": "cpu"}), Variant("wrong", {"backend": "cpu"}, _later)
    last = dataclasses.replace(source, n_steps=1, step=lambda k: source.step(source.n_steps - 1))
    for variants, n in (((right, wrong), 1), ((right, dataclasses.replace(right, name="again")), 0)):
        series = measure.measure(last, [measure.CoreRunner(v) for v in variants], rounds=1)
        assert len(measure.disagreements(list(series.values()))) == n


def test_a_short_step_of_a_file_is_timed_more_often():
    source = of_scene("folding-strip", 0.1)
    one = dataclasses.replace(source, n_steps=1, step=lambda k: source.step(source.n_steps - 1))

    class Takes:
        carries_state = True

        def __init__(self, ms):
            self.name, self.ms = f"{ms} ms", ms

        def run(self, step):
            return measure.Sample(self.ms, 0, 0, {}, {})

    series = measure.measure(one, [Takes(2.0), Takes(50.0)], rounds=3)
    assert [len(s.samples) for s in series.values()] == [3 * measure.TURN_MS / 2.0, 3]


def test_errors_against_truth():
    found = type("Found", (), {})()
    found.vf, found.vf_toc = np.array([[0, 1], [2, 3]], np.uint32), np.array([0.5, 0.25])
    found.ee, found.ee_toc = np.array([[0, 1, 2, 3]], np.uint32), np.array([0.75])
    true = {
        "vf": np.array([[2, 3], [4, 5]], np.uint32),
        "vf_toc": np.array([0.25, 1.0]),
        "ee": np.array([[0, 1, 2, 3]], np.uint32),
        "ee_toc": np.array([0.5]),
    }
    errors = truth.of_scene(found, true)
    assert (errors.true, errors.missed, errors.invented) == (3, 1, 1)
    assert errors.toc_worst == errors.latest == 0.25
