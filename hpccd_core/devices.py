# SPDX-License-Identifier: Apache-2.0
"""Backends and GPUs that this build can use on this machine."""

from __future__ import annotations

from typing import TypedDict

from . import _core


class GpuDevice(TypedDict):
    """A GPU: its CUDA `number`, compute capability `major`.`minor`, and `memory` in bytes."""

    name: str
    number: int
    major: int
    minor: int
    multiprocessors: int
    memory: int


class GpuStatus(TypedDict):
    """GPU support of a build and machine.

    Attributes
    ----------
    compiled : bool
        Whether this build has GPU code.
    toolkit : str
        CUDA version and architectures of the build.
    devices : list of GpuDevice
        Usable devices.
    reason : str
        Why there are none; empty if there are.
    """

    compiled: bool
    toolkit: str
    devices: list[GpuDevice]
    reason: str


def backends() -> list[str]:
    """The backends that this build can use on this machine.

    Returns
    -------
    list of str
        ["cpu"], or ["cpu", "gpu", "hybrid"] with a usable GPU.

    Examples
    --------
    >>> import hpccd_core as hc
    >>> "cpu" in hc.backends()
    True
    """
    return ["cpu", "gpu", "hybrid"] if gpu_status()["devices"] else ["cpu"]


def gpu_status() -> GpuStatus:
    """Return the GPU support of this build and machine, and why a GPU is not usable.

    Returns
    -------
    dict
        "compiled" (bool), "toolkit" (str), "devices" (list of dict) and "reason" (str), see :class:`GpuStatus`.
    """
    return _core.gpu_status()
