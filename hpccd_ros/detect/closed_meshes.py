# SPDX-License-Identifier: Apache-2.0
"""Which meshes are closed. No ROS, no threads."""

from collections.abc import Iterable

import hpccd_core as hc
from hpccd_ros.frames.types import Topology


class ClosedMeshes:
    """Remembers the topologies of the last call, so that only changed ones are tested."""

    def __init__(self) -> None:
        self._known: dict[Topology, bool] = {}

    def of(self, topologies: Iterable[Topology]) -> list[bool]:
        """By topology, whether it is closed; one without faces is not."""
        topologies = list(topologies)
        known = self._known
        self._known = {t: known[t] if t in known else len(t.faces) > 0 and hc.closed(t.faces) for t in topologies}
        return [self._known[t] for t in topologies]
