# SPDX-License-Identifier: Apache-2.0
"""Recorded smallest distances (topic distances), computed again."""

import dataclasses
from collections import defaultdict

import numpy as np

from hpccd_core.options import ACCURACIES
from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import RecordedTopic
from hpccd_ros.detect.core import CORE_ERRORS
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.middleware import fields
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.middleware.result_fields import read_thickness
from hpccd_ros.middleware.snapshot_messages import fill_distances
from hpccd_ros.replay.frames import PATIENCE, FrameWindow
from hpccd_ros.replay.input_order import OrderedResult

# Fields of DistanceArray, and how many entries each has for a pair of meshes.
# Not approach_speed and time_to_contact: the recording may lack the previous snapshot.
_PER_PAIR = {
    "mesh_a": 1,
    "mesh_b": 1,
    "kind": 1,
    "distance": 1,
    "features_a": 2,
    "features_b": 2,
    "points": 6,
    "direction": 3,
    "inside": 1,
}
# Empty if the recording is older than the field.
_LATER = ("direction", "inside")


class DistanceCheck:
    """Compares each result with its snapshot; they must be bit-identical. accuracy: "": that of each result.

    topics: to read. verified, diverged, unverified: results so far; first: the first difference, or else the first
    reason for which one is not verified, in words. Results from before the recording are not counted.
    """

    def __init__(self, topic: RecordedTopic | None, detector: StepDetector, accuracy: str) -> None:
        self.topics = [topic.name] if topic is not None else []
        self.decode = make_decoder(topic) if topic is not None else None
        self._detector = detector
        self._accuracy = accuracy
        self._waiting: list[tuple[int, object]] = []
        self._beside: dict[OrderedResult, list] = defaultdict(list)
        self._settled: dict[OrderedResult, tuple[SceneFrame | None, bool]] = {}
        self.verified = self.diverged = self.unverified = 0
        self._divergence = self._lack = ""

    @property
    def first(self) -> str:
        return self._divergence or self._lack

    def put(self, message, frames: int) -> None:
        """Add a result, after this number of frames: it may have been written before the last of its positions."""
        self._waiting.append((frames, self.decode(message)))

    def put_of(self, step: OrderedResult | None, message, counts: bool) -> None:
        """The recorded distances for a step; None: there are none. counts: whether they are to be verified."""
        result = self.decode(message)
        if step is not None:
            step.distances -= 1
        if counts and step is None:
            self._lacks(f"distances of step {result.step}: the recording has no contacts of this step")
        elif counts and step in self._settled:
            self._look_beside(result, step)
        elif counts:
            self._beside[step].append(result)
        if step is not None and not step.distances:
            self._settled.pop(step, None)

    def settle_of(self, step: OrderedResult, frame: SceneFrame | None, counts: bool) -> None:
        """Call it when it is known whether there is a frame at the end of this step. counts: it began within the
        recording."""
        self._settled[step] = frame, counts
        for result in self._beside.pop(step, ()):
            self._look_beside(result, step)
        if not step.distances:
            del self._settled[step]

    def _look_beside(self, result, step: OrderedResult) -> None:
        frame, counts = self._settled[step]
        if frame is not None:
            self._look_at(result, step.end, frame)
        elif counts:
            self._lacks(f"distances at {step.end} ns: their frame, or the shape of a mesh at rest, is not certain")

    def settle(self, window: FrameWindow, frames: int | None = None) -> None:
        """Compare waiting results whose frame exists or can no longer arrive. frames: so far; None: all."""
        still = []
        for came, result in self._waiting:
            try:
                stamp = fields.stamp_to_ns(result.header.stamp)
            except InvalidMessageError as error:
                self._lacks(f"the result is malformed: {error}")
                continue
            frame = window.get(stamp)
            if frame is not None:
                self._look_at(result, stamp, frame)
            elif frames is not None and frames < came + PATIENCE:
                still.append((came, result))
            elif window.first is None or stamp >= window.first:
                self._lacks(f"distances at {stamp} ns: the recording has no frame of all meshes with this stamp")
        self._waiting = still

    def _look_at(self, result, stamp, frame) -> None:
        accuracy = self._accuracy or result.accuracy
        if accuracy not in ACCURACIES:
            self._differs(f"distances at {stamp} ns: accuracy {accuracy[:20]!r} is none of {', '.join(ACCURACIES)}")
            return
        try:
            thickness = read_thickness(result, self._detector.plane_names)
        except ValueError as error:
            self._differs(f"distances at {stamp} ns: the recorded result is malformed: {error}")
            return
        known = set(self._detector.mesh_names)
        thickness = tuple(entry for entry in thickness if entry[0] in known)  # names are compared below
        self._detector.options = dataclasses.replace(self._detector.options, accuracy=accuracy, thickness=thickness)
        try:
            gaps = self._detector.distances(frame)
        except CORE_ERRORS as error:
            self._lacks(f"distances at {stamp} ns: the core rejects it: {error}")
            return
        expected = type(result)()
        fill_distances(expected, gaps, self._detector.layout_of(frame))
        if (why := difference(result, expected)) is None:
            self.verified += 1
        else:
            self._differs(f"distances at {stamp} ns: {why}")

    def _differs(self, text: str) -> None:
        self.diverged += 1
        self._divergence = self._divergence or text

    def _lacks(self, text: str) -> None:
        self.unverified += 1
        self._lack = self._lack or text


def difference(recorded, now) -> str | None:
    """None if two DistanceArrays of the same meshes are bit-identical; else the first difference."""
    for name in ("mesh_names", "topology_versions"):
        if list(getattr(recorded, name)) != list(getattr(now, name)):
            return f"{name} {list(getattr(recorded, name))} were recorded, now they are {list(getattr(now, name))}"
    rows = len(now.distance)
    if (count := len(recorded.distance)) != rows:
        return (
            f"{count} pairs of meshes were recorded, now there are {rows}; are the parameters those of the node "
            "(mesh.NAME.static, mesh.NAME.self_collision, ignored_pairs)?"
        )
    columns = {}
    for name, per_pair in _PER_PAIR.items():
        then, new = (np.asarray(getattr(message, name)) for message in (recorded, now))
        if name in _LATER and not len(then):
            continue
        if len(then) != rows * per_pair:
            return f"{name} has {len(then)} entries, {rows * per_pair} belong to {rows} pairs of meshes"
        columns[name] = then.reshape(rows, per_pair), new.reshape(rows, per_pair)
    for row in range(rows):
        for name, (then, new) in columns.items():
            if then[row].tobytes() != new[row].tobytes():
                a, b = (now.mesh_names[getattr(now, side)[row]] for side in ("mesh_a", "mesh_b"))
                return f"{a} - {b}: {name} {then[row].tolist()} was recorded, now it is {new[row].tolist()}"
    if len(recorded.inside) and recorded.nearest != now.nearest:
        return f"nearest {recorded.nearest} was recorded, now it is {now.nearest}"
    return None
