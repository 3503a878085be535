# SPDX-License-Identifier: Apache-2.0
"""The fuzzer for a few seconds; `make fuzz` runs it for as long as asked."""

import dataclasses
import itertools

import numpy as np
import pytest
from fuzz import __main__ as command
from fuzz import differential, questions, slowest, solids
from fuzz.generators import GENERATORS, VERTEX_FACE
from fuzz.questions import (
    CONTACT,
    CONTAINMENT,
    DEPTH,
    DISTANCES,
    INTERSECTIONS,
    MOTION,
    POINTS,
    PROXIMITY,
    SEPARATION,
    SIGNED,
    STEP,
    TRANSLATION,
    WINDING,
)

import hpccd_core as hc

ACCURACIES = ("fast", "balanced", "conservative", "exact")
TURNS = sum(map(len, GENERATORS.values()))


def n_batches(question):
    return sum(len(questions.generators_of(question, kind)) for kind in questions.kinds_of(question))


@pytest.mark.parametrize(
    ("question", "size", "rounds"),
    [
        (CONTACT, 600, 2),
        (SEPARATION, 100, 1),
        (PROXIMITY, 40, 1),
        (INTERSECTIONS, 60, 1),
        (DISTANCES, 60, 1),
        (CONTAINMENT, 300, 1),
        pytest.param(CONTAINMENT, 2000, 2, marks=pytest.mark.long),
        (STEP, 25, 2),
        (MOTION, 20, 1),
        (WINDING, 150, 1),
        (SIGNED, 50, 1),
        (TRANSLATION, 100, 1),
        (DEPTH, 100, 1),
        (POINTS, 60, 1),
        pytest.param(STEP, 60, 2, marks=pytest.mark.long),
        pytest.param(MOTION, 100, 4, marks=pytest.mark.long),
    ],
)
def test_promises_are_kept(question, size, rounds):
    tallies = differential.new_tallies()
    for batch in itertools.islice(differential.batches(2009, size, (question,)), rounds * n_batches(question)):
        differential.add_batch(tallies, batch, ACCURACIES, simd=differential.usable_simd())
    for accuracy, kind in itertools.product(ACCURACIES, questions.kinds_of(question)):
        tally = tallies[question, accuracy, kind]
        failing = [(b.queries[0].tolist(), float(b.distances[0])) for b in tally.failing[:1]]
        assert tally.broken == 0, f"{accuracy} {kind}: {failing}"
        assert tally.queries / 10 < tally.hits < tally.queries, "the generators must aim at both results"
    for kind in questions.kinds_of(question):
        exact, conservative = (tallies[question, accuracy, kind] for accuracy in ("exact", "conservative"))
        assert exact.missed == exact.invented == conservative.missed == 0
        if question == DEPTH:  # an upper bound
            continue
        assert exact.worst_error <= 1e-12
        assert conservative.latest <= (0 if question in (*differential.OF_A_STEP, STEP) else 1e-12)


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


def farther(gaps):
    return [dataclasses.replace(gap, distance=gap.distance * (1 + 1e-9)) for gap in gaps]


def of_other_meshes(gaps):
    """Each with the features of the last pair of meshes that has some."""
    last = [gap for gap in gaps if gap.kind][-1]
    return [dataclasses.replace(gap, kind=last.kind, features=last.features) if gap.kind else gap for gap in gaps]


def touching(gaps):
    return [dataclasses.replace(gap, distance=min(gap.distance, 0.0)) for gap in gaps]


@pytest.mark.parametrize("mistake", [farther, of_other_meshes, touching])
def test_wrong_distances_of_meshes_are_seen_saved_and_replayed(mistake, tmp_path, monkeypatch, capsys):
    saved = tmp_path / "failures.npz"
    with monkeypatch.context() as patch:
        patch.setattr(
            hc.Detector, "distances", lambda self, points: mistake(super(hc.Detector, self).distances(points))
        )
        arguments = ["--count", "40", "--batch", "200", "--accuracy", "exact,conservative", "--question", DISTANCES]
        assert command.main([*arguments, "--save", str(saved)]) == 1
    with np.load(saved) as file:
        assert {key.split("|")[1] for key in file.files} == {"exact", "conservative"}
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


@pytest.mark.parametrize("side", [None, "a", "both"])
def test_wrong_containment_is_seen_saved_and_replayed(side, tmp_path, monkeypatch, capsys):
    def wrong(self, points):
        return [dataclasses.replace(gap, inside=side) for gap in super(hc.Detector, self).distances(points)]

    saved = tmp_path / "failures.npz"
    with monkeypatch.context() as patch:
        patch.setattr(hc.Detector, "distances", wrong)
        arguments = ["--count", "60", "--batch", "200", "--accuracy", "exact", "--question", CONTAINMENT]
        assert command.main([*arguments, "--save", str(saved)]) == 1
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


class Mistakes:
    """Detector methods that are wrong in one way each."""

    @staticmethod
    def late(self, start, end):
        step = super(hc.Detector, self).collision_free_step(start, end)
        return step if step in (0, 1) else min(np.nextafter(step, 1) + 1e-11, 1.0)

    @staticmethod
    def early(self, start, end):
        return max(0.0, super(hc.Detector, self).collision_free_step(start, end) - 2e-9)

    @staticmethod
    def stale(self, start, end):
        """For the same start as before, and another end."""
        step = super(hc.Detector, self).collision_free_step(start, end)
        key = start.tobytes()
        if getattr(self, "kept", (None, 0))[0] != key:
            self.kept = key, step
        return self.kept[1]

    @staticmethod
    def only_one(self, start, end):
        """One of several first contacts is left out."""
        found = super(hc.Detector, self).detect(start, end)
        if self.report != "first" or len(found.vf) < 2:
            return found
        return dataclasses.replace(found, vf=found.vf[1:], vf_toc=found.vf_toc[1:])

    @staticmethod
    def one_too_many(self, start, end):
        """Where one kind is tested alone, a contact of the other is there."""
        found = super(hc.Detector, self).detect(start, end)
        if self.features != ("vertex_face",) or len(found.vf) == 0:
            return found
        return dataclasses.replace(found, ee=np.array([[0, 1, 2, 3]], np.uint32), ee_toc=found.vf_toc[:1])


@pytest.fixture(scope="module")
def truth_once():
    """What the oracle says of a batch, asked once: all mistakes are looked for in the same batches."""
    ask, known = questions.truth, {}

    def truth(batch, threads=0):
        key = batch.kind, batch.queries.tobytes(), batch.distances.tobytes()
        if key not in known:
            known[key] = ask(batch, threads)
        return known[key]

    return truth


@pytest.mark.parametrize("mistake", ["late", "early", "stale", "only_one", "one_too_many"])
def test_wrong_steps_are_seen_saved_and_replayed(mistake, tmp_path, monkeypatch, capsys, truth_once):
    saved = tmp_path / "failures.npz"
    method = "detect" if mistake.startswith("on") else "collision_free_step"
    with monkeypatch.context() as patch:
        patch.setattr(questions, "truth", truth_once)
        patch.setattr(hc.Detector, method, getattr(Mistakes, mistake))
        arguments = ["--count", "300", "--batch", "30", "--simd", "auto", "--accuracy", "exact,conservative"]
        assert command.main([*arguments, "--question", STEP, "--save", str(saved)]) == 1
    with np.load(saved) as file:
        assert {key.split("|")[1] for key in file.files} == {"exact", "conservative"}
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


def whole(start, end, motion):
    """The most shortened vertices are not."""
    too_far = motion.factors == motion.factors.min(initial=1)
    vertices = np.where(too_far[:, None], end, motion.vertices).astype(motion.vertices.dtype)
    return dataclasses.replace(motion, vertices=vertices, factors=np.where(too_far, 1, motion.factors))


def short(start, end, motion):
    factors = motion.factors / 4
    vertices = (start + factors[:, None] * (end.astype(float) - start)).astype(start.dtype)
    return dataclasses.replace(motion, vertices=vertices, factors=factors)


def one_is_free(start, end, motion):
    return dataclasses.replace(motion, stuck=motion.stuck[1:])


def nearby(start, end, motion):
    return dataclasses.replace(motion, factors=motion.factors * (1 - 1e-9))


@pytest.mark.parametrize("mistake", [whole, short, one_is_free, nearby])
def test_wrong_motions_are_seen_saved_and_replayed(mistake, tmp_path, monkeypatch, capsys):
    saved = tmp_path / "failures.npz"
    with monkeypatch.context() as patch:

        def wrong(self, start, end, groups):
            return mistake(start, end, super(hc.Detector, self).collision_free_motion(start, end, groups))

        patch.setattr(hc.Detector, "collision_free_motion", wrong)
        arguments = ["--count", "100", "--batch", "20", "--simd", "auto", "--accuracy", "exact,conservative"]
        assert command.main([*arguments, "--question", MOTION, "--save", str(saved)]) == 1
    with np.load(saved) as file:
        assert {key.split("|")[1] for key in file.files} == {"exact", "conservative"}
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


def one_more(found):
    return found[0] + 1, found[1]


def beside_the_surface(found):
    return found[0], np.zeros_like(found[1])


def beyond(found):
    return dataclasses.replace(found, distance=found.distance * (1 + 1e-9))


def in_other_faces(found):
    return dataclasses.replace(found, faces=np.roll(found.faces, 1))


def too_far(found):
    return found * (1 + 1e-9)


def too_short(found):
    return dataclasses.replace(found, translation=found.translation * 0.99, depth=found.depth * 0.99)


def too_sure(found):
    return dataclasses.replace(found, lower_bound=found.depth * 1.1)


def later(found):
    return dataclasses.replace(found, outputs={**found.outputs, "edge_parameters": found.edge_parameters + 1e-9})


@pytest.mark.parametrize(
    ("question", "method", "mistake"),
    [
        (WINDING, "winding_numbers", one_more),
        (WINDING, "winding_numbers", beside_the_surface),
        (SIGNED, "signed_distances", beyond),
        (SIGNED, "signed_distances", in_other_faces),
        (TRANSLATION, "separating_translation", too_far),
        (DEPTH, "penetration", too_short),
        pytest.param(DEPTH, "penetration", too_sure, marks=pytest.mark.long),
        (POINTS, "intersections", later),
    ],
)
def test_wrong_results_about_solids_are_seen_saved_and_replayed(
    question, method, mistake, tmp_path, monkeypatch, capsys
):
    saved = tmp_path / "failures.npz"
    with monkeypatch.context() as patch:
        ask = getattr(hc.Detector, method)
        patch.setattr(hc.Detector, method, lambda *arguments: mistake(ask(*arguments)))
        arguments = ["--count", "300", "--batch", "100", "--simd", "auto", "--accuracy", "exact,conservative"]
        assert command.main([*arguments, "--question", question, "--save", str(saved)]) == 1
    with np.load(saved) as file:
        assert {key.split("|")[1] for key in file.files} == {"exact", "conservative"}
    assert command.main(["--replay", str(saved), "--accuracy", "exact", "--save", str(tmp_path / "again.npz")]) == 0


def test_a_late_toc_breaks_the_promise_of_conservative_only_beyond_the_true_one():
    zero = np.zeros(3, bool)
    late = np.array([-1e-9, 0.0, 1e-300])
    difference = differential.Disagreement(missed=zero, invented=~zero, late=late, uneven=zero)
    assert difference.broken_promises("conservative").tolist() == [False, False, True]
    assert difference.broken_promises("exact").all()
    assert not difference.broken_promises("balanced").any()


@pytest.mark.parametrize("option", ["--accuracy", "--question"])
def test_unknown_names_are_rejected(option, capsys):
    with pytest.raises(SystemExit):
        command.main([option, "precise"])
    assert "choose from" in capsys.readouterr().err


@pytest.mark.parametrize("question", slowest.QUESTIONS)
def test_the_slowest_of_each_question_are_kept(question, tmp_path, monkeypatch):
    saved = tmp_path / "slowest.npz"
    arguments = ["--seconds", "0.1", "--keep", "3", "--span", "60", "--question", question, "--save", str(saved)]
    assert slowest.main(arguments) == 0
    with np.load(saved) as kept:
        for kind in questions.kinds_of(question):
            points = kept[kind if question == CONTACT else f"{question}|{kind}"]
            assert len(points) == 3 and np.isfinite(points).all()
            distances = kept.get(f"{question}|{kind}|distances", np.zeros(3))
            herd = slowest.Herd(question, kind, 3, list(zip(points, distances, strict=True)), [0.0] * 3)
            assert slowest._different_from_oracle(herd) == 0
            with monkeypatch.context() as patch:
                patch.setattr(slowest, "truth", lambda batch: (~questions.truth(batch)[0], questions.truth(batch)[1]))
                assert slowest._different_from_oracle(herd) == 3, "the oracle is not asked"


def test_a_lower_bound_above_the_true_depth_is_seen(monkeypatch):
    kind = questions.kinds_of(DEPTH)[0]
    make = next(iter(questions.generators_of(DEPTH, kind).values()))
    queries = make(np.random.default_rng(1), 3)
    deep, depths = solids.true_depths(kind, queries, 1)
    assert deep.any() and not solids.break_promises(kind, queries, "exact", "auto", depths).any()
    ask = hc.Detector.penetration

    monkeypatch.setattr(hc.Detector, "penetration", lambda *arguments: too_sure(ask(*arguments)))
    assert (solids.break_promises(kind, queries, "exact", "auto", depths) == deep).all()
