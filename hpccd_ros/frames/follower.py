# SPDX-License-Identifier: Apache-2.0
"""Meshes of which nobody sends frames: what moves all of them at once is looked up at stamps that others give. No ROS.

Transforms, which move each mesh alone, are the pipeline's own matter.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from hpccd_ros.frames.drops import Reason, Refusal
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.types import MeshFrame


class Followed(NamedTuple):
    """``times``: for each stamp that goes on now, (mesh, frame in the scene's frame, whether a new publisher)."""

    refusals: list[Refusal]
    times: list[list[tuple[str, MeshFrame, bool]]]


class Follower(Protocol):
    """``names``: of the meshes, in the order of the scene. ``waiting``: their frames asked for and not known yet.
    ``begun``: how often the time of what moves them went back, and all that was known of it began anew."""

    @property
    def names(self) -> Sequence[str]: ...

    @property
    def waiting(self) -> int: ...

    @property
    def begun(self) -> int: ...

    def ask(self, stamp: int, received: float, new_publisher: bool) -> None:
        """A frame of each mesh at ``stamp`` ns; `retry` tells what comes of it."""

    def retry(self, transforms: TransformBuffer) -> Followed:
        """What is known now of the frames asked for."""

    def latest(self, transforms: TransformBuffer) -> list[int | None]:
        """Stamps up to which is known what moves the meshes; None: it is bound to no time. Raises NoTransformError:
        something has not come at all."""

    def clear(self, reason: Reason) -> list[Refusal]:
        """Drop what waits, for ``reason``."""

    def forget_future(self, stamp: int) -> None:
        """The time is ``stamp`` again: what is known of times far beyond it is from before."""

    def forget(self) -> None:
        """All that is known of any time."""

    def warnings(self) -> list[str]:
        """What the frames asked for wait for."""
