# SPDX-License-Identifier: Apache-2.0
"""Converts how a result was computed to fields of ContactArray, and back: separation, thickness, features, deviation
bounds, shapes at rest, inputs."""

from array import array
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from hpccd.msg import ContactArray, DistanceArray

from hpccd_core.options import FEATURES, REPORTS
from hpccd_ros.base.quoting import counted, quoted
from hpccd_ros.detect.separation import MOST_THICKNESS, MotionBounds, Separation, Thickness
from hpccd_ros.frames.taken_inputs import TakenInput


def fill_separation(message: ContactArray, separation: Separation) -> None:
    """Write it into ``message``, which has its ``mesh_names``."""
    index = {name: number for number, name in enumerate(message.mesh_names)}
    message.minimum_separation = float(separation.minimum)
    message.separation_mesh_a = array("I", (index[a] for a, _, _ in separation.pairs))
    message.separation_mesh_b = array("I", (index[b] for _, b, _ in separation.pairs))
    message.separations = array("d", (distance for _, _, distance in separation.pairs))


def read_separation(message: ContactArray) -> Separation:
    """Raises ValueError if the fields are inconsistent or invalid."""
    mesh_a, mesh_b, distances = message.separation_mesh_a, message.separation_mesh_b, message.separations
    if not len(mesh_a) == len(mesh_b) == len(distances):
        raise ValueError(
            f"separation_mesh_a, separation_mesh_b and separations have {len(mesh_a)}, {len(mesh_b)} and "
            f"{len(distances)} entries; they belong together"
        )
    names = message.mesh_names
    if beyond := [number for number in (*mesh_a, *mesh_b) if number >= len(names)]:
        raise ValueError(f"separation_mesh_a, separation_mesh_b: {beyond[0]} names a mesh beyond the {len(names)}")
    pairs = tuple((names[a], names[b], d) for a, b, d in zip(mesh_a, mesh_b, distances, strict=True))
    separation = Separation(message.minimum_separation, pairs)
    if why := separation.unusable():
        raise ValueError(f"separation: {why}")
    return separation


def fill_thickness(message: ContactArray | DistanceArray, thickness: Thickness) -> None:
    """Write it into ``message``, which has its ``mesh_names``."""
    of_meshes = dict(thickness)
    if any(of_meshes.values()):
        message.thickness = array("d", (of_meshes.get(name, 0.0) for name in message.mesh_names))


def read_thickness(message: ContactArray | DistanceArray, planes: Container[str] = ()) -> Thickness:
    """Those that are not 0. planes: names that are not those of meshes. Raises ValueError if the field is inconsistent
    or invalid."""
    values = np.frombuffer(message.thickness, np.float64)
    _check_of_meshes(message, "thickness", len(values))
    if not ((values >= 0) & (values <= MOST_THICKNESS)).all():
        raise ValueError(f"thickness: must lie in [0, {MOST_THICKNESS:g}]")
    thick = tuple((name, t) for name, t in zip(message.mesh_names, values.tolist(), strict=False) if t)
    if plane := next((name for name, _ in thick if name in planes), None):
        raise ValueError(f"thickness: {quoted(plane)} is a plane, which has none")
    return thick


def fill_rest(message: ContactArray, stamps: tuple[int, ...]) -> None:
    """stamps: of RestShapes, for the meshes, which precede the planes in the message's ``mesh_names``."""
    if stamps:
        message.rest_stamps = array("q", stamps + (-1,) * (len(message.mesh_names) - len(stamps)))


def read_rest(message: ContactArray) -> tuple[int, ...]:
    """One for each mesh name, or none. Raises ValueError if the field is inconsistent."""
    _check_of_meshes(message, "rest_stamps", len(message.rest_stamps))
    return tuple(message.rest_stamps)


def _check_of_meshes(message: ContactArray | DistanceArray, name: str, count: int) -> None:
    if count not in (0, meshes := len(message.mesh_names)):
        raise ValueError(f"{name}: {counted(count, 'entry', 'entries')} for {counted(meshes, 'mesh', 'meshes')}")


# By the kind of contact.
_BITS = {"vertex_face": 1 << ContactArray.VERTEX_FACE, "edge_edge": 1 << ContactArray.EDGE_EDGE}


def fill_features(message: ContactArray, features: tuple[str, ...]) -> None:
    """Write them into ``message``."""
    message.tested_features = sum(_BITS[name] for name in set(features))


def read_features(message: ContactArray) -> tuple[str, ...]:
    """In the order of FEATURES; both if the message has no such field."""
    tested = tuple(name for name in FEATURES if message.tested_features & _BITS[name])
    return tested if 0 < message.tested_features <= sum(_BITS.values()) else FEATURES


def fill_bounds(message: ContactArray, bounds: MotionBounds) -> None:
    """Write them into ``message``."""
    message.parts = bounds.parts
    message.motion_bounds = array("d", bounds.of_meshes)


def read_bounds(message: ContactArray) -> MotionBounds:
    """Raises ValueError if the fields are inconsistent."""
    bounds, meshes = np.frombuffer(message.motion_bounds, np.float64), len(message.mesh_names)
    if len(bounds) != (meshes if message.parts else 0):
        raise ValueError(
            f"motion_bounds: {counted(len(bounds), 'entry', 'entries')} for {counted(meshes, 'mesh', 'meshes')} and "
            f"{counted(message.parts, 'part')}"
        )
    if not (np.isfinite(bounds).all() and (bounds >= 0).all()):
        raise ValueError("motion_bounds: bounds must be finite and not negative")
    return MotionBounds(message.parts, tuple(bounds.tolist()))


@dataclass(frozen=True, eq=False)
class ListedInputs:
    """Iterate over the inputs that a result lists: they are numbered without gaps, after ``before`` others.

    ``start``, ``end``: inputs taken when the frame at the start of the step, and that at its end, was complete.
    """

    before: int
    start: int
    topics: Sequence[str]
    topic: Sequence[int]
    sent: Sequence[int]
    flags: Sequence[int]

    @property
    def end(self) -> int:
        return self.before + len(self.sent)

    def __iter__(self) -> Iterator[TakenInput]:
        rows = zip(self.topic, self.sent, self.flags, strict=True)
        for number, (topic, sent, flags) in enumerate(rows, start=self.before + 1):
            yield TakenInput(number, self.topics[topic], sent, flags)


def fill_inputs(message: ContactArray, taken: Sequence[TakenInput], start: int, end: int) -> None:
    """taken: the last inputs, up to the number ``end``. start, end: inputs taken when the frame at the start of the
    step, and that at its end, was complete."""
    index: dict[str, int] = {}
    message.inputs_before, message.start_inputs = end - len(taken), start
    message.input_topic = array("H", [index.setdefault(one.topic, len(index)) for one in taken])
    message.input_topics = list(index)
    message.input_sent = array("q", [one.sent for one in taken])
    message.input_flags = array("B", [one.flags for one in taken])


def read_inputs(message: ContactArray) -> ListedInputs | None:
    """The inputs that a result lists; None: its node lists none. Raises ValueError if fields conflict."""
    before, topics, sent = message.inputs_before, message.input_topics, message.input_sent
    if not (before or message.start_inputs or len(message.input_topic) or len(sent) or len(message.input_flags)):
        return None
    if not len(message.input_topic) == len(sent) == len(message.input_flags):
        raise ValueError(
            f"it lists {len(message.input_topic)} topics, {len(sent)} times and {len(message.input_flags)} flags of "
            "inputs"
        )
    if len(sent) and max(message.input_topic) >= len(topics):
        raise ValueError(f"an input is of topic {max(message.input_topic)}, and {len(topics)} are named")
    if message.start_inputs > before + len(sent):
        raise ValueError(f"its step began after {message.start_inputs} inputs and ended after {before + len(sent)}")
    return ListedInputs(before, message.start_inputs, topics, message.input_topic, sent, message.input_flags)


def fill_report(message: ContactArray, report: str) -> None:
    """Write the option ``report`` into ``message``."""
    message.report = 1 + REPORTS.index(report)


def read_report(message: ContactArray) -> str | None:
    """The option ``report`` of the result; None: unknown."""
    return REPORTS[message.report - 1] if 0 < message.report <= len(REPORTS) else None
