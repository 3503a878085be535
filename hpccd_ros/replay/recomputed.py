# SPDX-License-Identifier: Apache-2.0
"""Computes a recording again, without DDS and at full speed, and compares with the node's results."""

import dataclasses
from collections import Counter, deque
from collections.abc import Iterator, Sequence

import numpy as np

from hpccd_core.options import ACCURACIES, FEATURES, OUTPUTS
from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.detect.core import CORE_ERRORS
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.rest_shapes import RestShapes
from hpccd_ros.detect.scene import PlaneSettings
from hpccd_ros.detect.separation import NO_BOUNDS, NONE, MotionBounds, Separation, Thickness
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames import taken_inputs
from hpccd_ros.frames.samples import HISTORY_NS
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.middleware import fields
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.middleware.result_fields import (
    read_features,
    read_inputs,
    read_report,
    read_rest,
    read_separation,
    read_thickness,
)
from hpccd_ros.params.table import MOST_PARTS
from hpccd_ros.replay.compare import difference, recorded_outputs
from hpccd_ros.replay.distances import DistanceCheck
from hpccd_ros.replay.frames import PATIENCE, FrameSource, FrameWindow
from hpccd_ros.replay.input_order import InputOrder, OrderedResult
from hpccd_ros.replay.recorded_setup import ReplaySetup

# Frames kept for later results; at least as many as can wait in the node.
WINDOW = 64


@dataclasses.dataclass
class ReplayedStep:
    """One step of the scene: the recorded and the computed result. Stamps in ns."""

    number: int  # counts the steps of this replay, from 0
    step: int  # number from the publisher
    start: int
    end: int
    start_frame: SceneFrame | None
    end_frame: SceneFrame | None
    recorded: object | None  # ContactArray, or None in a recording without contacts
    at: float = 0.0  # seconds into the recording, of the result or else of the last message of its end frame
    contacts: object | None = None  # of the core, or None if a frame is missing
    layout: Layout | None = None
    separation: Separation = NONE  # in force
    thickness: Thickness = ()  # as well
    planes: tuple[PlaneSettings, ...] = ()
    rest: Sequence[np.ndarray | None] = ()  # as in RestShapes
    features: tuple[str, ...] = FEATURES  # that were tested
    bounds: MotionBounds = NO_BOUNDS  # of motion by poses
    milliseconds: float = 0.0  # the core's call, wall time
    difference: str | None = None  # first difference from the recorded result
    missing: str | None = None  # why it could not be computed
    before_recording: bool = False  # it began before the recording did
    uncertain: str = ""  # why a difference would not show that the node was wrong
    depends_on_before: bool = False  # the uncertainty is about inputs from before the recording

    @property
    def total(self) -> int:
        return len(self.contacts) if self.contacts is not None else 0


@dataclasses.dataclass(eq=False)
class _Session:
    """State from the results since the node was configured, for later ones. history: transforms or joint states move
    meshes, so that frames depend on earlier messages. ``computed``: the frames of a result existed. ``lacks_early``:
    inputs from before the recording are missing. ``uncertain``: later inputs are missing, in words. ``first``: stamp at
    which the first of these results ends. ``settled``: nothing depends on that history any more.
    """

    history: bool
    number: int = 0
    begun: int = 0
    computed: bool = False
    lacks_early: bool = False
    uncertain: str = ""
    first: int | None = None
    settled: bool = False

    def step_of(self, known: OrderedResult, result, at: float, start_frame, end_frame) -> ReplayedStep:
        """The frames of a step, or why they are missing."""
        step = ReplayedStep(0, result.step, known.start, known.end, start_frame, end_frame, result, at)
        step.missing = known.problem or self._lack(known)
        if step.missing:
            return step
        self._settle(known)
        begins = not self.computed and 0 < known.listed.start <= known.begun
        step.depends_on_before = self._is_first and not self.uncertain and (begins or not self.settled)
        step.uncertain = "it may depend on what came before the recording" * step.depends_on_before or self.uncertain
        for name, stamp, frame in (("start", known.start, start_frame), ("end", known.end, end_frame)):
            if frame is None:
                joined_late = self._is_first and not self.computed and (known.begun > 0 or self.lacks_early)
                step.before_recording = joined_late or step.depends_on_before
                step.missing = f"the inputs taken make no frame at its {name}, stamp {stamp} ns"
                return step
        if not start_frame.same_scene(end_frame):
            step.missing = "the topology or the coordinate frame changes between its start and its end"
            return step
        self.computed = True
        return step

    @property
    def _is_first(self) -> bool:
        """Note missing inputs. Only inputs of the first result can be from before the recording."""
        return self.number == 0

    def _lack(self, known: OrderedResult) -> str | None:
        if known.session != self.number:
            self.__init__(self.history, known.session)
        if known.begun != self.begun:
            self.begun = known.begun
            if self.computed or not self._is_first:
                self.uncertain = self.uncertain or "an earlier result is missing, and with it the inputs that it lists"
        if not known.missing:
            return None
        if known.early and not self.computed:
            self.lacks_early = True
            if not self._is_first:
                self.uncertain = self.uncertain or known.missing
            return None
        self.uncertain = self.uncertain or known.missing
        return known.missing

    def _settle(self, known: OrderedResult) -> None:
        self.first = known.end if self.first is None else self.first
        self.settled = (
            self.settled
            or not (self.history and (known.begun or self.lacks_early))
            or (taken_inputs.STOPPED in known.listed.topics and not known.missing)  # the node discarded it, too
            or known.end > self.first + HISTORY_NS
        )


class Replay:
    """Reads a recording once. Iterate over `steps()`; the counts are valid during and after the iteration.

    backend, threads: as in hpccd_core.Detector; the contacts must not depend on them.
    accuracy, features: empty: those of each result. The separation is always that of the result.
    outputs: computed in addition to those that the results have, which are compared.
    distances: whether to check the results on the topic distances too.
    begin, end: seconds into the recording; steps outside are neither computed nor counted.
    messages_read: recorded messages so far, of `message_count`.
    """

    def __init__(
        self,
        recording: Recording,
        setup: ReplaySetup,
        *,
        backend="auto",
        threads=0,
        accuracy="",
        features=(),
        outputs=(),
        distances=True,
        begin=0.0,
        end=float("inf"),
    ):
        self._recording = recording
        self._setup = setup
        self._backend, self._threads, self._accuracy = backend, threads, accuracy
        self._features = tuple(features)
        self._outputs = set(outputs)  # and of the results so far: a change makes a new detector
        self._begin, self._end = begin, end
        self._at = 0.0  # seconds into the recording, of the message read last
        self.messages_read = 0
        results = recording.topics.get(setup.contacts)
        self.recorded_results = results.count if results else 0
        self._decode_result = make_decoder(results) if results else None
        self._ordered = self.recorded_results > 0 and self._lists_inputs()
        self.source = FrameSource(setup, recording.topics, self._ordered)
        builder = setup.builder
        self._rest = RestShapes(builder.rest_of_frames)
        self._detector = StepDetector(builder, self._options(None), self._rest)
        self._every_contact = StepDetector(builder, self._options(None), self._rest)
        distance_topic = recording.topics.get(setup.distances) if distances else None
        self.distances = DistanceCheck(distance_topic, StepDetector(builder, self._options(None), self._rest), accuracy)
        self._mesh_names, self._planes = setup.mesh_names, builder.planes
        self._window = FrameWindow(max(WINDOW, 2 * setup.settings["frame_queue"]))
        self.any_one = setup.settings["report"] == "any"  # then "verified" means less: compare.py
        self.not_taken: Counter[str] = Counter()  # topic -> messages that the node did not take
        self.verified = self.diverged = self.unverified = 0
        self.frames = 0
        self.first_divergence: ReplayedStep | None = None

    @property
    def message_count(self) -> int:
        """Messages that a replay reads."""
        return sum(self._recording.topics[name].count for name in self._topics)

    @property
    def _topics(self):
        return self.source.topics + ([self._setup.contacts] if self.recorded_results else []) + self.distances.topics

    def steps(self) -> Iterator[ReplayedStep]:
        """Each recorded result, computed again; in a recording without results, each step from frame to frame."""
        find = self._successive_frames
        if self.recorded_results:
            find = self._ordered_results if self._ordered else self._results
        number = 0
        for step in find():
            if step.at < self._begin:
                continue
            if step.at > self._end:
                break
            step.number, number, step.planes = number, number + 1, self._planes
            if step.missing is None:
                self._compute(step)
            if step.missing is None:
                self._compare(step)
            if step.difference and step.uncertain:
                step.missing, step.difference = f"{step.uncertain} (recomputed without it: {step.difference})", None
                step.before_recording = step.depends_on_before
            self._count(step)
            yield step
        self.distances.settle(self._window)

    def _lists_inputs(self) -> bool:
        """Whether the results list the inputs taken, and the recorder stored the times in these lists."""
        first = next(self._recording.messages([self._setup.contacts]))
        try:
            listed = read_inputs(self._decode_result(first)) is not None
        except ValueError:
            listed = True
        return listed and first.publish_time != first.log_time

    def _ordered_results(self):
        contacts, distances = self._setup.contacts, next(iter(self.distances.topics), None)
        decode = {contacts: self._decode_result, distances: self.distances.decode}
        order = InputOrder(self._recording, self.source, contacts, distances, decode)
        self.not_taken = order.not_taken
        results, of_distances = iter(order.results), iter(order.of_distances)
        session = _Session(history=any(not mesh for mesh, _ in self._setup.roles.values()))
        waiting, begun = deque(), False
        for message in self._messages():
            if message.topic == contacts:
                begun = True
                waiting.append((next(results), self._decode_result(message), self._at))
            elif message.topic == distances:
                step = next(of_distances)
                # It has no contacts and precedes all others: the recording began between the two messages.
                within = (begun or step is not None) and self._begin <= self._at <= self._end
                self.distances.put_of(step, message, counts=within)
            else:
                order.put(message)
            order.advance()
            self.frames = order.made
            while waiting and waiting[0][0].complete:
                known, result, at = waiting.popleft()
                step = session.step_of(known, result, at, *order.frames(known))
                yield step
                # A step without the frame at its start was not computed; its distances need the same shapes at rest.
                certain = not (step.missing and (step.uncertain or (step.end_frame and self._lacks_rest(step))))
                self.distances.settle_of(known, step.end_frame if certain else None, counts=not step.before_recording)

    def _results(self):
        waiting = []
        for message in self._messages():
            if message.topic == self._setup.contacts:
                # A result may have been written before the last of its messages.
                waiting.append((self.frames, self._at, self._decode_result(message)))
            else:
                for _ in self._push(message):
                    pass
            while waiting:
                came, at, result = waiting[0]
                step = self._step_of(result, at)
                if step.missing and not step.before_recording and self.frames < came + PATIENCE:
                    break
                waiting.pop(0)
                yield step
        for _, at, result in waiting:
            yield self._step_of(result, at)

    def _successive_frames(self):
        last = None
        for message in self._messages():
            for frame in self._push(message):
                if last is not None and last.same_scene(frame) and frame.stamp > last.stamp:
                    yield ReplayedStep(0, frame.step or 0, last.stamp, frame.stamp, last, frame, None, self._at)
                last = frame

    def _push(self, message) -> list[SceneFrame]:
        """Put the frames that a message completes into the window; a result about distances completes none."""
        if message.topic in self.distances.topics:
            if self._begin <= self._at <= self._end:
                self.distances.put(message, self.frames)
            return []
        frames = self.source.push(message)
        for frame in frames:
            self.frames += 1
            self._window.put(frame)
        self.distances.settle(self._window, self.frames)
        return frames

    def _messages(self):
        first = None
        for count, message in enumerate(self._recording.messages(self._topics), start=1):
            first = message.log_time if first is None else first
            self._at = (message.log_time - first) * 1e-9
            yield message
            self.messages_read = count

    def _step_of(self, result, at) -> ReplayedStep:
        window = self._window
        try:
            start, end = fields.stamp_to_ns(result.start), fields.stamp_to_ns(result.header.stamp)
        except InvalidMessageError as error:
            missing = f"the result is malformed: {error}"
            return ReplayedStep(0, result.step, 0, 0, None, None, result, at, missing=missing)
        step = ReplayedStep(0, result.step, start, end, window.get(start), window.get(end), result, at)
        for name, stamp, frame in (("start", start, step.start_frame), ("end", end, step.end_frame)):
            if frame is None:
                step.before_recording = window.first is not None and stamp < window.first
                step.missing = f"the recording has no frame of all meshes at its {name}, stamp {stamp} ns"
                return step
        if not step.start_frame.same_scene(step.end_frame):
            step.missing = "the topology or the coordinate frame changes between its start and its end"
        return step

    def _compute(self, step):
        end = step.end_frame
        self._detector.options = self._options(step.recorded)
        if step.recorded is not None and (lack := self._lacks_rest(step)):
            step.missing = step.uncertain = lack
            return
        try:
            self._detector.prepare_scene(end, step.start_frame)
        except CORE_ERRORS as error:
            raise RecordingError(f"frame with stamp {end.stamp} ns: the core rejects it: {error}") from error
        try:
            self._detector.prepare_detector()
        except CORE_ERRORS as error:
            raise RecordingError(f"cannot compute as it was recorded: {error}") from error
        try:
            found = self._detector.detect(step.start_frame, end)
        except CORE_ERRORS as error:
            step.missing = f"the core rejects it: {error}"  # as in the node, which continues with the next one
            return
        step.contacts, step.layout, step.milliseconds = found.contacts, found.layout, found.detect_ms
        step.bounds = found.bounds
        step.separation, step.features = found.options.separation, found.options.features
        step.thickness, step.rest = found.options.thickness, found.rest

    def _lacks_rest(self, step) -> str | None:
        """Why the shapes at rest of a recorded result are unknown, or None: its start gives them, or they are known."""
        rest, topologies = self._rest, step.end_frame.topologies
        recorded = self._valid(step.recorded, read_rest)[: len(topologies)]
        if recorded and recorded != rest.stamps(topologies):
            if step.start_frame is not None:
                if all(stamp in (-1, step.start) for stamp in recorded):
                    rest.forget()
                rest.look_at(step.start_frame)
            if recorded != rest.stamps(topologies):
                return "the recording lacks the frame that gave a mesh its shape at rest (mesh.NAME.ignored_at_rest)"
        return None

    def _options(self, recorded):
        """The options of the recorded result, if there is one; an invalid accuracy or separation diverges:
        compare.py."""
        options = self._setup.options(self._accuracy, self._backend, self._threads)
        if recorded is not None:
            if not self._accuracy and recorded.accuracy in ACCURACIES:
                options = dataclasses.replace(options, accuracy=recorded.accuracy)
            options = dataclasses.replace(options, report=read_report(recorded) or options.report)
            separation, features = self._valid(recorded, read_separation) or NONE, read_features(recorded)
            # In the same number of parts: the tolerance may have been different.
            rigid = dataclasses.replace(options.rigid, parts=min(recorded.parts, MOST_PARTS))
            thickness = self._valid(recorded, lambda message: read_thickness(message, self._detector.plane_names))
            options = dataclasses.replace(
                options, separation=separation, features=features, rigid=rigid, thickness=thickness
            )
            self._outputs |= recorded_outputs(recorded)
        if self._features:
            options = dataclasses.replace(options, features=self._features)
        return dataclasses.replace(options, outputs=tuple(name for name in OUTPUTS if name in self._outputs))

    def _valid(self, recorded, read):
        """What ``read`` finds in a result of these meshes; an empty tuple if it is invalid."""
        if list(recorded.mesh_names) != self._mesh_names:
            return ()
        try:
            return read(recorded)
        except ValueError:
            return ()

    def _compare(self, step):
        if step.recorded is None:
            return
        found, any_one = step.contacts, self._detector.options.report == "any"
        self.any_one |= any_one
        if any_one:
            # Which one the node found depended on the timing of its threads: it must be one of all.
            self._every_contact.options = dataclasses.replace(self._detector.options, report="all", outputs=())
            found = self._every_contact.detect(step.start_frame, step.end_frame).contacts
        step.difference = difference(step.recorded, found, step.layout, any_one, step.bounds)

    def _count(self, step):
        if step.missing:
            self.unverified += not step.before_recording
        elif step.difference:
            self.diverged += 1
            self.first_divergence = self.first_divergence or step
        elif step.recorded is not None:
            self.verified += 1
