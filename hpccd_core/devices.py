# SPDX-License-Identifier: Apache-2.0
"""Where this build on this machine can compute."""

from typing import TypedDict

from . import _core


class GpuDevice(TypedDict):
    """number: of the device in CUDA. major, minor: its compute capability. memory: bytes."""

    name: str
    number: int
    major: int
    minor: int
    multiprocessors: int
    memory: int


class GpuStatus(TypedDict):
    """compiled: whether this build has GPU code. toolkit: CUDA version and architectures. reason: why there are no
    devices; empty where there are."""

    compiled: bool
    toolkit: str
    devices: list[GpuDevice]
    reason: str


def backends() -> list[str]:
    """The backends usable with this build on this machine, e.g. ["cpu"] or ["cpu", "gpu", "hybrid"]."""
    return ["cpu", "gpu", "hybrid"] if gpu_status()["devices"] else ["cpu"]


def gpu_status() -> GpuStatus:
    """What this build and machine can do with GPUs: dict with "compiled" (bool), "toolkit" (str: CUDA version and
    architectures), "devices" (list of dicts: name, number, major, minor, multiprocessors, memory in bytes) and "reason"
    (str: why there are none; empty where there are)."""
    return _core.gpu_status()
