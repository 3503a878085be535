# SPDX-License-Identifier: Apache-2.0
"""What is saved where a scene models only what it needs: each option alone, beside the full run, in turn.

  python -m bench options                     n-body-like-lr, cloth-drop and the files of HPCCD_DATA
  python -m bench options cloth-ball-like --steps 4

"full" tests every mesh against every mesh and itself, none of them static, all contacts, exact, without points and
normals. Each other row changes one thing. Options that a scene has no use for (it has one mesh, nothing static) are
left out. The last two rows put a landscape that nothing touches around the scene, once as a mesh like any other and
once as a static one.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from bench import command
from bench.core import measure
from bench.core.variants import Variant
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores
from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh


def configure(parser):
    command.configure(parser, default=("n-body-like-lr", "cloth-drop", "data"), steps=4)
    command.tier_option(parser, default="exact")
    parser.add_argument(
        "--landscape",
        type=int,
        default=200_000,
        metavar="N",
        help="triangles around the scene in the last two rows; 0: none (default: %(default)s)",
    )
    command.threads_option(parser)


def run(args) -> int:
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    for source in sources:
        variants = _variants(source.step(source.spread(1)[0]), args)
        series = measure.measure(source, [measure.CoreRunner(v) for v in variants], args.repeat, args.steps)
        full = series["full"]
        for variant in variants:
            report.add(**_row(source, variant, series[variant.name], full, args))
    _print(report)
    return command.end(args, report)


def _variants(step: Step, args) -> list[Variant]:
    base = {"accuracy": args.accuracy, "backend": "cpu", "threads": args.threads}
    several = len(step.meshes) > 1
    found = [Variant("full", base, _full)]
    if any(mesh.static for mesh in step.meshes):
        found.append(Variant("static meshes", base, lambda s: _full(s, static=True)))
    found.append(Variant("no self-collision", base, lambda s: _full(s, self_collision=False)))
    if several:
        largest = max(range(len(step.meshes)), key=lambda m: len(step.meshes[m].faces))
        found += [
            Variant("largest mesh ignored by all", base, lambda s: _ignoring(_full(s), largest)),
            Variant("fast between meshes", base, _full, lambda scene: _between(scene, len(step.meshes), "fast")),
        ]
    found += [
        Variant("vertex-face only", {**base, "features": ("vertex_face",)}, _full),
        Variant("edge-edge only", {**base, "features": ("edge_edge",)}, _full),
        Variant("report first", {**base, "report": "first"}, _full),
        Variant("report any", {**base, "report": "any"}, _full),
        Variant("with points", {**base, "outputs": ("points",)}, _full),
        Variant("with points and normals", {**base, "outputs": ("points", "normals")}, _full),
    ]
    if any(mesh.static or not mesh.self_collision for mesh in step.meshes) or step.ignored_pairs:
        found.append(Variant("as the scene says", base))
    if args.landscape > 0:
        landscape = _landscape(step, args.landscape)
        found += [
            Variant("landscape around it", base, lambda s: _in_landscape(_full(s), landscape, static=False)),
            Variant("the same, static", base, lambda s: _in_landscape(_full(s), landscape, static=True)),
        ]
    return found


def _full(step: Step, static: bool = False, self_collision: bool = True) -> Step:
    meshes = tuple(
        dataclasses.replace(mesh, static=static and mesh.static, self_collision=self_collision) for mesh in step.meshes
    )
    return dataclasses.replace(step, meshes=meshes, ignored_pairs=())


def _ignoring(step: Step, mesh: int) -> Step:
    name = step.meshes[mesh].name
    pairs = tuple((name, other.name) for other in step.meshes if other.name != name)
    return dataclasses.replace(step, ignored_pairs=pairs)


def _between(scene, n_meshes: int, tier: str) -> None:
    for a in range(n_meshes):
        for b in range(a + 1, n_meshes):
            scene.set_accuracy(scene.mesh_names[a], scene.mesh_names[b], tier)


def _in_landscape(step: Step, landscape: tuple[np.ndarray, np.ndarray], static: bool) -> Step:
    faces, xyz = landscape
    return dataclasses.replace(
        step,
        meshes=(*step.meshes, Mesh("landscape", faces, len(xyz), static=static)),
        vertices_t0=np.concatenate([step.vertices_t0, xyz]),
        vertices_t1=np.concatenate([step.vertices_t1, xyz]),
    )


def _landscape(step: Step, triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """faces, vertices of a wavy square far below the scene and four times as wide; the same for all its steps."""
    low, high = step.vertices_t0.min(axis=0), step.vertices_t0.max(axis=0)
    size = 4 * float((high - low).max())
    side = max(2, round((triangles / 2) ** 0.5) + 1)
    y, x = np.mgrid[0:side, 0:side] / (side - 1) - 0.5
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    quads = np.stack([a, a + 1, a + side, a + 1, a + side + 1, a + side], axis=1)
    shape = np.stack([x, y, 0.02 * np.sin(20 * x) * np.cos(17 * y)], axis=2).reshape(-1, 3)
    xyz = size * shape + [*(low + high)[:2] / 2, low[2] - size]
    return quads.reshape(-1, 3).astype(np.uint32), xyz.astype(step.vertices_t0.dtype)


def _row(source, variant, series, full, args):
    return {
        "scene": source.name,
        "option": variant.name,
        "accuracy": args.accuracy,
        "threads": args.threads or cores(),
        "steps": len(series.by_step),
        "contacts": series.contacts(),
        "candidates": series.candidates(),
        **series.times().as_row(),
        "step_ms": series.sequence_ms() / len(series.by_step),
        "over_full": series.sequence_ms() / full.sequence_ms(),
        "stages_ms": series.stages(),
    }


def _print(report):
    tables.show(
        f"what each option saves ({report.rows[0]['accuracy']}, {report.rows[0]['threads']} threads)",
        ["scene", "option", "ms a step", "/ full", "contacts", "candidate pairs", "bounds + refit ms"],
        [
            [
                r["scene"],
                r["option"],
                r["step_ms"],
                r["over_full"],
                round(r["contacts"]),
                round(r["candidates"]),
                r["stages_ms"].get("bounds", 0) + r["stages_ms"].get("refit", 0),
            ]
            for r in report.rows
        ],
        "averages over the steps of the medians over the rounds",
    )
