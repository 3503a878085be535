# SPDX-License-Identifier: Apache-2.0
"""The solver behind examples/cloth_on_ball: free of intersections, and physics."""

import dataclasses

import numpy as np
import oracle
import pytest
from account import Account
from cloth_solver.motion import Simulation, Stuck
from cloth_solver.queries import InProcess
from cloth_solver.setup import Setup
from cloth_solver.springs import Springs

# Coarse, and the ball turns at once: wound round it within 80 moves.
SETUP = Setup(cells=20, ball_frequency=5, side=2.0)
MOVES = 80


def queries_of(setup, threads=1, kind=InProcess):
    return kind(setup, threads)


def run(moves=MOVES, setup=SETUP, step="global", **options):
    """(simulation, positions of all frames, moves)."""
    simulation = Simulation(setup, queries_of(setup, **options), step=step)
    positions, made = [simulation.positions], []
    for _ in range(moves):
        made.append(simulation.move())
        positions.append(simulation.positions)
    return simulation, positions, made


def check_nothing_touches(setup, positions):
    """By the exact oracle, which shares nothing with the detector that the solver asked."""
    meshes = setup.meshes()
    faces, obstacles = [mesh.faces for mesh in meshes], range(1, len(meshes))
    for start, end in zip(positions, positions[1:], strict=False):
        contacts = oracle.brute_force(start, end, faces, no_self_collision=obstacles)
        assert len(contacts.vf) == len(contacts.ee) == 0
    assert len(oracle.intersections(positions[-1], faces, no_self_collision=obstacles)) == 0


@pytest.fixture(scope="module")
def wound():
    return run()


def test_cloth_winds_round_the_ball(wound):
    simulation, positions, made = wound
    n_cloth = (SETUP.cells + 1) ** 2
    cloth = positions[-1][:n_cloth]
    assert np.linalg.norm(cloth.astype(float), axis=1).min() > 0.97 * SETUP.ball_radius
    assert cloth[:, 2].min() < 0.0, "it hangs down to the middle of the ball"
    assert made[-1].pairs > 500
    assert simulation.ledger.ball_spin > 0.1, "taken along by friction"


def test_no_move_touches_anything(wound):
    check_nothing_touches(SETUP, wound[1][20:])


def test_what_is_unresolved_would_touch(wound):
    """Else the test above would test nothing."""
    simulation, positions, _ = wound
    end = simulation.trial(10 * SETUP.period)
    contacts = oracle.brute_force(positions[-1], end, [mesh.faces for mesh in SETUP.meshes()], no_self_collision=[1])
    assert len(contacts.vf) > 10


def test_momentum_and_energy_are_accounted_for():
    queries = queries_of(SETUP)
    simulation = Simulation(SETUP, queries)
    account = Account(simulation, queries)
    account.enter(None, 0.0)
    for _ in range(MOVES):
        account.enter(simulation.move(), 0.01)
    assert account.plausible, account.lines()
    assert simulation.ledger.work > 1.0, "the ball gave energy"
    # And it would notice: momentum from nowhere, energy from nowhere.
    simulation.velocity[0] += 1e-6
    account.enter(simulation.move(), 0.01)
    assert not account.plausible


def test_the_same_bits_with_any_number_of_threads(wound):
    _, positions, _ = wound
    for one, other in zip(positions, run(threads=3)[1], strict=True):
        np.testing.assert_array_equal(one, other)


class Blind(InProcess):
    """Sees no pairs while it is `blind`: the solver runs into things."""

    blind = True

    def near(self, start, end):
        found = super().near(start, end)
        if not self.blind:
            return found
        none = slice(0, 0)
        return dataclasses.replace(
            found,
            vf=found.vf[none],
            vf_toc=found.vf_toc[none],
            ee=found.ee[none],
            ee_toc=found.ee_toc[none],
            outputs={name: rows[none] for name, rows in found.outputs.items()},
        )


def test_a_solver_that_misses_pairs_is_slow_but_never_touches():
    """The guarantee depends on the guard alone, and a cloth at the smallest allowed distance can leave again."""
    queries = queries_of(SETUP, kind=Blind)
    simulation = Simulation(SETUP, queries)
    positions, parts = [simulation.positions], []
    for move in range(MOVES):
        queries.blind = move in (20, 21, 22, 23, 45, 46, 47, 48, 49)
        parts.append(simulation.move().part)
        positions.append(simulation.positions)
    assert sum(part < 1.0 for part in parts) >= 6
    assert simulation.time > 0.8 * MOVES * SETUP.period, "it goes on"
    check_nothing_touches(SETUP, positions)


def test_steps_of_vertices_are_the_global_one_where_nothing_is_blocked(wound):
    _, positions, made = wound
    assert all(move.part == 1.0 for move in made)
    np.testing.assert_array_equal(positions[-1], run(step="vertices")[1][-1])


# A corner is pinched below the plate, and the opposite one falls.
PINCHED = Setup.pinched(20, ball_frequency=6)


def test_a_pinched_corner_blocks_the_global_step():
    with pytest.raises(Stuck, match="at 0[.]0.* s: 20 moves .*; take the step 'vertices', a finer cloth"):
        run(40, PINCHED)


def test_steps_of_vertices_go_on_where_the_global_one_is_blocked():
    simulation, positions, made = run(40, PINCHED, step="vertices")
    assert simulation.time == pytest.approx(40 * PINCHED.period)
    assert sum(move.part < 1.0 for move in made) > 20, "the corner is blocked"
    n_cloth = (PINCHED.cells + 1) ** 2
    pinched, opposite = np.linalg.norm(positions[-1] - positions[0], axis=1)[[0, n_cloth - 1]]
    assert pinched < 0.1 < 0.3 < opposite, "and the rest falls"
    check_nothing_touches(PINCHED, positions)


def test_a_ball_that_is_blocked_turns_less_and_keeps_its_shape():
    setup = Setup(12, ball_frequency=6, spin=30.0)
    queries = queries_of(setup, kind=Blind)
    simulation = Simulation(setup, queries, step="vertices")
    late, n_cloth = [], (setup.cells + 1) ** 2
    for move in range(60):
        queries.blind = move >= 20
        simulation.move()
        late.append(simulation.late)
        ball = setup.turned(setup.ball()[0], simulation.time - simulation.late)
        np.testing.assert_allclose(simulation.positions[n_cloth:], ball, atol=1e-7)
    assert late[-1] > 0.0


def test_momentum_and_energy_are_accounted_for_where_vertices_are_held():
    queries = queries_of(PINCHED)
    simulation = Simulation(PINCHED, queries, step="vertices")
    account = Account(simulation, queries)
    account.enter(None, 0.0)
    for _ in range(40):
        account.enter(simulation.move(), 0.01)
    assert account.plausible, account.lines()
    assert simulation.ledger.held.any()


def test_a_solver_that_is_stuck_says_so():
    with pytest.raises(Stuck, match="the cloth is stuck at 0[.].* s: 20 moves in a row"):
        run(300, kind=Blind)


def test_springs_make_no_momentum_and_lose_energy():
    springs = Springs(SETUP, 1e-3)
    n = SETUP.cells + 1
    random = np.random.default_rng(1)
    rest = np.zeros((3, n, n))
    rest[0], rest[1] = (SETUP.spacing * axis for axis in np.meshgrid(np.arange(n), np.arange(n)))
    assert springs.energy(rest) < 1e-20
    x = rest + 0.1 * SETUP.spacing * random.random((3, n, n))
    before, middle = springs.energy(x), x.mean(axis=(1, 2))
    springs.relax(x)
    assert 0.0 < springs.energy(x) < before
    assert x.mean(axis=(1, 2)) == pytest.approx(middle, abs=1e-14)
