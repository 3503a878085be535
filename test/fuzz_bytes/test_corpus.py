# SPDX-License-Identifier: Apache-2.0
"""Each target on its seeds, on the stored inputs, and on seeded mutations of both, without Atheris."""

import importlib.util
from random import Random

import pytest

from . import targets
from .mutations import mutation

TARGETS = targets.everything()
MUTATIONS = 200


@pytest.fixture(params=TARGETS)
def target(request):
    """(name, target)"""
    found = TARGETS[request.param]
    for package in found.needs:
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed")
    return request.param, found


def _inputs(name, target):
    return [*target.seeds(), *(path.read_bytes() for path in targets.stored(name))]


def test_seeds_are_valid(target):
    """Otherwise mutations of them reach little."""
    _, of = target
    valid = 0
    for seed in of.seeds():
        try:
            of.read(seed)
            valid += 1
        except of.errors:
            pass
    assert valid


def test_stored_inputs(target):
    name, of = target
    for data in _inputs(name, of):
        of(data)


def test_mutations(target):
    name, of = target
    if of.native:
        pytest.skip("damaged inputs may crash its library")
    inputs, rng = _inputs(name, of), Random(name)
    change = mutation(rng, of.words, of.largest)
    for _ in range(MUTATIONS):
        data = of.mutate(rng, rng.choice(inputs), change)[: of.largest]
        try:
            of(data)
        except Exception as error:
            raise AssertionError(f"{name} with {data!r}") from error
