# SPDX-License-Identifier: Apache-2.0
"""Types of results, on the host or on the device, of one world or of several: for type checkers and editors."""

from typing import TYPE_CHECKING, TypedDict

from .contacts import Contacts
from .options import Accuracy, Backend, Feature, Method, Output, Refine, Report, Simd
from .proximity import Gap, Intersections, Proximity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from typing_extensions import TypeVar  # with a default, so that `Detector` alone means that of the host

    from .array_types import Detail
else:
    from typing import TypeVar as _TypeVar

    def TypeVar(name, default):
        return _TypeVar(name)


MotionResult = TypeVar("MotionResult", default=Contacts)
ProximityResult = TypeVar("ProximityResult", default=Proximity)
IntersectionsResult = TypeVar("IntersectionsResult", default=Intersections)
# list[list[Gap]] and an array where there are worlds.
DistancesResult = TypeVar("DistancesResult", default=list[Gap])
StepResult = TypeVar("StepResult", default=float)


class Options(TypedDict, total=False):
    """Options of every detector."""

    accuracy: Accuracy
    backend: Backend
    threads: int
    report: Report
    outputs: "Output | Iterable[Output]"
    simd: Simd
    minimum_separation: float
    method: Method
    restructure: bool
    hybrid_segments: int
    hybrid_segment_pairs: int
    gpus: int
    features: "Feature | Iterable[Feature]"
    detail: "Detail"
    refine: Refine
