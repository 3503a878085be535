# SPDX-License-Identifier: Apache-2.0
"""What a simulator has and asks: a cloth on a spinning ball that never touches, and the steps that would.

Made by the solver of examples/cloth_on_ball. A frame is a move that was proven free, so the straight way from each
frame to the next has no contact, and keeps the solver's clearance.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hpccd_ros.scenes import cache, shapes
from hpccd_ros.scenes.progress import track
from hpccd_ros.scenes.resolved import motion, pairs, queries, response, setup, springs
from hpccd_ros.scenes.scene import Frame, Mesh, Scene

# s; four moves of the solver in one, or nothing would be hit: layers at rest are its thickness apart.
TRIAL = 0.04

# What the numbers depend on.
SOURCES = [motion, pairs, queries, response, setup, springs, shapes]


def resolved(name, title, triangles: int, size: float, frames: int, seed: int, progress: bool) -> Scene:
    """Frame k is where move k ended."""
    chosen = _setup(triangles, size)
    moves = _moves(chosen, frames - 1, seed, progress)
    return _scene(name, title, chosen, frames, lambda k: (moves()["positions"][k], moves()["times"][k]))


def trial(name, title, triangles: int, size: float, frames: int, seed: int, progress: bool) -> Scene:
    """Frame 2 k is where move k ended; frame 2 k + 1 where a step of TRIAL seconds from there would end unresolved."""
    chosen = _setup(triangles, size)
    moves = _moves(chosen, frames // 2, seed, progress)

    def at(index: int):
        move, tried = divmod(index, 2)
        return moves()["trials" if tried else "positions"][move], moves()["times"][move] + tried * TRIAL

    return _scene(name, title, chosen, frames, at)


def _setup(triangles, size):
    return setup.Setup(cells=max(4, round((triangles * size / 2) ** 0.5)), ball_frequency=max(4, round(10 * size**0.5)))


def _moves(chosen, count, seed, progress):
    """Function that gives the arrays of `count` moves, simulated when it is first called."""
    return lru_cache(maxsize=1)(
        lambda: cache.cached(
            "cloth-ball-resolved", (chosen, count, seed), SOURCES, lambda: _simulate(chosen, count, seed, progress)
        )
    )


def _simulate(chosen, count, seed, progress) -> dict[str, np.ndarray]:
    """positions (count + 1, V, 3) float32 and times (count + 1,) of the moves, and what was tried from there."""
    _, cloth_faces = chosen.cloth(seed)
    ball, ball_faces = chosen.ball()
    simulation = motion.Simulation(chosen, queries.InProcess(chosen, cloth_faces, ball_faces, len(ball)), seed)
    positions = np.empty((count + 1, *simulation.positions.shape), np.float32)
    trials, times = np.empty_like(positions), np.zeros(count + 1)
    for index in track(range(count + 1), "simulating a cloth that never touches", progress):
        if index:
            simulation.move()
        positions[index], trials[index], times[index] = simulation.positions, simulation.trial(TRIAL), simulation.time
    return {"positions": positions, "trials": trials, "times": times}


def _scene(name, title, chosen, frames, at) -> Scene:
    cloth, cloth_faces = chosen.cloth(0)
    ball, ball_faces = chosen.ball()

    def frame(index: int) -> Frame:
        positions, time = at(index)
        return Frame([positions[: len(cloth)], positions[len(cloth) :]], index, float(time))

    meshes = (
        Mesh("cloth", cloth_faces, len(cloth)),
        Mesh("ball", ball_faces, len(ball), self_collision=False),
    )
    return Scene(name, title, meshes, frames, chosen.period, frame)
