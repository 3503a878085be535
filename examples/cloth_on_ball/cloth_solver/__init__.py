# SPDX-License-Identifier: Apache-2.0
"""A cloth solver that stays free of intersections because it asks hpccd before each step.

setup       what is simulated: numbers only
springs     the cloth's own forces: extended position-based dynamics on a grid
queries     the queries to a collision detector, and the class that computes them in this process
pairs       close pairs of features as half spaces
response    how these pairs push and rub the cloth
ledger      momentum, energy, and what changed them
motion      moves of the cloth, each proven free of contacts before it is made
"""
