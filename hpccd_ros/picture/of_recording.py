# SPDX-License-Identifier: Apache-2.0
"""Pictures of the steps of a replayed recording."""

import numpy as np

from hpccd_core.options import FEATURES
from hpccd_ros.detect.separation import Separation
from hpccd_ros.picture import contacts as picture
from hpccd_ros.picture.contacts import scene_indices
from hpccd_ros.replay.recomputed import ReplayedStep


class History:
    """Number, contacts and milliseconds of each step that was computed."""

    def __init__(self):
        self.steps, self.contacts, self.milliseconds = [], [], []

    def add(self, step: ReplayedStep) -> None:
        self.steps.append(step.step)
        self.contacts.append(step.total)
        self.milliseconds.append(step.milliseconds)


def draw_step(step: ReplayedStep, path, history: History | None = None, *, title: str, **view) -> None:
    """Write a picture of `step`, which was computed with outputs=("points",). view: azimuth, elevation, size."""
    found = step.contacts
    meshes, offsets = meshes_in_the_middle(step), step.layout.vertex_offsets
    of = f" of {max(history.steps)}" if history is not None else ""
    drawn = picture.Picture(
        meshes,
        touched(found, scene_indices([faces for _, _, faces, _ in meshes], np.diff(offsets)), offsets[-1]),
        np.asarray(found.points),
        np.concatenate([found.vf_toc, found.ee_toc]),
        f"{step.total:,} contact{'' if step.total == 1 else 's'} in step {step.step}" + of,
        facts(step),
        title,
    )
    context = None
    if history is not None and len(history.steps) > 1:
        context = picture.History(
            np.array(history.steps), np.array(history.contacts), np.array(history.milliseconds), step.step
        )
    picture.draw(drawn, path, context, **view)


def facts(step: ReplayedStep) -> list[str]:
    """What a line beneath the title says of a step that was computed."""
    found = step.contacts
    triangles, edges = (sum(len(getattr(t, kind)) for t in step.end_frame.topologies) for kind in ("faces", "edges"))
    lines = [
        f"{triangles:,} triangles" if triangles else None,
        f"{edges:,} lone edges" if edges else None,
        f"{len(found.vf):,} vertex-face",
        f"{len(found.ee):,} edge-edge",
        f"first at t = {found.first_toc:.4f}" if step.total else None,
        f"{step.milliseconds:.1f} ms",
        f"accuracy {step.recorded.accuracy}" if step.recorded is not None else None,
        separation_fact(step.separation),
        features_fact(step.features),
        f"hash {found.hash:016x}",
    ]
    return [fact for fact in lines if fact]


def separation_fact(separation: Separation) -> str | None:
    """In a few words, whatever the number of pairs and the length of their names; None where contacts touch."""
    count = len(separation.pairs)
    others = f", another for {count:,} pair{'' if count == 1 else 's'}" if count else ""
    return f"separation {separation.minimum:g}{others}" if separation.text else None


def features_fact(features: tuple[str, ...]) -> str | None:
    """None where all are tested."""
    return None if features == FEATURES else f"only {' '.join(features).replace('_', '-')}"


def meshes_in_the_middle(step: ReplayedStep):
    """[(name, vertices (V,3), faces (F,3), edges (E,2) beside theirs)] in the middle of the step, so that contacts at
    any time of it lie close to the surfaces."""
    start, end = step.start_frame, step.end_frame
    return [
        (name, 0.5 * np.asarray(v0, np.float64) + 0.5 * np.asarray(v1, np.float64), topology.faces, topology.edges)
        for name, v0, v1, topology in zip(
            step.layout.mesh_names, start.vertices, end.vertices, end.topologies, strict=True
        )
    ]


def touched(found, faces, n_vertices):
    """(V,) earliest time of contact of each vertex: its own, that of an edge it ends, or of a face around it."""
    earliest = np.full(n_vertices, np.inf)
    for vertices, toc in (
        (found.vf[:, :1], found.vf_toc),
        (faces[found.vf[:, 1]], found.vf_toc),
        (found.ee, found.ee_toc),
    ):
        np.minimum.at(earliest, vertices, toc[:, None])
    return earliest
