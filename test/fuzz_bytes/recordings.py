# SPDX-License-Identifier: Apache-2.0
"""Recordings (MCAP) through what reads them: doctor, recover, cut, replay, view and hpccd-check."""

import contextlib
import functools
import itertools
from pathlib import Path

import numpy as np
from hpccd.msg import ContactArray, DistanceArray

from hpccd_core import MeshFileError
from hpccd_core.options import OUTPUTS
from hpccd_core.sequences.opening import open_sequence
from hpccd_ros.bag.cut import Time, cut
from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.recover import recover
from hpccd_ros.base.errors import UserError
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.middleware import contact_messages, result_fields, snapshot_messages
from hpccd_ros.middleware import message_types as types
from hpccd_ros.picture import of_recording
from hpccd_ros.picture.visual_geometry import VisualGeometry
from hpccd_ros.replay import doctor, recorded_setup
from hpccd_ros.replay.recomputed import Replay

from . import scene
from .mcap_mutations import mutate_file
from .target import Fault, Target, file_of, missing

_RESULTS = {"contacts": types.CONTACTS, "distances": types.DISTANCES}


@functools.cache
def _of_cloth() -> list[bytes]:
    """Two meshes of vertices, one of them from a file, with the results of a node."""
    floor = b"v -2 -2 0\nv 2 -2 0\nv 2 2 0.01\nv -2 2 0\nf 1 2 3 4\n"
    parameters = scene.parameters(("cloth",)) | {
        "meshes": ["cloth", "floor"],
        "mesh.floor.static": True,
        "mesh.floor.file": "floor.obj",
    }
    roles = scene.roles(("cloth",)) | _RESULTS
    attached = [("mesh/floor/floor.obj", floor)]
    stream = scene.messages(("cloth",), 3)
    silent = scene.recording(parameters, roles, stream, attached)
    results = _results(file_of(silent.bytes(), "silent.mcap"))
    bag = scene.recording(parameters, roles, [*stream, *results], attached)
    found = [bag.bytes()]
    bag.compression, bag.chunk_bytes = "lz4", 300
    return [*found, bag.bytes()]


def _results(path: Path):
    """What a node publishes for the steps of a recording."""
    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        detector = StepDetector(setup.builder, setup.options("exact", "cpu", 1))
        for step in Replay(recording, setup, outputs=OUTPUTS, backend="cpu", threads=1).steps():
            contacts = ContactArray(step=step.step, accuracy="exact", backend="cpu")
            contact_messages.fill_contacts(contacts, step.contacts, step.layout)
            result_fields.fill_separation(contacts, step.separation)
            distances = DistanceArray(step=step.step, accuracy="exact", backend="cpu")
            snapshot_messages.fill_distances(distances, detector.distances(step.end_frame), step.layout)
            yield "contacts", _plain(contacts, header=scene.header(step.end), start=scene.time(step.start))
            yield "distances", _plain(distances, header=scene.header(step.end))


def _plain(message, **given) -> bytes:
    values = {
        name: np.array(value) if kind.startswith("sequence<") and "string" not in kind else value
        for name, kind in message.get_fields_and_field_types().items()
        for value in [getattr(message, name)]
    }
    kind = f"hpccd/msg/{type(message).__name__}"
    return scene.encoded(kind, scene.made(kind, **values | given))


@functools.cache
def _recordings() -> list[bytes]:
    """For what computes results."""
    others = [("net",), ("tool",), ("flag",), ("hand",), ("arm",)]
    return [_of_cloth()[1], *map(_of_meshes, others)]


def _of_meshes(names) -> bytes:
    return scene.recording(scene.parameters(names), scene.roles(names), scene.messages(names, 2)).bytes()


@functools.cache
def _containers() -> list[bytes]:
    """For what reads records: small, with and without chunks, index and checksums."""
    roles = {"text": types.DESCRIPTION}
    texts = [("text", scene.encoded(types.DESCRIPTION, scene.made(types.DESCRIPTION, data="a")))] * 3
    bag = scene.recording({"meshes": ["a"]}, roles, texts, [("mesh/a/a.obj", b"v 0 0 0\n")])
    found = []
    for compression, size, summary, check_sums in (
        ("", 1 << 20, True, True),
        ("lz4", 20, True, True),
        ("zstd", 1 << 20, False, False),
        ("", 0, True, False),
    ):
        bag.compression, bag.chunk_bytes, bag.summary, bag.check_sums = compression, size, summary, check_sums
        found.append(bag.bytes())
    return found


def _sequences() -> list[bytes]:
    """For hpccd-check: without edges of no face."""
    names = ("cloth",)
    stream = [
        (role, scene.encoded(types.TOPOLOGY, scene.topology(edges=[])) if role.endswith("topology") else data)
        for role, data in scene.messages(names, 2)
    ]
    bag = scene.recording(scene.parameters(names), scene.roles(names), stream)
    found = [bag.bytes()]
    bag.compression, bag.chunk_bytes = "zstd", 300
    return [*found, bag.bytes(), _of_cloth()[0]]


def _read_doctor(data: bytes) -> None:
    """As `hpccd doctor`."""
    path = file_of(data, "input.mcap")
    found = examine(path)
    doctor._print_examination(found)
    if found.sound:
        with Recording(path) as recording:
            n = sum(1 for _ in recording.records())
        if n != found.message_count:
            raise Fault(f"a sound recording has {found.message_count} messages, of which {n} are read")


def _read_recover(data: bytes) -> None:
    source, target = file_of(data, "input.mcap"), missing("recovered.mcap")
    found = recover(source, target)
    again = examine(target)
    if not again.sound or again.counts != found.counts:
        raise Fault(f"what was recovered is not what was found: {again.problem}")
    with Recording(target) as recording:
        for _ in recording.records():
            pass


def _read_cut(data: bytes) -> None:
    path, target = file_of(data, "input.mcap"), missing("part.mcap")
    by_stamp = len(data) % 4 == 3
    first, last = (Time(scene.sent(0), is_stamp=True), None) if by_stamp else (Time(10**6), Time(3 * 10**6))
    with Recording(path) as recording:
        cut(recording, target, first, last)
    if not examine(target).sound:
        raise Fault("what was cut out is damaged")


def _read_check(data: bytes) -> None:
    for frame in itertools.islice(open_sequence(file_of(data, "input.mcap")), 3):
        assert len(frame.vertices) == sum(mesh.n_vertices for mesh in frame.meshes)


def _read_replay(data: bytes) -> None:
    with Recording(file_of(data, "input.mcap")) as recording:
        setup = recorded_setup.of_recording(recording)
        for _ in Replay(recording, setup, backend="cpu", threads=1).steps():
            pass


def _read_view(data: bytes) -> None:
    path, history = file_of(data, "input.mcap"), of_recording.History()
    with _without_drawing(), Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        visual = VisualGeometry(setup.visual())
        replay = Replay(recording, setup, outputs=("points",), distances=False, backend="cpu", threads=1)
        for step in replay.steps():
            if step.contacts is not None:
                history.add(step)
                of_recording.draw_step(step, "x.png", history, title="a", visual=visual)


@contextlib.contextmanager
def _without_drawing():
    """Pictures are drawn from checked arrays, in a tenth of a second each."""
    draw = of_recording.picture.draw
    of_recording.picture.draw = lambda *_, **__: None
    try:
        yield
    finally:
        of_recording.picture.draw = draw


_WORDS = (
    b"\x28\xb5\x2f\xfd", b"ros2msg", b"cdr", b"json", b"hpccd", b"topic_topic_type_hash", b"/contacts", b"RIHS01_",
    b"uint8[4294967295] a\n", b"string<=5[] b\n", b"MSG: a/b\n", b"\x05", b"lz4", b"zstd", b"offered_qos_profiles",
)  # fmt: skip


def _target(read, seeds, largest: int, errors=(UserError,), **options) -> Target:
    return Target(read, seeds, errors, mutate_file, largest=largest, words=_WORDS, seconds=20, **options)


TARGETS = {
    "doctor": _target(_read_doctor, _containers, 3000),
    "recover": _target(_read_recover, _containers, 3000),
    "cut": _target(_read_cut, lambda: [*_containers(), _of_meshes(("flag",))], 8000),
    "check": _target(_read_check, _sequences, 12_000, (MeshFileError,), needs=("mcap_ros2",)),
    "replay": _target(_read_replay, _recordings, 24_000),
    "view": _target(_read_view, _recordings, 24_000),
}
