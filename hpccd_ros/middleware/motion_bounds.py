# SPDX-License-Identifier: Apache-2.0
"""How a step with meshes that move by poses was computed <-> the fields of ContactArray that tell it."""

from array import array

import numpy as np
from hpccd.msg import ContactArray

from hpccd_ros.detect.rigid_step import MotionBounds


def fill_bounds(message: ContactArray, bounds: MotionBounds) -> None:
    """Write them into ``message``."""
    message.parts = bounds.parts
    message.motion_bounds = array("d", bounds.of_meshes)


def read_bounds(message: ContactArray) -> MotionBounds:
    """Raises ValueError where the fields do not fit together."""
    bounds, meshes = np.frombuffer(message.motion_bounds, np.float64), len(message.mesh_names)
    if len(bounds) != (meshes if message.parts else 0):
        raise ValueError(f"motion_bounds has {len(bounds)} entries for {meshes} meshes and {message.parts} parts")
    if not (np.isfinite(bounds).all() and (bounds >= 0).all()):
        raise ValueError("motion_bounds holds what is no bound: they are finite and not negative")
    return MotionBounds(message.parts, tuple(bounds.tolist()))
