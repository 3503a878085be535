# SPDX-License-Identifier: Apache-2.0
"""Meshes whose shape a recording lacks: it is sent once, and came before the recording began. None can be computed
again without."""

from collections.abc import Callable, Mapping

from hpccd_ros.frames.types import POSE, TF
from hpccd_ros.middleware import topic_names, transform_topics


def missing_shapes(parameters: dict, resolve: Callable[[str], str], received: Mapping[str, int]) -> list[str]:
    """One sentence for each mesh that has moved, or was needed for an answer, and whose shape is not there.

    parameters: of the recorded node, {full name: value}. resolve: relative -> absolute name of a topic. received:
    messages so far, by absolute name.
    """

    def came(topic: str) -> bool:
        return received.get(resolve(topic), 0) > 0

    return [
        f"the shape of mesh {mesh} is not in the recording (nothing came on {' and '.join(missing)}), so no replay can "
        f"compute its steps; begin the recording before it is sent, send it again, or give the node mesh.{mesh}.file"
        for mesh in parameters["meshes"] or []  # None: never set
        if (missing := _missing(mesh, parameters, came))
    ]


def _missing(mesh: str, parameters: dict, came: Callable[[str], bool]) -> list[str]:
    """Topics of ``mesh`` on which its shape should have come."""
    given_as = parameters.get(f"mesh.{mesh}.input") or topic_names.VERTICES
    if parameters.get(f"mesh.{mesh}.file") or given_as in topic_names.WHOLE:
        return []
    topology, *positions = (
        topic_names.of_mesh(mesh, kind) for kind in (topic_names.TOPOLOGY, *topic_names.positions(given_as))
    )
    once = [topology]
    if parameters.get(f"mesh.{mesh}.static"):
        once, needed_by = [topology, *positions], [topic_names.CONTACTS]
    elif given_as == TF:
        once, needed_by = [topology, *positions], list(transform_topics.ALL)
    elif given_as == POSE:
        poses, *shape = positions
        once, needed_by = [topology, *shape], [poses]
    else:
        needed_by = positions
    return [topic for topic in once if not came(topic)] if any(map(came, needed_by)) else []
