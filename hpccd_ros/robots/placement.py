# SPDX-License-Identifier: Apache-2.0
"""Placement of a link by the joint values of its robot, so that steps follow joints instead of screws."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.joints import LinkMotion
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.frames.types import Placement
from hpccd_ros.robots.kinematics import RobotState, RobotStep


@dataclass(frozen=True, eq=False)
class LinkPlacement(Placement):
    """``state``: of the whole robot, one object for all its links at a time; ``pose`` is that of ``link`` in it.
    ``computed``: the vertices, if they were computed with those of the other links."""

    link: str
    state: RobotState
    computed: NDArray[np.float64] | None = None

    @classmethod
    def of(
        cls, body: Body, link: str, state: RobotState, computed: NDArray[np.float64] | None = None
    ) -> "LinkPlacement":
        return cls(body, state.poses[link], link, state, computed)

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        return self.pose.apply(self.body.vertices) if self.computed is None else self.computed

    def moved(self, rigid: Rigid) -> "LinkPlacement":
        return self.of(self.body, self.link, replace(self.state, base=rigid.after(self.state.base)))


class LinkMotions:
    """Motions of all links in one step; the links of a robot share the computation of its joints."""

    def __init__(self) -> None:
        self._steps: dict[tuple[int, int], RobotStep] = {}

    def between(self, start: Placement, end: Placement) -> LinkMotion | None:
        """None if they are not placements of the same link of the same robot."""
        if not isinstance(start, LinkPlacement) or not isinstance(end, LinkPlacement):
            return None
        before, after = start.state, end.state
        if before.kinematics is not after.kinematics or start.link != end.link or start.body is not end.body:
            return None
        key = id(before), id(after)  # both live as long as their placements do
        if key not in self._steps:
            self._steps[key] = before.kinematics.step(before, after)
        return self._steps[key].motion(end.link, end.body, (start.vertices, end.vertices))
