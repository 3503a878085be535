# SPDX-License-Identifier: Apache-2.0
"""The true distance of vertices from their straight lines, divided by its bound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from oracle.rigid_queries import LinkPaths, random_motion, random_paths

TURNS = (0.01, 0.1, 0.5, 1.0)
_MOTIONS = 300
_SAMPLES = 33  # the middle of the step is one


def rows(seed: int) -> Iterator[dict]:
    """Of screws, of chains of random joints, and of those in planar arms whose turns cancel."""
    for kind in ("screws", "joints", "joints that cancel"):
        for turn in TURNS:
            rng = np.random.default_rng([seed, int(1000 * turn)])
            paths = random_paths(rng, _MOTIONS, 3, np.ones(_MOTIONS), kind.split()[0])
            if isinstance(paths, LinkPaths):
                paths = _turned_by(rng, paths, turn, kind.endswith("cancel"))
            else:
                paths = _screws_by(rng, paths, turn)
            ratios = np.array([ratio for k in range(_MOTIONS) if (ratio := _ratio(paths, k)) is not None])
            yield {
                "motion": kind,
                "turn": turn,
                "motions": len(ratios),
                "median": float(np.median(ratios)),
                "low": float(np.percentile(ratios, 5)),
                "largest": float(ratios.max()),
            }


def _screws_by(rng, paths, turn):
    half = turn / 2
    axes = rng.standard_normal((len(paths.points), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    end = np.concatenate([axes * np.sin(half), np.full((len(axes), 1), np.cos(half))], axis=1)
    start = np.tile([0.0, 0.0, 0.0, 1.0], (len(axes), 1))
    return replace(paths, quaternions=np.stack([start, end], 1))


def _turned_by(rng, paths, turn, cancel):
    """Each joint by at most so much, in radians or in lengths of a link."""
    speeds = turn * rng.uniform(-1, 1, paths.values[:, 0].shape)
    if cancel:  # all axes parallel, and the last turn takes all others back
        paths = replace(
            paths,
            axes=np.tile([0.0, 0.0, 1.0], (*paths.turns.shape, 1)),
            quaternions=np.tile([0.0, 0.0, 0.0, 1.0], (*paths.turns.shape, 1)),
        )
        turning = speeds * paths.turns
        last = paths.turns.shape[1] - 1 - paths.turns[:, ::-1].argmax(axis=1)
        rows = np.arange(len(last))
        speeds[rows, last] -= np.where(paths.turns[rows, last], turning.sum(axis=1), 0.0)
    return replace(paths, values=np.stack([paths.values[:, 0], paths.values[:, 0] + speeds], 1))


def _ratio(paths, k):
    """None where next to nothing bends."""
    bound = random_motion(paths, k).deviation(1)
    t = np.linspace(0, 1, _SAMPLES)
    x = paths.at(np.full(_SAMPLES, k), t, np.float64)[0]
    straight = (1 - t)[:, None, None] * x[0] + t[:, None, None] * x[-1]
    return float(np.linalg.norm(x - straight, axis=2).max()) / bound if bound > 1e-9 else None
