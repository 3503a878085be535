# SPDX-License-Identifier: Apache-2.0
"""Steps whose positions lie on the GPU, as a simulator there would hand them over."""

from __future__ import annotations

import dataclasses

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.sources import Step


class _Torch:
    def __init__(self):
        import torch

        self._torch = torch

    def array(self, xyz: np.ndarray):
        """A copy on the device, complete when this returns."""
        copy = self._torch.from_numpy(np.ascontiguousarray(xyz)).cuda()
        self._torch.cuda.synchronize()
        return copy

    def stream(self):
        """One of its own, as simulators have."""
        return self._torch.cuda.Stream()

    def graph(self, enqueue, stream):
        """What enqueue(stream) puts there, as a graph: a function that runs it and waits for its end."""
        graph = self._torch.cuda.CUDAGraph()
        with self._torch.cuda.graph(graph, stream=stream):
            enqueue(stream)

        def run():
            with self._torch.cuda.stream(stream):
                graph.replay()
            stream.synchronize()

        return run


class _Cupy:
    def __init__(self):
        import cupy

        self._cupy = cupy

    def array(self, xyz: np.ndarray):
        copy = self._cupy.asarray(xyz)
        self._cupy.cuda.Device().synchronize()
        return copy

    def stream(self):
        return self._cupy.cuda.Stream(non_blocking=True)

    def graph(self, enqueue, stream):
        with stream:
            stream.begin_capture()
            enqueue(stream)
            graph = stream.end_capture()

        def run():
            graph.launch(stream)
            stream.synchronize()

        return run


def library(option: str = "--arrays device"):
    """Whichever library of arrays is installed. option: that needs one."""
    for kind in (_Torch, _Cupy):
        try:
            return kind()
        except ImportError:
            continue
    raise UserError(f"{option}: neither torch nor cupy is installed; install the one for this machine's CUDA")


def to_device(step: Step) -> Step:
    """The same step with arrays on the device."""
    arrays = library()
    moved = {name: arrays.array(getattr(step, name)) for name in ("vertices_t0", "vertices_t1")}
    return dataclasses.replace(step, **moved)
