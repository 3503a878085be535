# SPDX-License-Identifier: Apache-2.0
"""All counters of the node, from its start to its end, and the log of rejected messages. No ROS."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

from hpccd_ros.base.quoting import counted, listed, shortened
from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.frames.drops import Input, Reason, Rejection, RejectionCounter
from hpccd_ros.frames.taken_inputs import TakenInputs
from hpccd_ros.frames.types import Outcome, SceneFrame
from hpccd_ros.node.metrics import Metrics

# Messages of no mesh: name of their count in ``connections``.
REJECTED_BESIDE_MESHES = {Input.TRANSFORM: "transforms_rejected", Input.JOINT_STATE: "joint_states_rejected"}


class Accounts:
    """``dropped``: vertex messages. ``connections``: reports of the middleware about topics (name -> count).

    ``static_taken``: accepted messages of static meshes, which count as processed. ``requests``: to ~/detect, service
    and action, by how they ended. ``inputs``: those taken since the node was configured. ``heard``: topics
    (relative names) of closed subscriptions that had a message since then. warn: logs a text.
    on_rejected: called with each rejection, in the thread that rejects. on_received: called with each input message:
    its kind, its mesh or topic, and the middleware's info about it.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self.log = RejectionLog(warn)
        self.dropped = RejectionCounter()
        self.topologies_rejected = RejectionCounter()
        self.metrics = Metrics()
        self.connections: Counter = Counter()
        self.requests = Counter(succeeded=0, rejected=0, busy=0, timed_out=0, failed=0, stopped=0, canceled=0)
        self.restarts = 0
        self.static_taken = 0
        self.heard: set[str] = set()
        self.inputs = TakenInputs()
        self.on_rejected: Callable[[Rejection], None] = lambda rejection: None
        self.on_received: Callable[[str, str, dict[str, Any]], None] = lambda kind, name, info: None

    def add(self, outcome: Outcome) -> None:
        """Count the outcome of a message except its frames, which are counted when they are computed."""
        for text in outcome.restarts:
            self.restarts += 1
            self._warn(text)
        self.static_taken += outcome.static_taken
        for mesh, sent in outcome.unplaced:
            self.on_rejected(Rejection(mesh, Reason.STATIC_MISSING, sent=sent))
        for mesh in outcome.asked:
            self.metrics.frame_received(mesh, None)
        for rejection in outcome.rejections:
            self._count(rejection)
        self.log.together(outcome.rejections)

    def rejected(self, rejection: Rejection) -> None:
        """Count it, and log its text if it has one."""
        self._count(rejection)
        self.log.together([rejection])

    def _count(self, rejection: Rejection) -> None:
        if rejection.what in REJECTED_BESIDE_MESHES:
            self.connections[REJECTED_BESIDE_MESHES[rejection.what]] += rejection.messages
        else:
            (self.topologies_rejected if rejection.what is Input.TOPOLOGY else self.dropped).count(rejection)
        self.on_rejected(rejection)

    def processed(self, found: Detection, total: int, sent: int) -> None:
        """Count a step: ``total`` contacts were found, ``sent`` of them have just been published."""
        latency_ms = 1e3 * (time.monotonic() - found.end.received)
        near = found.near
        last = {
            "accuracy": found.options.accuracy,
            "features": ", ".join(found.options.features),
            "backend": found.backend,
            "threads": found.threads,
            "contacts": total,
            "contacts_sent": sent,
            "near": near,
            "minimum_separation": found.options.separation.minimum,
            "first_toc": float(found.contacts.first_toc),
            "step": found.end.step,
            **{f"core.{name}": value for name, value in found.stats.items()},
        }
        if found.bounds.parts:
            last |= {"parts": found.bounds.parts, "motion_bound": max(found.bounds.of_meshes)}
        if found.gaps is not None:
            last["smallest_distance"] = min((gap.distance for gap in found.gaps), default=math.inf)
        times = latency_ms, found.detect_ms
        self.metrics.detected(len(found.end.fresh), *times, found.profile, last, near, _coarse(found))

    def not_processed(self, frame: SceneFrame, reason: Reason) -> None:
        """Count a frame that was passed to the detection and has no result."""
        for rejection in frame.rejected(reason):
            self.rejected(rejection)

    def failed(self, frame: SceneFrame, error: Exception) -> None:
        """Count the step that ends with ``frame`` as failed, with the reason."""
        self.metrics.failed(f"{type(error).__name__}: {error}")
        self.log("scene", Reason.DETECTION_FAILED, f"step that ends at {frame.stamp} ns: {error}")


def _coarse(found: Detection) -> str:
    """A sentence if the motion bound of a mesh exceeds the tolerance although the step has the maximum of parts."""
    bounds, rigid = found.bounds, found.options.rigid
    if bounds.parts < rigid.most_parts:
        return ""
    mesh, bound = max(zip(found.layout.mesh_names, bounds.of_meshes, strict=True), key=lambda one: one[1])
    # The bound includes rounding, which the tolerance does not.
    if bound <= 1.01 * rigid.tolerance:
        return ""
    return f"{mesh} was up to {bound:.3g} beside the straight lines of {counted(bounds.parts, 'part')}"


# Texts quote untrusted names (of frames, of fields), which may be of any length.
_LONGEST = 500


class RejectionLog:
    """Passes on the first text of each (mesh, reason), then one every ``period`` s; links of a robot count as one
    mesh."""

    def __init__(
        self, warn: Callable[[str], None], period: float = 10.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._warn = warn
        self._period = period
        self._clock = clock
        self._silent: dict[tuple[str, Reason], tuple[float, int]] = {}
        self.last = ""

    def __call__(self, mesh: str, reason: Reason, text: str) -> None:
        self._log(mesh, mesh, reason, shortened(text, _LONGEST))

    def together(self, rejections: Iterable[Rejection]) -> None:
        """Those that have a text. One text stands for all links of a robot that were rejected for the same reason."""
        alike: dict[tuple[str, Reason], list[Rejection]] = {}
        for rejection in rejections:
            if rejection.text and (robot := _robot(rejection)):
                alike.setdefault((robot, rejection.reason), []).append(rejection)
            elif rejection.text:
                self(rejection.mesh, rejection.reason, rejection.text)
        for (robot, reason), (first, *others) in alike.items():
            names = dict.fromkeys(other.mesh for other in others if other.mesh != first.mesh)
            more = f"; as well {listed(names)}" if names else ""
            self._log(robot, first.mesh, reason, shortened(first.text, _LONGEST) + more)

    def _log(self, whose: str, mesh: str, reason: Reason, text: str) -> None:
        self.last = f"{mesh}: {reason}: {text}"
        now = self._clock()
        since, count = self._silent.get((whose, reason), (-float("inf"), 0))
        if now - since < self._period:
            self._silent[whose, reason] = since, count + 1
            return
        self._silent[whose, reason] = now, 0
        self._warn(self.last + (f" ({count} more of these in between)" if count else ""))


def _robot(rejection: Rejection) -> str:
    """The robot of which the mesh is a link; "": none."""
    robot, slash, _ = rejection.mesh.partition("/")
    return robot if slash and rejection.what is Input.VERTICES else ""
