# SPDX-License-Identifier: Apache-2.0
"""Parameter files, values on command lines, and the quality of service stored in recordings: all YAML."""

import json

from hpccd_ros.base.errors import UserError
from hpccd_ros.params import parameter_file, scene_parameters, unknown, values
from hpccd_ros.params.table import NODE_ROWS
from hpccd_ros.params.values import ParameterError
from hpccd_ros.replay import playback

from .json_mutations import mutate_json
from .target import Target, file_of

_FILE = b"""/**:
  ros__parameters:
    meshes: [a, b]
    minimum_separation: 1e-3
    mesh: {b: {static: true}}
"""
_OTHER = b"node:\n  ros__parameters: {meshes: [a]}\n/ns/b:\n  ros__parameters:\n    report: first\n"
_VALUES = {
    "frame_id": "world",
    "meshes": ["cloth", "ball"],
    "minimum_separation": 0.001,
    "pair_separation": ["cloth:ball:0.002"],
    "thickness": ["cloth:0.01"],
    "stop_distance": 0.05,
    "outputs": ["points"],
    "mesh.ball.static": True,
    "mesh.ball.pose": [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    "robots": ["arm"],
    "robot.arm.description": "/robot_description",
    "planes": ["floor"],
    "plane.floor.normal": [0.0, 0.0, 1.0],
    "pairs.touch.meshes": ["cloth", "ball"],
    "pairs.touch.separation": 0.002,
    "ignored_pairs": ["cloth:arm/*"],
}
_WORDS = (
    b"!!bool ", b"!!int ", b"!!float ", b"!!timestamp ", b"!!binary ", b"!!set ", b"!!omap ", b"!!pairs ", b"!!null ",
    b"!!python/object:os.system", b"!a ", b"&a ", b"*a", b"<<: ", b"? ", b"| ", b"> ", b"2001-01-01", b"1:2:3", b".inf",
    b".nan", b"0x", b"0b2", b"0o9", b"{", b"[", b"---\n", b"...\n", b"%YAML 9.9\n", b"\t", b"'", b'"\\x00"',
    b"\xc2\x85",
    b"ros__parameters", b"mesh.", b"pair.", b"robot.", b"plane.", b"ignored_pairs: ", b"detail: ", b"thickness: ",
)  # fmt: skip


def _read_file(data: bytes) -> None:
    path = file_of(data, "params.yaml")
    parameter_file.without_section(path, "/ns/hpccd")
    parameter_file.read_parameters(path)


def _read_settings(data: bytes) -> None:
    """Names and values as recordings store them: what the node checks at its start."""
    try:
        given = json.loads(data)
    except (ValueError, RecursionError):
        return
    if isinstance(given, dict):
        settings, meshes = values.checked(given)
        unknown.check(values.unknown(given, meshes, settings["robots"], settings["planes"]), settings)
        scene_parameters.check(settings, meshes)
        scene_parameters.scene_builder(settings, meshes)
        scene_parameters.detector_options(settings)


def _read_value(data: bytes) -> None:
    text = data.decode("utf-8", "surrogateescape")
    parameter_file.value(text)
    parameter_file.parameter_value(text)


_NAMES = tuple(f'"{row.name}":'.encode() for row in NODE_ROWS) + (
    b'"mesh.cloth.', b'"robot.arm.', b'"plane.floor.', b'"pairs.touch.', b'["*:*"]', b'"cloth:ball:', b"null", b"1e999",
    b"NaN", b"Infinity", b"true", b"[]", b"{}", b'["cloth:exact"]', b"9" * 30, b'"\\ud800"', b'"\\u0000"', b'"a/b"',
)  # fmt: skip


class _Topic:
    name, type_name = "/a", "std_msgs/msg/String"

    def __init__(self, offered_qos: str) -> None:
        self.offered_qos = offered_qos


def _read_offers(data: bytes) -> None:
    playback._qos(_Topic(data.decode("utf-8", "replace")))


_OFFERS = b"- depth: 10\n  reliability: reliable\n  durability: transient_local\n  lifespan: {sec: 1, nsec: 0}\n"

TARGETS = {
    "file": Target(_read_file, lambda: [_FILE, _OTHER], (UserError,), words=_WORDS, largest=200),
    "settings": Target(
        _read_settings,
        lambda: [json.dumps(_VALUES).encode()],
        (ParameterError,),
        mutate_json,
        words=_NAMES,
        largest=1500,
    ),
    "value": Target(
        _read_value, lambda: [b"[1, 2.5]", b"0x1f", b"2001-01-01", b"{a: true}"], (), words=_WORDS, largest=100
    ),
    "offers": Target(_read_offers, lambda: [_OFFERS], (UserError,), words=_WORDS, largest=200),
}
