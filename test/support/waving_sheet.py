# SPDX-License-Identifier: Apache-2.0
"""A folded sheet whose layers pass through each other: contacts in every step, the same numbers in every run."""

import numpy as np

import hpccd_core as hc

LAYERS = 3


def sheet_faces(n: int) -> np.ndarray:
    """(2 (n-1)^2, 3) uint32: triangles of an n by n grid."""
    at = np.arange(n * n, dtype=np.uint32).reshape(n, n)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel()
    return np.concatenate([np.stack([a, b, c], 1), np.stack([d, c, b], 1)])


def sheet_positions(n: int, step: int, *, offset: float = 0.0, dtype=np.float32) -> np.ndarray:
    """(n*n, 3): the sheet at a step. Heights change by less than an edge length from step to step."""
    u, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    x = np.abs((LAYERS * u + 1) % 2 - 1) / LAYERS
    phase = 0.9 * step
    z = 0.3 / n * (np.sin(17 * u + phase) + np.cos(11 * y - 1.3 * phase)) + offset
    return np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(dtype)


def scene_of(**meshes: np.ndarray) -> hc.Scene:
    """Scene of named face arrays, each with as many vertices as its largest index tells."""
    scene = hc.Scene()
    for name, faces in meshes.items():
        scene.add_mesh(name, faces)
    return scene
