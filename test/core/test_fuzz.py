# SPDX-License-Identifier: Apache-2.0
"""The fuzzer for a few seconds; `make fuzz` runs it for as long as asked."""

import itertools

import numpy as np
import pytest

from hpccd_core.fuzz import __main__ as command
from hpccd_core.fuzz import differential
from hpccd_core.fuzz.generators import EDGE_EDGE, GENERATORS, VERTEX_FACE

ACCURACIES = ("fast", "balanced", "conservative", "exact")
TURNS = sum(map(len, GENERATORS.values()))


def test_promises_are_kept():
    tallies = differential.new_tallies()
    for batch in itertools.islice(differential.batches(seed=2009, size=600), 2 * TURNS):
        differential.add_batch(tallies, batch, ACCURACIES, simd=differential.usable_simd())
    for accuracy, kind in itertools.product(ACCURACIES, (VERTEX_FACE, EDGE_EDGE)):
        tally = tallies[accuracy, kind]
        assert tally.broken == 0, f"{accuracy} {kind}: {tally.failing[0][0].tolist()}"
        assert tally.hits > tally.queries / 10, "the generators must aim at contacts"
    for kind in (VERTEX_FACE, EDGE_EDGE):
        assert tallies["exact", kind].missed == tallies["exact", kind].invented == 0
        assert tallies["exact", kind].worst_toc_error <= 1e-12
        assert tallies["conservative", kind].missed == 0
        assert tallies["conservative", kind].latest <= 0


def test_the_same_seed_gives_the_same_queries():
    first, second = (list(itertools.islice(differential.batches(seed=5, size=10), TURNS)) for _ in range(2))
    assert all(np.array_equal(a.queries, b.queries) for a, b in zip(first, second, strict=True))
    other = next(differential.batches(seed=6, size=10))
    assert not np.array_equal(first[0].queries, other.queries)


def test_broken_promises_are_seen_saved_and_replayed(tmp_path, monkeypatch, capsys):
    def never_hits(queries, accuracy, **_):
        return np.zeros(len(queries), bool), np.full(len(queries), np.inf)

    saved = tmp_path / "failures.npz"
    with monkeypatch.context() as patch:
        patch.setitem(differential.CORE, VERTEX_FACE, never_hits)
        arguments = ["--count", "50", "--batch", "50", "--accuracy", "exact", "--save", str(saved)]
        assert command.main(arguments) == 1
    assert "--replay" in capsys.readouterr().out
    with np.load(saved) as file:
        assert file["exact|vertex-face"].shape[1:] == (8, 3)
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


def test_a_late_toc_breaks_the_promise_of_conservative_only_beyond_the_true_one():
    zero = np.zeros(3, bool)
    late = np.array([-1e-9, 0.0, 1e-300])
    difference = differential.Disagreement(missed=zero, invented=~zero, late=late, uneven=zero)
    assert difference.broken_promises("conservative").tolist() == [False, False, True]
    assert difference.broken_promises("exact").all()
    assert not difference.broken_promises("balanced").any()


def test_unknown_accuracy_is_refused(capsys):
    with pytest.raises(SystemExit):
        command.main(["--accuracy", "precise"])
    assert "choose from" in capsys.readouterr().err
