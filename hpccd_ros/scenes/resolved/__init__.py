# SPDX-License-Identifier: Apache-2.0
"""A cloth solver that stays free of intersections because it asks hpccd before each step.

    setup       what is simulated: numbers only
    springs     the cloth's own forces: extended position-based dynamics on a grid
    queries     what the solver asks of a collision detector, and who answers it in this process
    pairs       near pairs of features as half spaces, and how the cloth is pushed and rubbed by them
    ledger      momentum, energy, and what changed them
    motion      moves of the cloth, each proven free before it is made

Here and not beside its example (examples/cloth_on_ball), because the scenes cloth-ball-resolved and cloth-ball-trial
are made by it, and scenes are installed.
"""
