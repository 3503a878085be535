#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compare one step for all vertices with a step for each, in three scenes. Times are CPU time, of one thread.

python examples/cloth_on_ball/compare_steps.py
                      a minute or two; the table of docs/simulators.md
"""

import time

from cloth_solver.motion import Simulation, Stuck
from cloth_solver.queries import InProcess
from cloth_solver.setup import Setup

SCENES = {
    "spinning ball": Setup(40),
    "fast ball": Setup(20, spin=30.0),
    "pinched corner": Setup.pinched(40),
}
MOVES = 120


def compared(setup: Setup, step: str) -> str:
    """The cells of a row of the table."""
    queries = InProcess(setup, threads=1)
    simulation = Simulation(setup, queries, step=step)
    moves, intersecting, end = [], 0, ""
    begin = time.process_time()
    try:
        while len(moves) < MOVES:
            moves.append(simulation.move())
            intersecting += queries.intersections(simulation.positions)
    except Stuck:
        end = ", then stuck"
    seconds, count = time.process_time() - begin, len(moves)
    shortened = sum(move.part < 1.0 for move in moves)
    return (
        f"{count}{end} | {shortened} | {simulation.time:.3f} | {1e3 * simulation.time / count:.2f} | "
        f"{count / seconds:.0f} | {simulation.ledger.held_work:.2f} | {intersecting}"
    )


if __name__ == "__main__":
    print("| scene | step | frames | shortened | simulated s | ms a frame | frames/s | J added | intersections |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, setup in SCENES.items():
        for step in ("global", "vertices"):
            print(f"| {name} | {step} | {compared(setup, step)} |", flush=True)
