# SPDX-License-Identifier: Apache-2.0
"""Joint states over time: the values of all joints of a robot at a stamp between two of them.

Its rules are those of transforms: the last ten seconds of each joint, interpolation, no extrapolation, and nothing
from before where a clock is set back (frames/samples.py). Bounded: only joints that the robot needs are kept.
"""

import math
from bisect import bisect_left
from collections.abc import Sequence

from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.frames.samples import Run, Samples
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.kinematics import Kinematics


class NoJointStateError(LookupError):
    """There are no values; ``final``: none will come for this stamp either."""

    def __init__(self, text: str, final: bool) -> None:
        super().__init__(text)
        self.final = final


def check_lengths(names: Sequence[str], positions: Sequence[float]) -> None:
    """Raises RobotError: a joint state that no robot can use."""
    if len(names) != len(positions):
        raise RobotError(
            f"joint states: {len(names)} names and {len(positions)} positions; each joint needs one of both"
        )


class JointHistory:
    """Each message may tell of some joints only; several publishers may share a robot."""

    def __init__(self, kinematics: Kinematics) -> None:
        self._joints = {name: _Values(name in kinematics.continuous) for name in kinematics.inputs}
        self._told = ""  # joints of the last message
        self._run = Run(self._joints.values)

    def add(self, stamp: int, names: Sequence[str], positions: Sequence[float]) -> int | None:
        """stamp ns. Joints of others are left out. The stamp of an earlier one that was far ahead, and is forgotten.
        Raises RobotError, and then nothing of it is kept."""
        check_lengths(names, positions)
        known = [(name, float(value)) for name, value in zip(names, positions, strict=True) if name in self._joints]
        for name, value in known:
            if not math.isfinite(value):
                raise RobotError(f"joint states: {quoted(name)} is at {value}; positions must be finite")
        self._told = listed(names)
        return self._run.add(stamp, [(self._joints[name], value) for name, value in known])

    def clear(self) -> None:
        self._joints = {name: values.emptied() for name, values in self._joints.items()}
        self._run = Run(self._joints.values)

    @property
    def begun(self) -> int:
        """How often their time went back, and all began anew."""
        return self._run.begun

    def forget_future(self, stamp: int) -> None:
        """A mesh begins anew with ``stamp``: values beyond it are from before, but those that have begun anew too."""
        self._run.forget_future(stamp)

    def at(self, stamp: int) -> dict[str, float]:
        """A value of each joint that the robot needs. Raises NoJointStateError."""
        self._check_heard()
        early = [name for name, values in self._joints.items() if stamp < values.stamps[0]]
        if early:
            first = max(self._joints[name].stamps[0] for name in early)
            raise NoJointStateError(
                f"the first joint state kept of {listed(early)} is of {first} ns, after the stamp {stamp} ns",
                final=True,
            )
        late = [name for name, values in self._joints.items() if stamp > values.stamps[-1]]
        if late:
            last = min(self._joints[name].stamps[-1] for name in late)
            text = f"the last joint state of {listed(late)} is of {last} ns, before the stamp {stamp} ns"
            raise NoJointStateError(text if last else f"{text}; its publisher must set header.stamp", final=False)
        if doubtful := [name for name, values in self._joints.items() if values.in_doubt(stamp)]:
            last = self._joints[doubtful[0]].stamps[-1]
            text = f"the last joint state of {listed(doubtful)} is of {last} ns, far ahead of the stamp {stamp} ns"
            raise NoJointStateError(f"{text} and of all before: the next one tells whether it counts", final=False)
        return {name: values.at(stamp) for name, values in self._joints.items()}

    def latest(self) -> int | None:
        """The last stamp, ns, that `at` knows; None: no joint moves. Raises NoJointStateError: of some nothing came."""
        self._check_heard()
        return min((values.stamps[-1] for values in self._joints.values()), default=None)

    def _check_heard(self) -> None:
        if unheard := [name for name, values in self._joints.items() if not values.stamps]:
            heard = f"; the last one that came tells of {self._told}" if self._told else ""
            raise NoJointStateError(f"no joint state has told of {listed(unheard)}{heard}", final=False)


class _Values(Samples[float]):
    """Of one joint."""

    def __init__(self, continuous: bool) -> None:
        super().__init__()
        self._continuous = continuous

    def emptied(self) -> "_Values":
        return _Values(self._continuous)

    def at(self, stamp: int) -> float:
        """Between the first and the last."""
        at = bisect_left(self.stamps, stamp)
        if self.stamps[at] == stamp:
            return self.samples[at]
        before, after = self.samples[at - 1], self.samples[at]
        change = math.remainder(after - before, 2 * math.pi) if self._continuous else after - before
        return before + change * ((stamp - self.stamps[at - 1]) / (self.stamps[at] - self.stamps[at - 1]))
