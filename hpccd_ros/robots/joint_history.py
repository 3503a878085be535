# SPDX-License-Identifier: Apache-2.0
"""Joint states over time: the values of all joints of a robot at a stamp between two of them.

The rules are those of transforms: the last ten seconds of each joint, interpolation, no extrapolation, and no samples
from before a clock was set back (frames/samples.py). Bounded: only joints that the robot needs are stored.
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple

from hpccd_ros.base.quoting import counted, listed, quoted
from hpccd_ros.frames.samples import Run, Samples
from hpccd_ros.frames.types import ALWAYS, UNKNOWN_TIME
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.joint_publishers import JointPublishers
from hpccd_ros.robots.kinematics import Kinematics

# Most joints that a text names.
MOST_NAMED = 3


class NoJointStateError(LookupError):
    """There are no values; ``final``: none can arrive for this stamp."""

    def __init__(self, text: str, final: bool) -> None:
        super().__init__(text)
        self.final = final


def check_lengths(names: Sequence[str], positions: Sequence[float]) -> None:
    """Raises RobotError if the message is malformed. A joint state without positions has only velocities or efforts."""
    if len(positions) not in (0, len(names)):
        raise RobotError(
            f"joint states: {counted(len(names), 'name')} and {counted(len(positions), 'position')}; give one "
            "position for each name"
        )
    if len(set(names)) < len(names):
        twice = next(name for at, name in enumerate(names) if name in names[:at])
        raise RobotError(f"joint states: {quoted(twice)} is named twice; name each joint once in a message")


class Added(NamedTuple):
    """The result of adding a joint state. ``stray``: the stamp of an earlier one that was far ahead and was removed.
    ``unusable``: why positions of needed joints were ignored; "": none was. ``contradiction``: how it contradicts
    another publisher; "": it does not."""

    stray: int | None = None
    unusable: str = ""
    contradiction: str = ""


class JointHistory:
    """A message may have only some of the joints, and several publishers may share a robot."""

    def __init__(self, kinematics: Kinematics) -> None:
        self._joints = {name: _Values(name in kinematics.continuous) for name in kinematics.inputs}
        self._named: Sequence[str] = ()  # joints of the last message
        self._addressed = False  # whether a message named a joint that the robot needs
        self._unusable: dict[str, str] = {}  # joints whose last message had no usable position, and why
        self._last: dict[str, int] = {}  # stamp of the last usable position of each joint, even if forgotten
        self._publishers = JointPublishers(kinematics.continuous)
        self._run = Run(self._joints.values)

    def add(
        self,
        stamp: int,
        names: Sequence[str],
        positions: Sequence[float],
        sent: int = UNKNOWN_TIME,
        publisher: int | None = None,
    ) -> Added:
        """Add a joint state. stamp ns. sent: when the message was sent. publisher: its number; None: there is only one.

        Joints that the robot does not need, and positions that are not finite, are ignored; the others of the message
        are used. Raises RobotError if the message is malformed; then none of it is used."""
        check_lengths(names, positions)
        self._named = names
        self._addressed = self._addressed or not self._joints.keys().isdisjoint(names)
        if names and not positions:
            self._unusable |= {name: _not_given(name, stamp) for name in names if name in self._joints}
            return Added()
        found, left_out = [], []
        for name, position in zip(names, positions, strict=True):
            if name not in self._joints:
                continue
            if math.isfinite(value := float(position)):
                found.append((name, value))
                self._last[name] = stamp
                if self._unusable:
                    self._unusable.pop(name, None)
            else:
                self._unusable[name] = f"{quoted(name)} is {value} in the joint state of {stamp} ns"
                left_out.append(name)
        contradiction = "" if publisher is None else self._publishers.contradiction(publisher, stamp, found)
        stray = self._run.add(stamp, [(self._joints[name], value) for name, value in found], sent)
        if not left_out:
            return Added(stray, "", contradiction)
        why = "; ".join(self._unusable[name] for name in left_out[:MOST_NAMED])
        more = f" and {len(left_out) - MOST_NAMED} more" if len(left_out) > MOST_NAMED else ""
        unusable = f"{why}{more}; positions must be finite; the other joints of the message are used"
        return Added(stray, unusable, contradiction)

    @property
    def misnamed(self) -> bool:
        """Whether messages came and none named a joint that the robot needs."""
        return bool(self._named) and not self._addressed

    def clear(self) -> None:
        self._joints = {name: values.emptied() for name, values in self._joints.items()}
        self._run = Run(self._joints.values)

    @property
    def begun(self) -> int:
        """How often their time went back, so that all were discarded."""
        return self._run.begun

    def forget_future(self, stamp: int) -> None:
        """A mesh restarts at ``stamp``: discard values beyond it, except those that have restarted too."""
        self._run.forget_future(stamp)

    def at(self, stamp: int) -> dict[str, float]:
        """A value of each joint that the robot needs. Raises NoJointStateError."""
        self._check_received()
        early = [name for name, values in self._joints.items() if stamp < values.stamps[0]]
        if early:
            first = max(self._joints[name].stamps[0] for name in early)
            raise NoJointStateError(
                f"the oldest stored position of {listed(early)} is from {first} ns, after the stamp {stamp} ns",
                final=True,
            )
        late = [name for name, values in self._joints.items() if stamp > values.stamps[-1]]
        if late:
            last = min(self._joints[name].stamps[-1] for name in late)
            text = f"the last position of {listed(late)} is from {last} ns, before the stamp {stamp} ns"
            text = text if last else f"{text}; its publisher must set header.stamp"
            raise NoJointStateError("; ".join([text, *self._reasons(late)]), final=False)
        if doubtful := [name for name, values in self._joints.items() if values.in_doubt(stamp)]:
            last = self._joints[doubtful[0]].stamps[-1]
            text = f"the last position of {listed(doubtful)} is from {last} ns, far ahead of the stamp {stamp} ns"
            raise NoJointStateError(
                f"{text} and all earlier ones; the next one decides whether it is valid", final=False
            )
        return {name: values.at(stamp) for name, values in self._joints.items()}

    def sent_at(self, stamp: int) -> int:
        """When the oldest message used for the values `at` this stamp was sent; ALWAYS: no joint moves."""
        return min((values.sent_at(stamp) for values in self._joints.values()), default=ALWAYS)

    def latest(self) -> int | None:
        """The last stamp, ns, at which `at` has values; None: no joint moves. Raises NoJointStateError: some have
        none."""
        self._check_received()
        return min((values.stamps[-1] for values in self._joints.values()), default=None)

    def _check_received(self) -> None:
        lacking = [name for name, values in self._joints.items() if not values.stamps]
        if not lacking:
            return
        reasons = self._reasons(lacking)
        known = [name for name in lacking if name in self._last and name not in self._unusable]
        if known:
            last = max(self._last[name] for name in known)
            reasons.append(f"the last position of {listed(known)}, at {last} ns, is from before the clock was set back")
        if never := [name for name in lacking if name not in self._last and name not in self._unusable]:
            named = f"; the last one names {listed(self._named)}" if self._named else ""
            reasons.append(f"no joint state so far names {listed(never)}{named}")
        raise NoJointStateError("; ".join(reasons), final=False)

    def _reasons(self, names: Sequence[str]) -> list[str]:
        """Why the last message about these joints was unusable, for the first few of them."""
        return [self._unusable[name] for name in names if name in self._unusable][:MOST_NAMED]


def _not_given(name: str, stamp: int) -> str:
    return f"{quoted(name)} has no position in the joint state of {stamp} ns"


class _Values(Samples[float]):
    """Samples of one joint."""

    def __init__(self, continuous: bool) -> None:
        super().__init__()
        self._continuous = continuous

    def emptied(self) -> "_Values":
        return _Values(self._continuous)

    def at(self, stamp: int) -> float:
        """stamp: between the first and the last."""
        at = bisect_left(self.stamps, stamp)
        if self.stamps[at] == stamp:
            return self.samples[at]
        before, after = self.samples[at - 1], self.samples[at]
        change = math.remainder(after - before, 2 * math.pi) if self._continuous else after - before
        return before + change * ((stamp - self.stamps[at - 1]) / (self.stamps[at] - self.stamps[at - 1]))
