# SPDX-License-Identifier: Apache-2.0
"""Meshes without frames of their own: joint states that move all of them at once are looked up at stamps of other
meshes. No ROS.

Transforms, which move each mesh separately, are handled by the pipeline.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.types import MeshFrame


class Followed(NamedTuple):
    """``times``: for each stamp that continues now, (mesh, frame in the scene's frame, whether a new publisher)."""

    rejections: list[Rejection]
    times: list[list[tuple[str, MeshFrame, bool]]]


class Follower(Protocol):
    """``names``: of the meshes, in the order of the scene. ``waiting``: requested frames that are not known yet.
    ``begun``: how often time went back, so that all samples were discarded."""

    @property
    def names(self) -> Sequence[str]: ...

    @property
    def waiting(self) -> int: ...

    @property
    def begun(self) -> int: ...

    def ask(self, stamp: int, received: float, new_publisher: bool) -> None:
        """Request a frame of each mesh at ``stamp`` ns; `retry` returns it."""

    def retry(self, transforms: TransformBuffer) -> Followed:
        """Requested frames that are known now."""

    def latest(self, transforms: TransformBuffer) -> list[int | None]:
        """The last stamp at which the meshes can be placed; None: at any time. Raises NoTransformError if something has
        never arrived."""

    def clear(self, reason: Reason) -> list[Rejection]:
        """Drop waiting frames, for ``reason``."""

    def forget_future(self, stamp: int) -> None:
        """Discard samples far beyond ``stamp``, at which a new run begins."""

    def forget(self) -> None:
        """Discard all samples."""

    def warnings(self) -> list[str]:
        """Reasons for which requested frames wait."""
