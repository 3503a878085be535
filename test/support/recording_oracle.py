# SPDX-License-Identifier: Apache-2.0
"""Check the results in a recording: it is read by the MCAP library from beginning to end without its index, decoded by
rosbags, and recomputed by the core from the recorded positions."""

import contextlib
import csv
import itertools
import json
import re
import tempfile
import traceback
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from bag_tools import typestore
from base_bags import SECOND
from mcap_model import Bag
from rosbags.serde import SerdeError

import hpccd_core as hc
from hpccd_core import load_mesh
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.frames.rigid_mesh import place
from hpccd_ros.frames.transform_buffer import NoTransformError, TransformBuffer

NOT_THERE = "its positions are not there"
FIELDS = ("kind", "mesh_a", "mesh_b", "features_a", "features_b", "toc")


class Oracle:
    """results: all results in the recording `path`."""

    def __init__(self, path):
        bag = Bag.read(path)
        info = json.loads(next(m for m in bag.metadata if m.name == "hpccd").metadata["json"])
        self.given = info["parameters"]
        self.meshes = [name for name in self.given["meshes"] if name]
        self.files = {a.name: a.data for a in bag.attachments}
        roles = info.get("topics") or {c.topic: c.topic[1:] for c in bag.channels}
        if "contacts" not in roles.values():
            roles = {**roles, "/contacts": "contacts"}
        self.found = defaultdict(list)
        store = typestore()
        schemas = {schema.id: schema for schema in bag.schemas}
        channels = {channel.id: channel for channel in bag.channels}
        for message in bag.messages:
            channel = channels[message.channel_id]
            if channel.topic in roles:
                schema = schemas[channel.schema_id]
                self.found[str(roles[channel.topic])].append(_decode(store, message.data, schema.name))
        self.results = self.found["contacts"]
        self.transforms = TransformBuffer()
        for role in ("transforms_static", "transforms"):
            for message in self.found[role]:
                self._take_transform(message, role == "transforms_static")

    def steps(self) -> list[tuple[int, int, int]]:
        """(step, start, end) of each result."""
        return [(result.step, _ns(result.start), _ns(result.header.stamp)) for result in self.results]

    def untruths(self) -> list[str | None]:
        """For each result, why it does not follow from its positions; None if it does."""
        return [self._untruth_of(result) for result in self.results]

    def _of(self, mesh, name, otherwise):
        value = self.given.get(f"mesh.{mesh}.{name}")
        return otherwise if value is None else value

    def _take_transform(self, message, static):
        shift, turn = message.transform.translation, message.transform.rotation
        try:
            rigid = Rigid.of((shift.x, shift.y, shift.z), (turn.x, turn.y, turn.z, turn.w))
            stamp = None if static else _ns(message.header.stamp)
            self.transforms.add(message.header.frame_id, message.child_frame_id, rigid, stamp)
        except ValueError:
            pass  # rejected by the node too

    def _positions(self, mesh, stamp):
        """All candidate states: [(faces, n_vertices, positions)]."""
        if name := self._of(mesh, "file", ""):
            with tempfile.TemporaryDirectory() as folder:
                data = self.files[f"mesh/{mesh}/{Path(name).name}"]
                copy = Path(folder) / f"mesh{Path(name).suffix}"
                copy.write_bytes(data)
                vertices, faces = load_mesh(str(copy))
            return [(faces, len(vertices), place(vertices, self._of(mesh, "pose", [0.0] * 6 + [1.0])))]
        found = []
        for topology in self.found[f"meshes/{mesh}/topology"]:
            for message in self.found[f"meshes/{mesh}/vertices"] + self.found[f"meshes/{mesh}/points"]:
                if self._of(mesh, "static", False) or _ns(message.header.stamp) == stamp:
                    # A message that cannot be parsed is no frame: the node could not parse it either.
                    with contextlib.suppress(ValueError, KeyError, NoTransformError, AttributeError):
                        found += self._placed(mesh, topology, message)
        return found

    def _placed(self, mesh, topology, message):
        if hasattr(message, "vertices_f32"):
            flat = message.vertices_f32 if len(message.vertices_f32) else message.vertices_f64
            both = len(message.vertices_f32) and len(message.vertices_f64)
            if both or message.topology_version != topology.version:
                return []
        else:
            places = {field.name: field.offset for field in reversed(message.fields)}
            types = {field.name: {7: "<f4", 8: "<f8"}[field.datatype] for field in reversed(message.fields)}
            point = np.dtype(
                {
                    "names": list("xyz"),
                    "formats": [types[n] for n in "xyz"],
                    "offsets": [places[n] for n in "xyz"],
                    "itemsize": message.point_step,
                }
            )
            rows = np.frombuffer(message.data.tobytes(), point, message.width * message.height)
            flat = np.stack([rows[name] for name in "xyz"], axis=1)
        xyz = np.asarray(flat).reshape(-1, 3)
        how = self._of(mesh, "transform", "none")
        if how == "pose":
            xyz = place(xyz.astype(np.float64), self._of(mesh, "pose", []))
        elif how == "tf":
            frame = message.header.frame_id or self._of(mesh, "frame", "")
            rigid = self.transforms.lookup(frame, self.given["frame_id"], _ns(message.header.stamp))
            xyz = rigid.apply(xyz.astype(np.float64))
        return [(topology.faces.reshape(-1, 3), topology.n_vertices, xyz)] if len(xyz) == topology.n_vertices else []

    def _untruth_of(self, result):
        start, end = _ns(result.start), _ns(result.header.stamp)
        ends = [self._positions(mesh, end) for mesh in self.meshes]
        starts = [self._positions(mesh, start) for mesh in self.meshes]
        why = NOT_THERE
        # A stamp may come twice: one of the frames must give the result.
        for chosen in itertools.islice(itertools.product(*starts, *ends), 64):
            first, last = chosen[: len(self.meshes)], chosen[len(self.meshes) :]
            if any(a[1] != b[1] or not np.array_equal(a[0], b[0]) for a, b in zip(first, last, strict=True)):
                continue
            why = self._difference(result, first, last)
            if why is None:
                return None
        return why

    def _difference(self, result, first, last):
        if result.accuracy not in ("fast", "balanced", "conservative", "exact"):
            return "no such accuracy"
        scene = hc.Scene()
        for mesh, (faces, n_vertices, _) in zip(self.meshes, last, strict=True):
            scene.add_mesh(
                mesh,
                faces,
                n_vertices=n_vertices,
                static=self._of(mesh, "static", False),
                self_collision=self._of(mesh, "self_collision", True),
            )
        for pair in self.given.get("ignored_pairs") or []:
            scene.ignore_pair(*pair.split(":"))
        for entry in self.given.get("pair_accuracy") or []:
            scene.set_accuracy(*entry.split(":"))
        kinds = defaultdict(list)
        for a, b, kind in (entry.split(":") for entry in self.given.get("pair_features") or []):
            kinds[min(a, b), max(a, b)].append(kind)
        for pair, named in kinds.items():
            scene.set_features(*pair, named)
        report = self.given.get("report", "all")
        if list(result.mesh_names) != self.meshes:
            return "other meshes"
        separated = [np.asarray(getattr(result, f"separation{part}")).tolist() for part in ("_mesh_a", "_mesh_b", "s")]
        if len({len(part) for part in separated}) > 1:
            return "no such separation"
        try:
            detector = hc.Detector(
                scene,
                accuracy=result.accuracy,
                backend="cpu",
                report="all" if report == "any" else report,
                minimum_separation=result.minimum_separation,
                features={1: "vertex_face", 2: "edge_edge"}.get(result.tested_features, ("vertex_face", "edge_edge")),
            )
            for a, b, distance in zip(*separated, strict=True):
                detector.set_separation(a, b, distance)
        except ValueError:
            return "no such separation"
        t1 = np.concatenate([positions for *_, positions in last])
        still = [self._of(mesh, "static", False) for mesh in self.meshes]
        t0 = np.concatenate([b[2] if s else a[2] for s, a, b in zip(still, first, last, strict=True)])
        try:
            found = detector.detect(t0, t1)
        except ValueError:
            return NOT_THERE
        rows = self._rows(found, last)
        try:
            told = list(zip(*(_columns(result, name) for name in FIELDS), strict=True))
        except ValueError:
            return "arrays of different lengths"
        if report == "any":
            if bool(told) != bool(rows) or not set(told) <= set(rows):
                return "no such contact"
            return None
        if result.truncated != (len(told) < len(rows)):
            return "truncated or not"
        times = sorted(row[-1] for row in rows)
        expected = rows if not result.truncated else None
        if expected is not None and told != expected:
            return "other contacts"
        if expected is None and (not set(told) <= set(rows) or sorted(r[-1] for r in told) != times[: len(told)]):
            return "other contacts"
        if (result.total, result.first_toc, result.hash) != (len(rows), found.first_toc, found.hash):
            return "another total, first time or hash"
        return None

    def _rows(self, found, parts):
        """Tuples (kind, mesh_a, mesh_b, features_a, features_b, toc)."""
        vertex = [(m, i) for m, (_, n_vertices, _) in enumerate(parts) for i in range(n_vertices)]
        face = [(m, i) for m, (faces, *_) in enumerate(parts) for i in range(len(faces))]
        none = 2**32 - 1
        rows = []
        for (v, f), toc in zip(found.vf.tolist(), found.vf_toc.tolist(), strict=True):
            rows.append((0, vertex[v][0], face[f][0], (vertex[v][1], none), (face[f][1], none), toc))
        for (a, b, c, d), toc in zip(found.ee.tolist(), found.ee_toc.tolist(), strict=True):
            rows.append(
                (1, vertex[a][0], vertex[c][0], (vertex[a][1], vertex[b][1]), (vertex[c][1], vertex[d][1]), toc)
            )
        return rows


def lies(path, row, steps, told) -> list[str]:
    """What a replay verified and what is not so. row: of its JSON; steps: its CSV file; told: its output."""
    try:
        reader = Oracle(path)
        whys = reader.untruths()
    except Exception:
        return [f"replay: verified what the oracle cannot read: {traceback.format_exc()}"]
    with open(steps, newline="") as stream:
        equal = [r for r in csv.DictReader(stream) if r["result"] == "equal"]
    verified = Counter(tuple(int(r[name]) for name in ("step", "start_ns", "end_ns")) for r in equal)
    true = Counter(step for step, why in zip(reader.steps(), whys, strict=True) if why is None)
    if wrong := verified - true:
        return [f"replay: WRONG VERIFIED: {list(wrong)}; untrue are {list(zip(reader.steps(), whys, strict=True))}"]
    said = re.search(r"([\d,]+) results? not verified: the step began", told)
    untold = row["unverified"] + (int(said[1].replace(",", "")) if said else 0)
    if row["verified"] + untold != len(reader.results):
        return [f"replay: {row['verified']} results verified, the file has {len(reader.results)}"]
    return []


def _columns(result, name):
    values = np.asarray(getattr(result, name)).tolist()
    return list(zip(values[::2], values[1::2], strict=True)) if name.startswith("features") else values


def _ns(stamp) -> int:
    return stamp.sec * SECOND + stamp.nanosec


def _decode(store, data, type_name):
    try:
        return _texts_of_ros(store.deserialize_cdr(data, type_name))
    except (SerdeError, AssertionError):
        # rosbags takes no byte behind the message, and no text that is no UTF-8; ROS does.
        from rclpy.serialization import deserialize_message

        from hpccd_ros.middleware.message_types import message_class

        return _with_arrays(deserialize_message(data, message_class(type_name)))


def _texts_of_ros(thing):
    """ROS ends a text at its first NUL, rosbags does not."""
    if isinstance(thing, str):
        return thing.partition("\0")[0]
    if isinstance(thing, list):
        return [_texts_of_ros(entry) for entry in thing]
    for field in getattr(thing, "__dataclass_fields__", ()):
        object.__setattr__(thing, field, _texts_of_ros(getattr(thing, field)))
    return thing


def _with_arrays(message):
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if kind.startswith("sequence<") and kind[9:-1] in ("uint8", "uint32", "float", "double"):
            object.__setattr__(message, "_" + name, np.asarray(value))
    return message
