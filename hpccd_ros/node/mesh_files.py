# SPDX-License-Identifier: Apache-2.0
"""Meshes whose topology comes from a file (parameter mesh.NAME.file), and that of static ones their positions."""

from typing import Any

from hpccd_core import MeshFileError, load_mesh
from hpccd_ros.detect.core import unusable_topology
from hpccd_ros.frames.mesh_file import mesh_of_file
from hpccd_ros.frames.outcome import Outcome
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.middleware import resources


def load(pipeline: FramePipeline, meshes: dict[str, dict[str, Any]]) -> Outcome:
    """Read them into the pipeline. meshes: name -> parameters mesh.NAME.*. Raises MeshFileError."""
    outcome = Outcome()
    for name, mesh in meshes.items():
        if mesh["file"]:
            vertices, faces = load_mesh(resources.local_path(mesh["file"]))
            topology, positions = mesh_of_file(vertices, faces, mesh)
            if why := unusable_topology(topology):
                raise MeshFileError(f"mesh.{name}.file {mesh['file']}: {why}")
            outcome += pipeline.load(name, topology, positions)
    return outcome
