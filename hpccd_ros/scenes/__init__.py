# SPDX-License-Identifier: Apache-2.0
"""Deterministic deforming scenes, the same for the node, the tests and the benchmarks.

    >>> from hpccd_ros import scenes
    >>> scene = scenes.make("cloth-drop")
    >>> for frame in scene.frames():
    ...     vertices = frame.stacked()        # (V,3) float32, meshes in the order of scene.meshes

The "-like" scenes have the sizes and the character of published ones (Table 1 of Kim et al. 2009; twisted rods and
rollers of the literature of incremental potential contact), not their data. Motions are built from IEEE-exact
operations only (see exactmath): the same arguments give the same bits, on any machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hpccd_ros.base.quoting import suggestion
from hpccd_ros.scenes import (
    arm_and_cloth,
    armadillo,
    breaking,
    cloth,
    cloth_ball,
    n_body,
    rod_twist,
    small,
)
from hpccd_ros.scenes.scene import Frame, Mesh, Scene, Topology, core_scene

__all__ = ["Frame", "Mesh", "Scene", "Topology", "core_scene", "describe", "make", "names"]

MAX_SIZE = 64.0
MIN_SIZE = 1 / 64


@dataclass(frozen=True)
class _Entry:
    title: str
    triangles: int  # at size 1, in frame 0
    frames: int
    make: Callable[..., Scene]  # (name, title, size, frames, seed, progress)


def _cloth_ball(name, title, size, frames, seed, progress):
    # 106 cells simulated: the mesh of size 1/4 is the simulated grid itself, larger ones refine its surface.
    setup = cloth.Setup(cells=106)
    return cloth_ball.make(name, title, setup, 90_000, 2_000, size, frames, seed, progress)


def _cloth_drop(name, title, size, frames, seed, progress):
    setup = cloth.Setup(cells=54, spin_from=0.8, drag=8.0, ball_mesh_radius=0.4994)
    return cloth_ball.make(name, title, setup, 5_832, 1_280, size, frames, seed, progress)


def _n_body(triangles):
    return lambda name, title, size, frames, seed, progress: n_body.make(
        name, title, triangles, size, frames, seed, progress
    )


def _arm_and_cloth(name, title, size, frames, seed, progress):
    return arm_and_cloth.make(name, title, 5_000, size, frames, seed, progress)


def _rod_twist(name, title, size, frames, seed, progress):
    return rod_twist.make(name, title, 106_000, size, frames, seed)


def _armadillo(name, title, size, frames, seed, progress):
    return armadillo.make(name, title, 50_000, 10_000, size, frames, seed)


_REGISTRY = {
    "two-triangles": _Entry(
        "a triangle falls through another: one vertex-face contact",
        2,
        11,
        lambda name, title, size, frames, seed, progress: small.two_triangles(name, title, frames),
    ),
    "folding-strip": _Entry(
        "a strip folds like a letter and passes through itself",
        3_240,
        61,
        lambda name, title, size, frames, seed, progress: small.folding_strip(name, title, size, frames),
    ),
    "cloth-drop": _Entry("a small cloth falls on a ball that then spins", 7_112, 90, _cloth_drop),
    "arm-and-cloth": _Entry(
        "an arm takes a cloth between two fingers and drags it across a table", 8_076, 361, _arm_and_cloth
    ),
    "cloth-ball-like": _Entry("a cloth drapes on a ball that then spins", 91_888, 94, _cloth_ball),
    "breaking-like": _Entry("a boulder shatters a hollow statue, whose topology changes", 252_028, 60, breaking.make),
    "n-body-like-lr": _Entry("60 rigid and deforming bodies fall into a pile", 31_992, 76, _n_body(32_000)),
    "n-body-like-hr": _Entry("60 rigid and deforming bodies fall into a pile", 146_312, 76, _n_body(146_000)),
    "rod-twist-like": _Entry(
        "a bundle of rods is twisted until it coils up: layers close together", 105_984, 260, _rod_twist
    ),
    "armadillo-like": _Entry("a knobbly body with limbs is drawn between two rollers", 70_160, 260, _armadillo),
}


def names() -> list[str]:
    """Names that `make` knows, small scenes first."""
    return list(_REGISTRY)


def describe() -> list[tuple[str, str, int]]:
    """(name, title and size, default number of frames) of every scene, without making any."""
    return [(name, f"{entry.title}, {_size(entry.triangles)}", entry.frames) for name, entry in _REGISTRY.items()]


def _size(triangles: int) -> str:
    return f"{triangles} triangles" if triangles < 1000 else f"{triangles / 1000:.0f} K triangles"


def make(name: str, size: float = 1.0, frames: int | None = None, seed: int = 0, progress: bool = False) -> Scene:
    """Make a scene.

    name      one of `names()`
    size      factor on the triangle count, 1/64 to 64, of the same motion (two-triangles has one size only)
    frames    number of frames, at least 2; None for the scene's own. More let the motion go on, fewer cut it
              off; where the motion is a fixed path (two-triangles, folding-strip, arm-and-cloth) all show the
              whole of it, more of them finer
    seed      of the random numbers, 0 to 2**32 - 1 (not of two-triangles and folding-strip)
    progress  show a progress bar on stderr while a motion is simulated (seconds, once: it is cached)

    ValueError for a name, size, frame count or seed outside these.
    """
    if name not in _REGISTRY:
        raise ValueError(f"unknown scene {name!r}; there are {', '.join(names())}{suggestion(name, names())}")
    if not MIN_SIZE <= size <= MAX_SIZE:
        raise ValueError(f"size {size!r} is outside {MIN_SIZE} to {MAX_SIZE:g}")
    entry = _REGISTRY[name]
    frames = entry.frames if frames is None else frames
    if frames != int(frames) or frames < 2:
        raise ValueError(f"frames {frames!r}: a scene needs a whole number of at least 2")
    if seed != int(seed) or not 0 <= seed < 2**32:
        raise ValueError(f"seed {seed!r} is not a whole number from 0 to 2**32 - 1")
    return entry.make(name, entry.title, float(size), int(frames), int(seed), progress)
