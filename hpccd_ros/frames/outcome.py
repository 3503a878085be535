# SPDX-License-Identifier: Apache-2.0
"""What comes of a message: values that go up to whoever handed it in. No ROS."""

from dataclasses import dataclass, field

from hpccd_ros.frames.drops import Refusal
from hpccd_ros.frames.types import SceneFrame


@dataclass(eq=False, slots=True)
class Outcome:
    """``frames`` of the scene that a message completes (usually none or one), ``refusals``: what will not be used.

    ``restarts``: in words, where the stream starts anew. ``static_taken``: accepted messages of static meshes, and
    shapes of those that move by poses. ``asked``: meshes that transforms move, of each frame that was asked of them: it
    counts as a message. ``joined``: (mesh, stamp ns, time of arrival) of frames that were accepted. ``unplaced``:
    static meshes whose positions a new topology has invalidated, and when the positions were sent.
    """

    frames: list[SceneFrame] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)
    restarts: list[str] = field(default_factory=list)
    static_taken: int = 0
    asked: list[str] = field(default_factory=list)
    joined: list[tuple[str, int, float]] = field(default_factory=list)
    unplaced: tuple[tuple[str, int], ...] = ()

    def __iadd__(self, other: "Outcome") -> "Outcome":
        self.frames += other.frames
        self.refusals += other.refusals
        self.restarts += other.restarts
        self.static_taken += other.static_taken
        self.asked += other.asked
        self.joined += other.joined
        self.unplaced += other.unplaced
        return self
