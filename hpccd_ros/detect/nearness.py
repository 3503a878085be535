# SPDX-License-Identifier: Apache-2.0
"""Whether different meshes come near each other on a step: yes or no. No ROS, no threads of its own."""

from dataclasses import replace

from hpccd_core.options import FEATURES
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import SceneFrame


class Nearness:
    """Asks for any one pair of features that comes within a distance at some time of the step, its end included: exact,
    whatever the tier of the contacts, and of whole surfaces, whatever features are tested. So nothing is listed, and
    nothing compared; what is only passed through counts too. A scene and a detector of its own: pairs within a mesh,
    whose neighbouring features are as near as its edges are short, must not count here.
    """

    def __init__(self, builder: SceneBuilder, options: Options, distance: float) -> None:
        self._detector = StepDetector(builder.between_meshes, _asking(options, distance))
        self._static = [number for number, mesh in enumerate(builder.meshes) if mesh.static]
        self._apart: SceneFrame | None = None  # no edge pierces a face there

    def set(self, options: Options, distance: float) -> None:
        """From any thread: the next step has it."""
        self._detector.options = _asking(options, distance)

    def cancel(self) -> None:
        """From any thread, for good: `within` raises hc.Cancelled."""
        self._detector.cancel()

    def within(self, start: SceneFrame, end: SceneFrame) -> tuple[bool, float]:
        """(whether a pair came within the distance, that distance). Raises what the core raises."""
        # What is called static may have been put elsewhere, by no motion.
        stays = all(start.vertices[mesh] is end.vertices[mesh] for mesh in self._static)
        apart, self._apart = stays and self._apart is start, None
        found = self._detector.detect(start, end)
        near = len(found.contacts) > 0
        # An edge in the middle of a large face may be far from its border and corners: such meshes are 0 apart, and no
        # pair of features is near. They get there only by a contact. So it is asked where a step does not begin apart.
        if not near and not apart:
            near = self._detector.intersect(end)
        if not near:
            self._apart = end
        return near, found.options.separation.minimum


def _asking(options: Options, distance: float) -> Options:
    return replace(
        options,
        accuracy="exact",
        report="any",
        outputs=(),
        separation=Separation(distance),
        distances=False,
        features=FEATURES,
    )
