# SPDX-License-Identifier: Apache-2.0
"""The package's messages for Cyclone DDS, written by hand from the .msg files, without code of ROS."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, float64, int32, int64, sequence, uint8, uint16, uint32, uint64


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class MeshTopology(IdlStruct, typename="hpccd::msg::dds_::MeshTopology_"):
    header: Header
    version: uint32
    n_vertices: uint32
    faces: sequence[uint32]
    edges: sequence[uint32]


@dataclass
@final
class MeshVertices(IdlStruct, typename="hpccd::msg::dds_::MeshVertices_"):
    header: Header
    topology_version: uint32
    step: uint64
    vertices_f32: sequence[float32]
    vertices_f64: sequence[float64]


@dataclass
@final
class ContactArray(IdlStruct, typename="hpccd::msg::dds_::ContactArray_"):
    header: Header
    start: Time
    step: uint64
    mesh_names: sequence[str]
    kind: sequence[uint8]
    mesh_a: sequence[uint32]
    mesh_b: sequence[uint32]
    features_a: sequence[uint32]
    features_b: sequence[uint32]
    toc: sequence[float64]
    points: sequence[float64]
    normals: sequence[float64]
    first_toc: float64
    total: uint64
    truncated: bool
    tested_features: uint8
    hash: uint64
    accuracy: str
    backend: str
    dropped_frames: uint64
    topology_versions: sequence[uint32]
    minimum_separation: float64
    separation_mesh_a: sequence[uint32]
    separation_mesh_b: sequence[uint32]
    separations: sequence[float64]
    closest: sequence[float64]
    distance: sequence[float64]
    parts: uint32
    motion_bounds: sequence[float64]
    inputs_before: uint64
    start_inputs: uint64
    input_topics: sequence[str]
    input_topic: sequence[uint16]
    input_sent: sequence[int64]
    input_flags: sequence[uint8]
    report: uint32
    vertices: sequence[uint32]
    weights: sequence[float64]
    approach: sequence[float64]
