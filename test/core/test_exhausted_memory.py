# SPDX-License-Identifier: Apache-2.0
"""Where the system gives no more memory or threads, a call fails with an exception; the process goes on."""

import subprocess
import sys

LIMITED = """
import ctypes, resource, sys
import numpy as np
import hpccd_core as hc

def limit(more):
    size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + more, resource.RLIM_INFINITY))

def unlimited():
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

scene = hc.Scene()
scene.add_mesh("soup", np.arange(42).reshape(-1, 3))
"""

NO_THREADS = """
limit(64 << 20)  # eight threads have that, if each has 8 MB of stack
for threads in (2, 300):
    try:
        hc.Detector(scene, backend="cpu", threads=threads)
        print("made")
    except RuntimeError as error:
        print(error)
"""

# The first throw of a thread wants memory itself.
NO_MEMORY = """
vertices = np.random.default_rng(1).standard_normal((4000, 42, 3))
libc = ctypes.CDLL("libc.so.6")
M_MMAP_THRESHOLD = -3
libc.mallopt(M_MMAP_THRESHOLD, 65536)
expected = hc.Detector(scene, worlds=4000, backend="cpu", threads=1).proximity(vertices, 0.5).hash
failed = 0
for _ in range(6):
    detector = hc.Detector(scene, worlds=4000, backend="cpu", threads=2)
    libc.malloc_trim(0)
    limit(0)
    try:
        detector.proximity(vertices, 0.5)
    except MemoryError:
        failed += 1
    unlimited()
    assert detector.proximity(vertices, 0.5).hash == expected
print("failed", failed)
"""


def run(program):
    done = subprocess.run(
        [sys.executable, "-c", LIMITED + program], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, (done.returncode, done.stderr)
    return done.stdout.splitlines()


def test_too_many_threads():
    made, refused = run(NO_THREADS)
    assert made == "made"
    assert refused.startswith("threads: the system starts ") and "of 300" in refused and "ask for fewer" in refused


def test_no_memory_in_threads_that_have_not_thrown_yet():
    assert run(NO_MEMORY)[0] in [f"failed {n}" for n in range(1, 7)]
