# SPDX-License-Identifier: Apache-2.0
"""A few small frames through every kernel, for compute-sanitizer: not a test by itself."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import scenes

import hpccd_core as hc

for accuracy in ("balanced", "exact"):
    for make in (scenes.crumpled, scenes.lattice, scenes.soup):
        for dtype in (np.float32, np.float64):
            rng = np.random.default_rng(1)
            scene, t0, t1 = scenes.join([make(rng, 14), make(rng, 14)], ignored=((0, 0),))
            t0, t1 = t0.astype(dtype), t1.astype(dtype)
            expected = hc.Detector(scene, backend="cpu", accuracy=accuracy).detect(t0, t1)
            for backend in ("gpu", "hybrid"):
                detector = hc.Detector(scene, backend=backend, accuracy=accuracy, threads=2, hybrid_segment_pairs=64)
                found = detector.detect(t0, t1)
                if found.hash != expected.hash:
                    sys.exit(f"{make.__name__}, {accuracy}, {backend}: contacts differ")
                if detector.stats["gpu_fallbacks"]:
                    sys.exit(f"{make.__name__}, {accuracy}, {backend}: {detector.last_gpu_error}")
                print(make.__name__, accuracy, dtype.__name__, backend, found)
