# SPDX-License-Identifier: Apache-2.0
"""The time saved if a scene models only what it needs: each option on its own, compared with the full run.

  python -m bench options                     n-body-like-lr, cloth-drop and the files of HPCCD_DATA
  python -m bench options cloth-ball-like --steps 4

"full" tests every mesh against every mesh and itself, none of them static, all contacts, without points and normals.
Each other row changes one option. The last two rows add a landscape that nothing touches, once as a deforming mesh and
once as a static one.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from bench import lab
from hpccd_ros.bench.measure import Runner
from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh

COLUMNS = {
    "scene": "scene",
    "option": "option",
    "ms a step": "step_ms",
    "/ full": "over_base",
    "contacts": lab.whole("contacts"),
    "candidate pairs": lab.whole("candidates"),
}


def configure(parser):
    lab.configure(parser, ("n-body-like-lr", "cloth-drop", "data"), steps=4)
    lab.tier_option(parser, default="exact")
    add = parser.add_argument
    add("--landscape", type=int, default=200_000, metavar="N", help="its triangles; 0: none (default: %(default)s)")


def run(args) -> lab.Report:
    result, sources = lab.begin(args)
    for source in sources:
        runners = _runners(source.first(), args)
        asked = {runner.name: {"option": runner.name} for runner in runners}
        lab.compare(result, args, source, runners, "full", asked, check=False)
    lab.show(f"the time that each option saves ({args.accuracy})", COLUMNS, result.rows)
    return result


def _runners(step: Step, args) -> list[Runner]:
    base = {"accuracy": args.accuracy, "backend": "cpu", "threads": args.threads}
    found = [Runner("full", base, change=_full)]
    if any(mesh.static for mesh in step.meshes):
        found.append(Runner("static meshes", base, change=lambda s: _full(s, static=True)))
    found.append(Runner("no self-collision", base, change=lambda s: _full(s, self_collision=False)))
    if len(step.meshes) > 1:
        largest = max(step.meshes, key=lambda mesh: len(mesh.faces)).name
        found.append(Runner("largest mesh ignored by all", base, change=lambda s: _ignoring(_full(s), largest)))
        found.append(Runner("fast between meshes", base, change=_full, scene=_fast_between))
    for name, options in {
        "vertex-face only": {"features": ("vertex_face",)},
        "edge-edge only": {"features": ("edge_edge",)},
        "report first": {"report": "first"},
        "report any": {"report": "any"},
        "with points": {"outputs": ("points",)},
        "with points and normals": {"outputs": ("points", "normals")},
        "with normals": {"outputs": ("normals",)},
        "with normals and weights": {"outputs": ("normals", "weights")},
    }.items():
        found.append(Runner(name, {**base, **options}, change=_full))
    if any(mesh.static or not mesh.self_collision for mesh in step.meshes) or step.ignored_pairs:
        found.append(Runner("as the scene says", base))
    if args.landscape > 0:
        land = _landscape(step, args.landscape)
        found.append(Runner("landscape around it", base, change=lambda s: _in_landscape(_full(s), *land, False)))
        found.append(Runner("the same, static", base, change=lambda s: _in_landscape(_full(s), *land, True)))
    return found


def _full(step: Step, static: bool = False, self_collision: bool = True) -> Step:
    meshes = (dataclasses.replace(m, static=static and m.static, self_collision=self_collision) for m in step.meshes)
    return dataclasses.replace(step, meshes=tuple(meshes), ignored_pairs=())


def _ignoring(step: Step, name: str) -> Step:
    pairs = tuple((name, other.name) for other in step.meshes if other.name != name)
    return dataclasses.replace(step, ignored_pairs=pairs)


def _fast_between(scene) -> None:
    for a, b in itertools.combinations(scene.mesh_names, 2):
        scene.set_accuracy(a, b, "fast")


def _in_landscape(step: Step, faces: np.ndarray, xyz: np.ndarray, static: bool) -> Step:
    return dataclasses.replace(
        step,
        meshes=(*step.meshes, Mesh("landscape", faces, len(xyz), static=static)),
        vertices_t0=np.concatenate([step.vertices_t0, xyz]),
        vertices_t1=np.concatenate([step.vertices_t1, xyz]),
    )


def _landscape(step: Step, triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Faces and vertices of a wavy square far below the scene and four times as wide; the same for all its steps."""
    from bench.shapes import flat, sheet

    low, high = step.vertices_t0.min(axis=0), step.vertices_t0.max(axis=0)
    size = 4 * float((high - low).max())
    side = max(2, round((triangles / 2) ** 0.5) + 1)
    x, y, _ = (flat(side, side) / (side - 1) - 0.5).T
    shape = np.stack([x, y, 0.02 * np.sin(20 * x) * np.cos(17 * y)], axis=1)
    xyz = size * shape + [*(low + high)[:2] / 2, low[2] - size]
    return sheet(side, side), xyz.astype(step.vertices_t0.dtype)
