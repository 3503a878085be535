# SPDX-License-Identifier: Apache-2.0
"""Continuous collision detection of deforming triangle meshes, with contacts that can be proven.

scene = Scene(); scene.add_mesh("cloth", faces)
contacts = Detector(scene).detect(vertices_t0, vertices_t1)
"""

from . import (
    _find_core,  # noqa: F401  (lets a source checkout use the installed extension modules)
    shapes,
)
from ._core import Cancelled, DeviceArray, InvalidArgument, __version__
from ._installations import warn_of_several as _warn_of_several
from .contacts import Contacts
from .contours import Contour, EnclosedRegion
from .detector import Detector
from .device_distances import DeviceDistances
from .device_results import DeviceContacts, DeviceIntersections, DeviceProximity
from .devices import backends, gpu_status
from .elementary import test_edge_edge, test_vertex_face
from .free_motion import CollisionFreeMotion
from .mesh_files.errors import MeshFileError
from .mesh_files.load import load_mesh
from .mesh_files.welding import weld
from .plotting import plot
from .prepared import PreparedDetection
from .proximity import Gap, Intersections, Proximity
from .results import OutputNotComputed
from .scene import Scene
from .solids import Penetration, SignedDistances, closed

__all__ = [
    "Cancelled",
    "CollisionFreeMotion",
    "Contacts",
    "Contour",
    "Detector",
    "DeviceArray",
    "DeviceContacts",
    "DeviceDistances",
    "DeviceIntersections",
    "DeviceProximity",
    "EnclosedRegion",
    "Gap",
    "Intersections",
    "InvalidArgument",
    "MeshFileError",
    "OutputNotComputed",
    "Penetration",
    "PreparedDetection",
    "Proximity",
    "Scene",
    "SignedDistances",
    "__version__",
    "backends",
    "closed",
    "gpu_status",
    "load_mesh",
    "plot",
    "shapes",
    "test_edge_edge",
    "test_vertex_face",
    "weld",
]

_warn_of_several()
