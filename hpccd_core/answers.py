# SPDX-License-Identifier: Apache-2.0
"""Which classes answer, those of the host or those of the device: for type checkers and editors."""

from typing import TYPE_CHECKING, TypedDict

from .contacts import Contacts
from .options import Accuracy, Backend, Feature, Method, Output, Report, Simd
from .proximity import Intersections, Proximity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from typing_extensions import TypeVar  # with a default, so that `Detector` alone means that of the host
else:
    from typing import TypeVar as _TypeVar

    def TypeVar(name, default):
        return _TypeVar(name)


OfMotion = TypeVar("OfMotion", default=Contacts)
OfNear = TypeVar("OfNear", default=Proximity)
OfPierced = TypeVar("OfPierced", default=Intersections)


class Options(TypedDict, total=False):
    """What a detector takes wherever its results are."""

    accuracy: Accuracy
    backend: Backend
    threads: int
    report: Report
    outputs: "Output | Iterable[Output]"
    simd: Simd
    minimum_separation: float
    tolerance: float
    method: Method
    restructure: bool
    hybrid_segments: int
    hybrid_segment_pairs: int
    gpus: int
    features: "Feature | Iterable[Feature]"
    worlds: int | None
