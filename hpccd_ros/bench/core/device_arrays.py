# SPDX-License-Identifier: Apache-2.0
"""Steps whose positions lie on the GPU, as a simulator there would hand them over."""

from __future__ import annotations

import dataclasses

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.steps import Step


def _with_torch(xyz):
    import torch

    return torch.from_numpy(np.ascontiguousarray(xyz)).cuda()


def _with_cupy(xyz):
    import cupy

    return cupy.asarray(xyz)


def to_device(step: Step) -> Step:
    """The same step with arrays of whichever library is installed."""
    for move in (_with_torch, _with_cupy):
        try:
            moved = {name: move(getattr(step, name)) for name in ("vertices_t0", "vertices_t1")}
        except ImportError:
            continue
        return dataclasses.replace(step, **moved)
    raise UserError("--arrays device: neither torch nor cupy is installed; install the one for this machine's CUDA")
