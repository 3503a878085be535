# SPDX-License-Identifier: Apache-2.0
"""A child made by os.fork() has the detectors of its parent, but none of their threads."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")

PROGRAM = """
import os, sys
import numpy as np
import hpccd_core as hc

scene = hc.Scene()
scene.add_mesh("soup", np.arange(1500).reshape(-1, 3))
start, end = np.random.default_rng(1).standard_normal((2, 1500, 3))
alone, several = (hc.Detector(scene, backend="cpu", threads=threads) for threads in (1, 8))
expected = several.detect(start, end).hash

def child():
    global several
    assert alone.detect(start, end).hash == expected
    assert hc.Detector(scene, backend="cpu", threads=8).detect(start, end).hash == expected
    try:
        several.detect(start, end)
    except RuntimeError as error:
        assert "make one after the fork" in str(error)
    else:
        raise AssertionError("a detector without its threads has returned a result")
    several = None

if os.fork() == 0:
    child()
    print("child ended", flush=True)
    sys.exit(0)
_, status = os.wait()
assert several.detect(start, end).hash == expected
print("status", os.waitstatus_to_exitcode(status))
"""

# The fork comes while other threads are in calls, whatever they do at that moment.
DURING_CALLS = """
import os, sys, threading
import numpy as np
import hpccd_core as hc

scene = hc.Scene()
scene.add_mesh("soup", np.arange(4500).reshape(-1, 3))
start, end = np.random.default_rng(1).standard_normal((2, 4500, 3))
detectors = [hc.Detector(scene, backend="cpu", threads=threads) for threads in (1, 2)]
going = True
begun = [threading.Event() for _ in detectors]

def work(detector, begun):
    while going:
        begun.set()
        detector.detect(start, end)

threads = [threading.Thread(target=work, args=a) for a in zip(detectors, begun)]
for thread in threads:
    thread.start()
for event in begun:
    event.wait()
for _ in range(10):
    if os.fork() == 0:
        told = 0
        for detector in detectors:
            for ask in (lambda d: d.detect(start, end), lambda d: d.profile, lambda d: d.stats):
                try:
                    ask(detector)
                except RuntimeError as error:
                    assert "make one after the fork" in str(error)
                    told += 1
        del detector
        detectors.clear()
        os._exit(0 if told else 1)
    _, status = os.wait()
    print("status", os.waitstatus_to_exitcode(status))
going = False
for thread in threads:
    thread.join()
"""


@pytest.mark.parametrize(
    ("program", "says"),
    [(PROGRAM, ["child ended", "status 0"]), (DURING_CALLS, ["status 0"] * 10)],
    ids=["between calls", "during calls"],
)
def test_a_child_is_told_and_may_end(program, says):
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.splitlines() == says, done.stderr
