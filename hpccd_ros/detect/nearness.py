# SPDX-License-Identifier: Apache-2.0
"""Whether different meshes come within a distance during a step, or lie inside each other. No ROS, no threads."""

from dataclasses import replace

import hpccd_core as hc
from hpccd_core.options import FEATURES
from hpccd_ros.detect import approach
from hpccd_ros.detect.approach import Slowdown
from hpccd_ros.detect.closed_meshes import ClosedMeshes
from hpccd_ros.detect.core import Detail, Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import SceneFrame


class Nearness:
    """Searches for any one pair of features within a distance at some time of the step, its end included. It is exact,
    whatever the tier of the contacts, and about whole surfaces, whatever features are tested. Passing through counts
    too. It has its own scene and detector, because pairs within a mesh must not count here: neighbouring features are
    as close as its edges are short. detail: meshes that are searched on coarse faces, with a proven bound: then a
    search may find a pair that is only nearly within the distance, and never misses one.
    """

    def __init__(self, builder: SceneBuilder, options: Options, distance: float, detail: Detail = ()) -> None:
        self._detail = detail
        self._detector = StepDetector(builder.between_meshes, _asking(options, distance, detail))
        # Of snapshots, which are not offered on coarse faces.
        self._full = StepDetector(builder.between_meshes, _asking(options, distance)) if detail else self._detector
        self._names = builder.names
        self._tested = {name for pair in builder.pairs for name in pair}
        self._static = [number for number, mesh in enumerate(builder.meshes) if mesh.static]
        self._closed = ClosedMeshes()
        self._apart: SceneFrame | None = None  # no edge intersects a face there
        self._outside: SceneFrame | None = None  # no mesh lies inside another there
        self._last_gaps: tuple[SceneFrame, list[hc.Gap]] | None = None

    def set(self, options: Options, distance: float) -> None:
        """Set the distance of the next step. May be called from any thread."""
        self._detector.options = _asking(options, distance, self._detail)
        if self._detail:
            self._full.options = _asking(options, distance)

    def cancel(self) -> None:
        """Permanently: `within` raises hc.Cancelled. May be called from any thread."""
        self._detector.cancel()
        self._full.cancel()

    def within(self, start: SceneFrame, end: SceneFrame) -> tuple[tuple[str, str] | None, float]:
        """(the names of two meshes that came within the distance, that distance); None: none did. Of several pairs of
        meshes any one. Raises the core's errors."""
        apart, self._apart = self._stays(start, end) and self._apart is start, None
        found = self._detector.detect(start, end)
        near = self._meshes(found.contacts)
        # An edge through the middle of a large face may be far from its border and corners: the meshes intersect, and
        # no pair of features is within the distance. They get there only by a contact, so starts are tested.
        if near is None and not apart:
            near = self._meshes(self._full.intersect(end))
        if near is None:
            self._apart = end
        return near, found.options.separation.minimum

    def inside(self, start: SceneFrame, end: SceneFrame) -> tuple[str, str] | None:
        """(the name of a mesh, that of the closed one inside which it lies at the end) after a step in which `within`
        found none; None: there is none. Raises the core's errors."""
        # A mesh that gets inside meets the other's surface on its way, so only starts are tested.
        outside, self._outside = self._stays(start, end) and self._outside is start, None
        if not outside:
            for gap in self._gaps(end):
                if gap.inside:
                    return (gap.mesh_b, gap.mesh_a) if gap.inside == "b" else (gap.mesh_a, gap.mesh_b)
        self._outside = end
        return None

    def not_closed(self, frame: SceneFrame) -> list[str]:
        """Names of the meshes with faces that are not closed: what lies inside them is unknown."""
        named = zip(self._names, frame.topologies, strict=False)  # planes have none
        tested = {name: topology for name, topology in named if name in self._tested and len(topology.faces)}
        return [name for name, closed in zip(tested, self._closed.of(tested.values()), strict=True) if not closed]

    def _stays(self, start: SceneFrame, end: SceneFrame) -> bool:
        """Whether no static mesh was placed elsewhere, without a motion."""
        return all(start.vertices[mesh] is end.vertices[mesh] for mesh in self._static)

    def slowdown(self, start: SceneFrame, end: SceneFrame, distance: float, time: float) -> Slowdown:
        """How far to slow down after a step that came nowhere within ``distance``. time: s in which meshes may come
        that near at full speed. Raises the core's errors."""
        last = self._last_gaps
        before = last[1] if last is not None and last[0] is start else self._full.distances(start)
        gaps = self._gaps(end)
        moved = self._full.approached(start, end, gaps)
        speeds = approach.closing_speeds(before, gaps, moved, 1e-9 * (end.stamp - start.stamp))
        return approach.slowdown(gaps, speeds, distance, time)

    def _gaps(self, frame: SceneFrame) -> list[hc.Gap]:
        """Computed once for the same frame."""
        if self._last_gaps is None or self._last_gaps[0] is not frame:
            self._last_gaps = frame, self._full.distances(frame)
        return self._last_gaps[1]

    def _meshes(self, pairs: hc.Contacts | hc.Intersections) -> tuple[str, str] | None:
        """The names of the meshes of the first pair."""
        if not len(pairs):
            return None
        a, b = sorted((int(pairs.mesh_a[0]), int(pairs.mesh_b[0])))
        return self._names[a], self._names[b]


def _asking(options: Options, distance: float, detail: Detail = ()) -> Options:
    return replace(
        options,
        accuracy="exact",
        report="any",
        outputs=(),
        separation=Separation(distance),
        distances=False,
        features=FEATURES,
        detail=detail,
    )
