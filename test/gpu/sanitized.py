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

for make in (scenes.crumpled, scenes.lattice, scenes.soup):
    rng = np.random.default_rng(2)
    scene, t0, t1 = scenes.join([make(rng, 10), make(rng, 10)])
    scene.set_separation(0, 1, 0.1)
    scene.set_separation(1, 1, 0.0)
    detectors = {b: hc.Detector(scene, backend=b, threads=2, minimum_separation=0.05) for b in ("cpu", "gpu", "hybrid")}
    for query in (
        lambda d, t0=t0, t1=t1: d.detect(t0, t1),
        lambda d, t1=t1: d.proximity(t1, 0.1),
        lambda d, t1=t1: d.proximity(t1.astype(np.float32), 0.1),
        lambda d, t1=t1: d.intersections(t1),
    ):
        answers = {backend: query(detector) for backend, detector in detectors.items()}
        print(make.__name__, answers)
        if len({answer.hash for answer in answers.values()}) > 1:
            sys.exit(f"{make.__name__}: answers differ")
    for backend in ("gpu", "hybrid"):
        if detectors[backend].stats["gpu_fallbacks"]:
            sys.exit(f"{make.__name__}, {backend}: {detectors[backend].last_gpu_error}")
