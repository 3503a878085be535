# SPDX-License-Identifier: Apache-2.0
"""Steps on the GPU, as the node has them done."""

import numpy as np
import scenes

from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology


def test_a_step_tells_where_its_contacts_and_where_its_distances_were_found():
    faces, t0, t1 = scenes.crumpled(np.random.default_rng(1), 12)
    topology = Topology(0, len(t0), np.asarray(faces, np.uint32))
    start, end = (SceneFrame(k, k, "", (topology,), (t,), ("cloth",), 0.0) for k, t in enumerate((t0, t1)))
    detector = StepDetector(SceneBuilder((MeshSettings("cloth"),)), Options(backend="gpu", distances=True))
    for _ in range(2):
        found = detector.detect(start, end)
        assert (found.backend, found.gaps_backend) == ("gpu", "gpu")
