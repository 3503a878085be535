# SPDX-License-Identifier: Apache-2.0
"""Steps whose positions lie on the GPU, as a simulator there would hand them over."""

from __future__ import annotations

import dataclasses
import importlib

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.steps import Step

LIBRARIES = ("cupy", "torch")


def to_device(step: Step) -> Step:
    """The same step with arrays of whichever library is installed."""
    for name in LIBRARIES:
        try:
            library = importlib.import_module(name)
        except ImportError:
            continue
        move = library.asarray if name == "cupy" else lambda xyz: library.from_numpy(np.ascontiguousarray(xyz)).cuda()
        return dataclasses.replace(step, vertices_t0=move(step.vertices_t0), vertices_t1=move(step.vertices_t1))
    raise UserError("--arrays device: neither cupy nor torch is installed; install the one for this machine's CUDA")
