# SPDX-License-Identifier: Apache-2.0
"""Ways to compute the same step, and which of them this build and this machine know."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

import hpccd_core as hc
from hpccd_core import options
from hpccd_ros.bench.sources import Step

# All but "auto", which chooses one of these.
BACKENDS = tuple(name for name in options.BACKENDS if name != "auto")


@dataclasses.dataclass(frozen=True)
class Variant:
    """A detector's options under a name, and what is done to each step before it sees it."""

    name: str
    options: dict = dataclasses.field(default_factory=dict)
    change: Callable[[Step], Step] | None = None
    scene: Callable[[hc.Scene], None] | None = None  # further settings of the core's scene

    def detector(self, step: Step) -> hc.Detector:
        scene = step.scene()
        if self.scene:
            self.scene(scene)
        return hc.Detector(scene, **self.options)


def why_unusable(**options) -> str | None:
    """Why a detector with these options cannot be had here, in the core's words; None where it can."""
    scene = hc.Scene()
    scene.add_mesh("a", np.array([[0, 1, 2]], np.uint32))
    scene.add_mesh("b", np.array([[0, 1, 2]], np.uint32))
    xyz = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], np.float32)
    try:
        # Some refuse only when they are asked to work: a device that is listed but gone, a tier of one backend.
        hc.Detector(scene, **options).detect(xyz, xyz)
    except (ValueError, TypeError, RuntimeError, NotImplementedError) as error:
        return f"{type(error).__name__}: {error}"
    return None


def usable(name: str, values, **others) -> tuple[list, dict[str, str]]:
    """Those `values` of the option `name` that work here, and {value: reason} of the others."""
    refused = {value: why_unusable(**{name: value}, **others) for value in values}
    return [v for v in values if refused[v] is None], {v: why for v, why in refused.items() if why is not None}
