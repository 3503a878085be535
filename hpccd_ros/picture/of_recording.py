# SPDX-License-Identifier: Apache-2.0
"""Pictures of the steps of a replayed recording."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

import hpccd_core as hc
from hpccd_core.options import FEATURES
from hpccd_core.picture import contacts as picture
from hpccd_core.picture.lines import Depth
from hpccd_ros.detect.plane_patch import FACES as PATCH_FACES
from hpccd_ros.detect.plane_patch import OUTLINE, patch
from hpccd_ros.detect.separation import Separation, Thickness
from hpccd_ros.middleware.contact_messages import times_of
from hpccd_ros.picture.intersecting import IntersectingFaces
from hpccd_ros.picture.visual_geometry import NO_VISUAL, VisualGeometry
from hpccd_ros.replay.recomputed import ReplayedStep

Between = TypeVar("Between", hc.Contour, Depth)


class History:
    """Number, contacts and milliseconds of each step that was computed."""

    def __init__(self):
        self.steps, self.contacts, self.milliseconds = [], [], []

    def add(self, step: ReplayedStep) -> None:
        self.steps.append(step.step)
        self.contacts.append(step.total)
        self.milliseconds.append(step.milliseconds)


def draw_step(
    step: ReplayedStep,
    path,
    history: History | None = None,
    *,
    title: str,
    visual: VisualGeometry = NO_VISUAL,
    intersecting: IntersectingFaces | None = None,
    **view,
) -> None:
    """Write a picture of `step`, which was computed with outputs=("points",). view: azimuth, elevation, size."""
    found = step.contacts
    meshes = meshes_in_the_middle(step, visual)
    marked = None if intersecting is None else _marked(intersecting, step, meshes)
    of = f" of {max(history.steps)}" if history is not None else ""
    drawn = picture.Picture(
        meshes,
        np.asarray(found.points),
        times_of(found),
        f"{step.total:,} contact{'' if step.total == 1 else 's'} in step {step.step}" + of,
        facts(step),
        title,
        intersecting=marked,
        contours=[] if intersecting is None else _seen(intersecting.contours, step, meshes),
        depths=[] if intersecting is None else _seen(intersecting.depths, step, meshes),
        planes=sum(faces is PATCH_FACES for _, _, faces, _ in meshes),
        thickness=dict(step.thickness),
    )
    context = None
    if history is not None and len(history.steps) > 1:
        context = picture.History(
            np.array(history.steps), np.array(history.contacts), np.array(history.milliseconds), step.step
        )
    picture.draw(drawn, path, context, **view)


def facts(step: ReplayedStep) -> list[str]:
    """The line beneath the title, about a computed step."""
    found = step.contacts
    triangles, edges = (sum(len(getattr(t, kind)) for t in step.end_frame.topologies) for kind in ("faces", "edges"))
    lines = [
        f"{triangles:,} triangles" if triangles else None,
        f"{edges:,} lone edges" if edges else None,
        f"{len(found.vf):,} vertex-face",
        f"{len(found.ee):,} edge-edge",
        f"{len(found.vp):,} vertex-plane" if step.planes else None,
        f"{len(found.vv):,} vertex-vertex" if len(found.vv) else None,
        f"{len(found.ve):,} vertex-edge" if len(found.ve) else None,
        f"first at t = {found.first_toc:.4f}" if step.total else None,
        f"{step.milliseconds:.1f} ms",
        f"accuracy {step.recorded.accuracy}" if step.recorded is not None else None,
        separation_fact(step.separation),
        thickness_fact(step.thickness),
        features_fact(step.features),
        f"hash {found.hash:016x}",
    ]
    return [fact for fact in lines if fact]


def separation_fact(separation: Separation) -> str | None:
    """In a few words, whatever the number of pairs and the length of their names; None where contacts touch."""
    count = len(separation.pairs)
    others = f", another for {count:,} pair{'' if count == 1 else 's'}" if count else ""
    return f"separation {separation.minimum:g}{others}" if separation.text else None


def thickness_fact(thickness: Thickness) -> str | None:
    """None where all meshes are infinitely thin."""
    values = sorted({value for _, value in thickness if value})
    return f"thickness {values[0]:g}{f' to {values[-1]:g}' if len(values) > 1 else ''}" if values else None


def features_fact(features: tuple[str, ...]) -> str | None:
    """None where all are tested."""
    return None if features == FEATURES else f"only {' '.join(features).replace('_', '-')}"


def _marked(intersecting: IntersectingFaces, step: ReplayedStep, meshes) -> np.ndarray:
    """(F,) which of the drawn faces intersect another mesh; those of visual geometry do not."""
    names, topologies = step.layout.mesh_names, step.end_frame.topologies
    places = [vertices for _, vertices, *_ in meshes_in_the_middle(step)][: len(topologies)]
    marked = intersecting.of(topologies, places, step.rest)
    of_mesh = dict(zip(names, zip(topologies, marked, strict=True), strict=False))
    return np.concatenate(
        [
            of_mesh[name][1] if name in of_mesh and of_mesh[name][0].faces is faces else np.zeros(len(faces), bool)
            for name, _, faces, _ in meshes
        ]
    )


def _seen(found: Sequence[Between], step: ReplayedStep, meshes) -> list[Between]:
    """Those between meshes that are drawn as they are tested, not by visual geometry."""
    tested = dict(zip(step.layout.mesh_names, step.end_frame.topologies, strict=False))  # planes come last
    drawn = {name for name, _, faces, _ in meshes if name in tested and tested[name].faces is faces}
    return [between for between in found if {between.mesh_a, between.mesh_b} <= drawn]


def meshes_in_the_middle(step: ReplayedStep, visual: VisualGeometry = NO_VISUAL):
    """[(name, vertices (V,3), faces (F,3), edges (E,2) beside theirs)] in the middle of the step, so that contacts at
    any time of it lie close to the surfaces. Robots by their visual geometry; then the planes."""
    start, end = step.start_frame, step.end_frame
    names = step.layout.mesh_names[: len(end.topologies)]
    before, after = (dict(zip(names, frame.vertices, strict=True)) for frame in (start, end))
    topologies = dict(zip(names, end.topologies, strict=True)) | visual.topologies
    before, after = before | visual.vertices(names, start), after | visual.vertices(names, end)
    meshes = [
        (
            name,
            0.5 * np.asarray(before[name], np.float64) + 0.5 * np.asarray(vertices, np.float64),
            topologies[name].faces,
            topologies[name].edges,
        )
        for name, vertices in after.items()
        if name in before
    ]
    places = [vertices for _, vertices, *_ in meshes]
    patches = ((plane.name, patch(plane, places, margin=0.05)) for plane in step.planes)
    return meshes + [(name, corners, PATCH_FACES, OUTLINE) for name, corners in patches if corners is not None]
