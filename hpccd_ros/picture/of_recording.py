# SPDX-License-Identifier: Apache-2.0
"""Pictures of the steps of a replayed recording."""

import numpy as np

from hpccd_ros.picture import contacts as picture
from hpccd_ros.replay import Step


class History:
    """Step number, contacts and milliseconds of each step that was computed."""

    def __init__(self):
        self.steps, self.contacts, self.milliseconds = [], [], []

    def add(self, step: Step) -> None:
        self.steps.append(step.step)
        self.contacts.append(step.total)
        self.milliseconds.append(step.milliseconds)


def draw_step(step: Step, path, history: History | None = None, *, title: str, **view) -> None:
    """Write a picture of `step`, which was computed with outputs=("points",). view: azimuth, elevation, size."""
    found, frame = step.contacts, step.end_frame
    meshes = [
        (name, vertices, topology.faces)
        for name, vertices, topology in zip(step.layout.mesh_names, frame.vertices, frame.topologies, strict=True)
    ]
    triangles = sum(len(faces) for _, _, faces in meshes)
    accuracy = f"accuracy {step.recorded.accuracy}" if step.recorded is not None else None
    first = f"first at t = {found.first_toc:.4f}" if step.total else None
    facts = [
        f"{triangles:,} triangles", f"{len(found.vf):,} vertex-face", f"{len(found.ee):,} edge-edge", first,
        f"{step.milliseconds:.1f} ms", accuracy, f"hash {found.hash:016x}",
    ]  # fmt: skip
    drawn = picture.Step(
        meshes,
        np.asarray(found.points),
        np.concatenate([found.vf_toc, found.ee_toc]),
        len(found.vf),
        f"{title}: {step.total:,} contacts in step {step.step}",
        [fact for fact in facts if fact],
    )
    context = None
    if history is not None and len(history.steps) > 1:
        context = picture.History(
            np.array(history.steps), np.array(history.contacts), np.array(history.milliseconds), step.step
        )
    picture.draw(drawn, path, context, **view)
