# SPDX-License-Identifier: Apache-2.0
"""A step in which meshes move by poses or joints, while the core has straight lines only. No ROS.

hpccd_core/rigid/__init__.py describes how such a step is computed, and why there are no false negatives. Pairs of
meshes that both move straight have a separate detector, which computes the whole step at once: cloth with itself does
not have the overhead of a robot's rotations.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import is_not

import numpy as np

import hpccd_core as hc
from hpccd_core.rigid import cuts
from hpccd_core.rigid.merged import earliest, merged
from hpccd_core.rigid.motion import Linear, Motion, ScrewMotion
from hpccd_core.rigid.screw import Screw
from hpccd_ros.detect.separation import MotionBounds, Separation
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.robots.placement import LinkMotions

# Entries of detector.stats that are not summed over calls.
OF_THE_SCENE = ("triangles", "bytes")


@dataclass(frozen=True)
class RigidOptions:
    """``tolerance``: largest deviation of the straight lines of a part from the motion of poses, in the unit of the
    scene. ``most_parts``: largest number of parts of a step. ``parts``: exact number, whatever the tolerance; 0: as few
    as it requires."""

    tolerance: float = 1e-3
    most_parts: int = 64
    parts: int = 0


def motions(
    parts: tuple[Sequence[np.ndarray], Sequence[np.ndarray]], start: SceneFrame, end: SceneFrame
) -> list[Motion]:
    """The motion of each mesh; ``parts``: its vertices at both ends. A mesh with a new shape moves straight."""
    found: list[Motion] = []
    links = LinkMotions()
    for v0, v1, p0, p1 in zip(*parts, start.placements, end.placements, strict=True):
        if p0 is None or p1 is None or p0.body is not p1.body:
            found.append(Linear(v0, v1))
        elif (by_joints := links.between(p0, p1)) is not None:
            found.append(by_joints)
        else:
            found.append(ScrewMotion(p1.body, Screw.between(p0.pose, p1.pose)))
    return found


class RigidStep:
    """Computes one step with two detectors. bent: for pairs of meshes of which one moves by poses; straight: for the
    others, None if there are none. names: of all meshes and planes.
    """

    def __init__(self, names: tuple[str, ...], bent: hc.Detector, straight: hc.Detector | None) -> None:
        self.bent, self.straight = bent, straight
        self._names = names
        self.detectors = (bent,) if straight is None else (bent, straight)
        self.profile: Counter[str] = Counter()  # ms of the last step, by stage
        self.stats: Counter[str] = Counter()  # of the last step
        self._last_end: tuple[list[np.ndarray], np.ndarray] = ([], np.empty((0, 3)))  # for each mesh, and for all

    def detect(
        self, moving: Sequence[Motion], asked: Separation, options: RigidOptions, report: str
    ) -> tuple[hc.Contacts, MotionBounds]:
        """moving: the motion of each mesh. asked: the separation that the detector of straight pairs already has.
        Raises the core's errors."""
        self.profile.clear()
        self.stats.clear()
        parts = options.parts or cuts.fewest_parts(moving, options.tolerance, options.most_parts).parts
        margins = [cuts.Margin.of(motion, parts) for motion in moving]
        margins += [cuts.Margin(0.0, 0.0)] * (len(self._names) - len(moving))  # planes
        self.bent.set_separations(cuts.all_grown(asked.table(self._names), margins))
        positions = [self._at_cut(moving, number, parts) for number in range(parts + 1)]
        whole = self._ask(self.straight, positions[0], positions[-1]) if self.straight is not None else None
        bounds = MotionBounds(parts, tuple(margin.sum for margin in margins))
        if report == "any" and whole is not None and len(whole):
            return whole, bounds
        found = []
        for start, end in pairwise(positions):
            found.append(self._ask(self.bent, start, end))
            if report != "all" and len(found[-1]):
                break  # later parts have later times only
        contacts = merged(found, parts, whole)
        if report == "first":
            contacts = earliest(contacts)
        return contacts, bounds

    def _at_cut(self, moving: Sequence[Motion], number: int, parts: int) -> np.ndarray:
        """(V,3). If a step continues the previous one, its start is the end of that one."""
        of_meshes = [motion.vertices(number, parts) for motion in moving]
        last, positions = self._last_end
        if number != 0 or len(last) != len(of_meshes) or any(map(is_not, last, of_meshes)):
            positions = np.concatenate(of_meshes)
        if number == parts:
            self._last_end = of_meshes, positions
        return positions

    def _ask(self, detector: hc.Detector, start: np.ndarray, end: np.ndarray) -> hc.Contacts:
        contacts = detector.detect(start, end)
        self.profile.update(detector.profile)
        stats, of_scene = detector.stats, {name: self.stats[name] for name in OF_THE_SCENE}
        self.stats.update(stats)
        for name, value in of_scene.items():
            self.stats[name] = max(value, stats.get(name, 0))
        return contacts
