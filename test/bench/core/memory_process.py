# SPDX-License-Identifier: Apache-2.0
"""The process that the subject `memory` watches: PATH of a step, detector options as JSON, or null not to detect."""

import json
import sys
from pathlib import Path

import numpy as np

import hpccd_core as hc


def peak_bytes() -> int:
    """Peak resident size of this process since it began, as Linux counts it."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1])


def main(path: str, options: str) -> None:
    with np.load(path, allow_pickle=False) as archive:
        faces, vertices_t0, vertices_t1 = (archive[key] for key in ("faces", "vertices_t0", "vertices_t1"))
    scene = hc.Scene()
    scene.add_mesh("scene", faces, n_vertices=len(vertices_t0))
    wanted, found = json.loads(options), {}
    if wanted is not None:
        detector = hc.Detector(scene, **wanted)
        for _ in range(3):  # buffers have their size when a stream has run for a while
            contacts = detector.detect(vertices_t0, vertices_t1)
        found = {"contacts": len(contacts), "stats": detector.stats}
    print(json.dumps({"peak_bytes": peak_bytes(), **found}))


if __name__ == "__main__":
    main(*sys.argv[1:])
