# SPDX-License-Identifier: Apache-2.0
"""Scenes of a cloth on a spinning ball, made by the solver of examples/cloth_on_ball.

cloth-ball-resolved   the solver's own steps: each is free of contacts and keeps the solver's clearance
cloth-ball-trial      the same states, and from each a long unresolved step, with its contacts
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from cloth_solver import motion, pairs, queries, response, setup, springs

from hpccd_core import shapes
from hpccd_core.progress import track
from hpccd_ros import scenes
from hpccd_ros.scenes import cache
from hpccd_ros.scenes.scene import Frame, Scene

# s; four moves of the solver in one, or nothing would be hit: layers at rest are its thickness apart.
TRIAL = 0.04

TRIANGLES = 32_768  # at size 1
FRAMES = {"cloth-ball-resolved": 220, "cloth-ball-trial": 439}

# Modules that the numbers depend on.
SOURCES = [motion, pairs, queries, response, setup, springs, shapes]


def make(name: str, size: float = 1.0, frames: int | None = None, seed: int = 0, progress: bool = False) -> Scene:
    """A scene of FRAMES, with the arguments of hpccd_ros.scenes.make.

    Frame k of cloth-ball-resolved is where move k ended. Frame 2 k of cloth-ball-trial is the same; frame 2 k + 1 is
    where a step of TRIAL seconds from there would end unresolved.
    """
    if not scenes.MIN_SIZE <= size <= scenes.MAX_SIZE:
        raise ValueError(f"size {size!r} is outside {scenes.MIN_SIZE} to {scenes.MAX_SIZE:g}")
    frames = FRAMES[name] if frames is None else frames
    chosen = _setup(TRIANGLES, size)
    if name == "cloth-ball-resolved":
        moves = _moves(chosen, frames - 1, seed, progress)
        return _scene(name, chosen, frames, lambda k: (moves()["positions"][k], moves()["times"][k]))
    moves = _moves(chosen, frames // 2, seed, progress)

    def at(index: int):
        move, tried = divmod(index, 2)
        return moves()["trials" if tried else "positions"][move], moves()["times"][move] + tried * TRIAL

    return _scene(name, chosen, frames, at)


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
    simulation = motion.Simulation(chosen, queries.InProcess(chosen), seed)
    positions = np.empty((count + 1, *simulation.positions.shape), np.float32)
    trials, times = np.empty_like(positions), np.zeros(count + 1)
    for index in track(range(count + 1), "simulating a cloth that never touches", progress):
        if index:
            simulation.move()
        positions[index], trials[index], times[index] = simulation.positions, simulation.trial(TRIAL), simulation.time
    return {"positions": positions, "trials": trials, "times": times}


def _scene(name, chosen, frames, at) -> Scene:
    meshes = chosen.meshes()

    def frame(index: int) -> Frame:
        positions, time = at(index)
        return Frame(np.split(positions, [meshes[0].n_vertices]), index, float(time))

    return Scene(name, name, meshes, frames, chosen.period, frame)
