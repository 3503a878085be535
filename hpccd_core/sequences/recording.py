# SPDX-License-Identifier: Apache-2.0
"""Recordings of the ROS node: meshes in MCAP files whose vertices were published in one coordinate frame."""

import contextlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import shortened
from .mcap_chunks import check_chunks
from .numbering import missing_between
from .packages import needed
from .sequence import FrameSequence, SequenceError, SequenceMesh
from .topology import checked_faces, same_or, short_names

SUFFIXES = (".mcap",)
_TOPOLOGY, _VERTICES = "hpccd/msg/MeshTopology", "hpccd/msg/MeshVertices"
_REPLAY = "use hpccd replay"
# Last parts of topics from which the node makes meshes, too.
_OTHER_INPUTS = ("points", "shape", "marker", "pose")


@dataclass
class _Recorded:
    """Where the messages of a mesh are: by topology version the log time, by stamp (log time, version, step)."""

    vertices: str
    topology: str
    topologies: dict[int, int] = field(default_factory=dict)
    frames: dict[int, tuple[int, int, int]] = field(default_factory=dict)


class Recording(FrameSequence):
    """The meshes of an MCAP file, with frames joined by their stamps.

    Parameters
    ----------
    path : Path
        The file. Other topics, such as results, are ignored.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with self._errors():
            self._meshes, frame_id = self._index()
        moving = {name: mesh.frames for name, mesh in self._meshes.items() if len(mesh.frames) > 1}
        frames = list(moving.values()) or [mesh.frames for mesh in self._meshes.values()][:1]
        self._stamps = sorted(set.intersection(*(set(of_mesh) for of_mesh in frames)))
        notes = [f"positions are in the coordinate frame {shortened(frame_id) or '(no name)'}"]
        if left_out := len(set().union(*frames)) - len(self._stamps):
            notes.append(f"{left_out} stamps are left out: not all meshes have a frame with them")
        static = [name for name in self._meshes if moving and name not in moving]
        notes += [f"{name} has one message: its mesh is the same in all frames" for name in static]
        steps = [frames[0][stamp][2] for stamp in self._stamps]
        missing, of_missing = missing_between(steps, [self._label(stamp) for stamp in self._stamps])
        super().__init__(str(path), len(self._stamps), (*notes, *of_missing), missing)

    @contextlib.contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (SequenceError, OSError):
            raise
        except Exception as error:  # mcap passes on any exception of its decompressors and parsers
            raise SequenceError(
                f"{self._path}: is not a whole MCAP file; if it is cut off or damaged, recover it with hpccd doctor "
                "--recover"
            ) from error

    def _reader(self) -> Any:
        if "reader" not in self._opened:
            reader = needed("mcap.reader", "mcap", self._path)
            decoder = needed("mcap_ros2.decoder", "mcap-ros2-support", self._path)
            self._opened["reader"] = reader.make_reader(
                open(self._path, "rb"), validate_crcs=True, decoder_factories=[decoder.DecoderFactory()]
            )
        return self._opened["reader"]

    def _index(self) -> tuple[dict[str, _Recorded], str]:
        """(messages of each mesh, coordinate frame); one pass over the file."""
        summary = self._reader().get_summary()
        if summary is None:
            raise SequenceError(f"{self._path}: has no index; recover it with hpccd doctor --recover")
        check_chunks(self._path, [chunk.chunk_start_offset for chunk in summary.chunk_indexes])
        types = {
            channel.topic: summary.schemas[channel.schema_id].name
            for channel in summary.channels.values()
            if channel.schema_id
        }
        self._check_inputs(list(types))
        for schema in summary.schemas.values():
            # The parser of definitions prints lines that it cannot read.
            if schema.name in (_TOPOLOGY, _VERTICES) and not "".join(schema.data.decode().split()).isprintable():
                raise SequenceError(f"{self._path}: the definition of {schema.name} is not text; record it again")
        found: list[_Recorded] = []
        for topic in sorted(name for name, kind in types.items() if kind == _VERTICES):
            topology = f"{topic.rpartition('/')[0]}/topology"
            if types.get(topology) != _TOPOLOGY:
                raise SequenceError(f"{self._path}: {topic} has no faces ({topology}); record both topics")
            found.append(_Recorded(topic, topology))
        folders = [mesh.topology.removesuffix("/topology") or "mesh" for mesh in found]
        meshes = dict(zip(short_names(folders, "/"), found, strict=True))
        if not meshes:
            raise SequenceError(f"{self._path}: has no messages {_VERTICES}; {_REPLAY} if its meshes move by poses")
        by_topic = {mesh.topology: mesh for mesh in meshes.values()} | {mesh.vertices: mesh for mesh in meshes.values()}
        coordinates: set[str] = set()
        for _, channel, record, message in self._reader().iter_decoded_messages(topics=list(by_topic)):
            mesh = by_topic[channel.topic]
            if channel.topic == mesh.topology:
                mesh.topologies[message.version] = record.log_time
                continue
            coordinates.add(message.header.frame_id)
            stamp = _stamp(message)
            if mesh.frames and stamp <= next(reversed(mesh.frames)):
                raise SequenceError(
                    f"{self._path}: stamps of {channel.topic} do not increase: it holds several runs; cut one out with "
                    "hpccd cut"
                )
            mesh.frames[stamp] = record.log_time, message.topology_version, message.step
        for mesh in meshes.values():
            if not mesh.frames:
                raise SequenceError(f"{self._path}: {mesh.vertices} has no messages; record it again")
        if len(coordinates) > 1:
            names = ", ".join(sorted(map(repr, coordinates)))
            raise SequenceError(f"{self._path}: meshes are in different coordinate frames ({names[:200]}); {_REPLAY}")
        return meshes, coordinates.pop()

    def _check_inputs(self, topics: list[str]) -> None:
        """Raises SequenceError where the node had positions from elsewhere."""
        for topic in topics:
            parts = topic.split("/")
            if len(parts) > 2 and parts[-3] == "meshes" and parts[-1] in _OTHER_INPUTS:
                raise SequenceError(f"{self._path}: a mesh comes from {topic}; {_REPLAY}")
        for record in self._reader().iter_metadata():
            if record.name != "hpccd":
                continue
            parameters = json.loads(record.metadata.get("json", "{}")).get("parameters", {})
            for name, value in parameters.items():
                kind = name.rpartition(".")[2] if name.startswith("mesh.") else name
                usual = {"input": "vertices", "transform": "none", "file": "", "robots": [], "points": []}
                if kind in usual and value != usual[kind]:
                    raise SequenceError(f"{self._path}: the node had {name} = {shortened(value)}; {_REPLAY}")

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        stamp = self._stamps[index]
        with self._errors():
            found = self._messages(stamp)
            meshes = tuple(self._mesh(name, mesh, found[name]) for name, mesh in self._meshes.items())
        self._opened["meshes"] = same = same_or(self._opened.get("meshes"), meshes)
        positions = [_positions(found[name]) for name in self._meshes]
        for mesh, of_mesh in zip(same, positions, strict=True):
            if len(of_mesh) != mesh.n_vertices:
                raise SequenceError(
                    f"{self._path}: {mesh.name} has {len(of_mesh)} positions and {mesh.n_vertices} vertices at stamp "
                    f"{stamp}; record it again"
                )
        return self._label(stamp), same, np.concatenate(positions)

    def _label(self, stamp: int) -> str:
        return f"{self._path.name} @ {stamp // 10**9}.{stamp % 10**9:09d}"

    def _messages(self, stamp: int) -> dict[str, Any]:
        """The message of each mesh; of a static one its only message."""
        wanted = {name: stamp if len(m.frames) > 1 else next(iter(m.frames)) for name, m in self._meshes.items()}
        names = {mesh.vertices: name for name, mesh in self._meshes.items()}
        found = {name: self._opened[f"static {name}"] for name in wanted if f"static {name}" in self._opened}
        times = [self._meshes[name].frames[wanted[name]][0] for name in wanted if name not in found]
        for _, channel, _, message in self._reader().iter_decoded_messages(
            topics=[self._meshes[name].vertices for name in wanted if name not in found],
            starting_at=min(times, default=0),
            ending_at=max(times, default=0),
        ):
            name = names[channel.topic]
            if _stamp(message) == wanted[name]:
                found[name] = message
                if len(self._meshes[name].frames) == 1:
                    self._opened[f"static {name}"] = message
        return found

    def _mesh(self, name: str, mesh: _Recorded, message: Any) -> SequenceMesh:
        version = message.topology_version
        key = f"topology {name}"
        if key not in self._opened or self._opened[key][0] != version:
            if version not in mesh.topologies:
                raise SequenceError(f"{self._path}: {name} has no topology of version {version}; record it again")
            at = mesh.topologies[version]
            for _, _, _, topology in self._reader().iter_decoded_messages(
                topics=[mesh.topology], starting_at=at, ending_at=at
            ):
                if topology.version == version:
                    self._opened[key] = version, self._with_faces(name, topology)
        made: SequenceMesh = self._opened[key][1]
        return made

    def _with_faces(self, name: str, topology: Any) -> SequenceMesh:
        if len(topology.edges):
            raise SequenceError(f"{self._path}: {name} has edges of no face, such as ropes; {_REPLAY}")
        faces = np.array(topology.faces, np.uint32)
        if faces.size % 3:
            raise SequenceError(f"{self._path}: {name} has {faces.size} corners of triangles; record it again")
        faces = checked_faces(f"{self._path}: {name}", faces.reshape(-1, 3), topology.n_vertices)
        return SequenceMesh(name, faces, topology.n_vertices)


def _stamp(message: Any) -> int:
    """In nanoseconds."""
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def _positions(message: Any) -> NDArray[np.float64]:
    """(V, 3) of the array that is not empty."""
    given = message.vertices_f64 if len(message.vertices_f64) else message.vertices_f32
    return np.array(given, np.float64).reshape(-1, 3)
