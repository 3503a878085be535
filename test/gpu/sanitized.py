# SPDX-License-Identifier: Apache-2.0
"""A few small frames through every kernel, for compute-sanitizer: not a test by itself."""

import sys
from pathlib import Path

import cupy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import device_results
import scenes

import hpccd_core as hc

for accuracy in ("balanced", "exact"):
    for make in (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed):
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

for make in (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed):
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
        results = {backend: query(detector) for backend, detector in detectors.items()}
        print(make.__name__, results)
        if len({result.hash for result in results.values()}) > 1:
            sys.exit(f"{make.__name__}: results differ")
    for backend in ("gpu", "hybrid"):
        if detectors[backend].stats["gpu_fallbacks"]:
            sys.exit(f"{make.__name__}, {backend}: {detectors[backend].last_gpu_error}")


def query_results(detector, t0, t1):
    """What it says to everything, on the host, in small arrays that can be compared."""
    found = [detector.detect(t0, t1), detector.proximity(t0, 0.1), detector.intersections(t1)]
    hashes = [result.hash for result in found]
    on_host = [result.to_host() if hasattr(result, "to_host") else result for result in found]
    rows = [np.concatenate([a.vf_toc, a.ee_toc]) for a in on_host[:1]] + [a.vf_distance for a in on_host[1:2]]
    free = np.atleast_1d(detector.collision_free_step(t0, t1))
    return hashes, [*rows, on_host[2].ef.ravel(), on_host[0].vf_offsets, on_host[0].first_tocs, free]


def check(what, scene, t0, t1, **options):
    """Results on the host and on the device, twice: with lists that have to grow, and with those that have."""
    host = {name: value for name, value in options.items() if name != "outputs"}
    expected = query_results(hc.Detector(scene, backend="cpu", threads=1, **host), t0, t1)
    for results in ("host", "device"):
        detector = hc.Detector(scene, backend="gpu", threads=2, results=results, **options)
        for _ in range(2):
            found = query_results(detector, t0, t1)
            same = all(map(np.array_equal, found[1], expected[1]))
            if found[0] != expected[0] or not same:
                sys.exit(f"{what}, {results}, {options}: results differ")
            if detector.stats["gpu_fallbacks"]:
                sys.exit(f"{what}, {results}, {options}: {detector.last_gpu_error}")
    print(what, options, found[0])


sheet, lattice = (scenes.join([make(np.random.default_rng(3), 8)]) for make in (scenes.crumpled, scenes.lattice))
for report in ("all", "first"):
    check("sheet", *sheet, report=report)
    check("lattice", *lattice, report=report)  # by integers
    check("worlds", *device_results.garments(3, n=7), worlds=3, report=report)
check("places", *sheet, outputs=("points", "normals", "closest", "weights"))
for accuracy in ("fast", "balanced"):
    check("worlds", *device_results.garments(4, n=7), worlds=4, accuracy=accuracy)

# One feature has more pairs than are ordered by looking at all of them, in one world and in two of three.
scene, t0, t1 = device_results.needle_through_plates(2100)
for worlds in (None, 3):
    start, end = (t0, t1) if worlds is None else (np.stack([t0, t0, t1]), np.stack([t1, t0, t0]))
    expected = hc.Detector(scene, backend="cpu", worlds=worlds).detect(start, end)
    found = hc.Detector(scene, backend="gpu", worlds=worlds, results="device").detect(start, end)
    if found.hash != expected.hash:
        sys.exit(f"needle, {worlds} worlds: contacts differ")

# Detections that are prepared, on a stream of the caller's: of one world and of three, with room and without.
for worlds in (None, 3):
    scene, t0, t1 = sheet if worlds is None else device_results.garments(3, n=7)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    cupy.cuda.Device().synchronize()
    detection = hc.Detector(scene, backend="gpu", worlds=worlds, results="device").prepare(*ends, room=1)
    for part in (1, 0.5):
        ends[1].set(t0 + part * (t1 - t0))
        detection.enqueue()
        expected = hc.Detector(scene, backend="cpu", worlds=worlds).detect(t0, ends[1].get())
        if detection.contacts().hash != expected.hash:
            sys.exit(f"prepared, {worlds} worlds: contacts differ")
    ends[1].set(np.float32(30) * t1[..., ::-1, :] if worlds else 30 * t1[::-1])
    detection.enqueue()
    print("prepared", worlds, detection.counts.to_host())

# Coordinates with too many bits for the device: the CPU decides: what it finds is added on the device.
rng = np.random.default_rng(300)
faces, t0, t1 = scenes.lattice(rng, 10)
t1 = np.where(rng.random(t1.shape) < 0.2, rng.integers(-3, 4, t0.shape) * 2.0**-300, t1)
scene, t0, t1 = scenes.join([(faces, t0, t1)])
check("many bits", scene, t0, t1)
check("many bits", scene, np.stack([t0, t1]), np.stack([t1, t0]), worlds=2)
