# SPDX-License-Identifier: Apache-2.0
"""The fuzzer for a few seconds; `make fuzz` runs it for as long as asked."""

import itertools

import numpy as np
import pytest

from hpccd_core.fuzz import __main__ as command
from hpccd_core.fuzz import differential, questions
from hpccd_core.fuzz.generators import GENERATORS, VERTEX_FACE
from hpccd_core.fuzz.questions import CONTACT, INTERSECTIONS, PROXIMITY, SEPARATION

ACCURACIES = ("fast", "balanced", "conservative", "exact")
TURNS = sum(map(len, GENERATORS.values()))


def n_batches(question):
    return sum(len(questions.generators_of(question, kind)) for kind in questions.kinds_of(question))


@pytest.mark.parametrize(
    ("question", "size", "rounds"),
    [(CONTACT, 600, 2), (SEPARATION, 100, 1), (PROXIMITY, 40, 1), (INTERSECTIONS, 60, 1)],
)
def test_promises_are_kept(question, size, rounds):
    tallies = differential.new_tallies()
    for batch in itertools.islice(differential.batches(2009, size, (question,)), rounds * n_batches(question)):
        differential.add_batch(tallies, batch, ACCURACIES, simd=differential.usable_simd())
    for accuracy, kind in itertools.product(ACCURACIES, questions.kinds_of(question)):
        tally = tallies[question, accuracy, kind]
        failing = [(b.queries[0].tolist(), float(b.distances[0])) for b in tally.failing[:1]]
        assert tally.broken == 0, f"{accuracy} {kind}: {failing}"
        assert tally.queries / 10 < tally.hits < tally.queries, "the generators must aim at both answers"
    for kind in questions.kinds_of(question):
        exact, conservative = (tallies[question, accuracy, kind] for accuracy in ("exact", "conservative"))
        assert exact.missed == exact.invented == conservative.missed == 0
        assert exact.worst_error <= 1e-12
        assert conservative.latest <= differential.ROUNDING[question]


def test_the_same_seed_gives_the_same_queries():
    first, second = (list(itertools.islice(differential.batches(seed=5, size=10), 5 * TURNS)) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.queries, b.queries) and np.array_equal(a.distances, b.distances)
    assert {(batch.question, batch.kind) for batch in first} == {
        (question, kind) for question in differential.QUESTIONS for kind in questions.kinds_of(question)
    }
    other = next(differential.batches(seed=6, size=10))
    assert not np.array_equal(first[0].queries, other.queries)


@pytest.mark.parametrize("question", [CONTACT, SEPARATION])
def test_broken_promises_are_seen_saved_and_replayed(question, tmp_path, monkeypatch, capsys):
    def never_hits(queries, accuracy, **_):
        return np.zeros(len(queries), bool), np.full(len(queries), np.inf)

    saved = tmp_path / "failures.npz"
    with monkeypatch.context() as patch:
        patch.setitem(questions.CORE, VERTEX_FACE, never_hits)
        arguments = ["--count", "50", "--batch", "50", "--accuracy", "exact", "--question", question]
        assert command.main([*arguments, "--save", str(saved)]) == 1
    assert "--replay" in capsys.readouterr().out
    with np.load(saved) as file:
        assert file[f"{question}|exact|vertex-face"].shape[1:] == (8, 3)
        assert (file[f"{question}|exact|vertex-face|distances"] > 0).all() == (question == SEPARATION)
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


def test_a_late_toc_breaks_the_promise_of_conservative_only_beyond_the_true_one():
    zero = np.zeros(3, bool)
    late = np.array([-1e-9, 0.0, 1e-300])
    difference = differential.Disagreement(missed=zero, invented=~zero, late=late, uneven=zero)
    assert difference.broken_promises("conservative").tolist() == [False, False, True]
    assert difference.broken_promises("exact").all()
    assert not difference.broken_promises("balanced").any()


@pytest.mark.parametrize("option", ["--accuracy", "--question"])
def test_unknown_names_are_refused(option, capsys):
    with pytest.raises(SystemExit):
        command.main([option, "precise"])
    assert "choose from" in capsys.readouterr().err
