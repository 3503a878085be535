# SPDX-License-Identifier: Apache-2.0
"""A step whose detection takes much longer than its cancellation, and a lower bound of its duration."""

import threading
import time

import numpy as np
from hpccd.srv import Detect
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.middleware import mesh_messages

# Two sheets that lie on each other and move as one: millions of contacts, most of them degenerate, on one thread.
N, MESHES = 260, ("a", "b")
START, END = (sheet_positions(N, k) for k in (2, 3))


def long_request(meshes=MESHES):
    """meshes: more of them take far longer."""
    request = Detect.Request(mesh_names=meshes)
    for _ in meshes:
        request.topologies.append(mesh_messages.topology_message(sheet_faces(N), N * N))
        request.start.append(mesh_messages.vertices_message(START, 0))
        request.end.append(mesh_messages.vertices_message(END, 1))
    return request


def step_needs_more_than(seconds):
    """Whether the step, computed here, is still running after this CPU time in seconds."""
    scene = scene_of(**{mesh: sheet_faces(N) for mesh in MESHES})
    detector = hc.Detector(scene, threads=1, accuracy="exact")
    given_up = []

    def detect():
        try:
            detector.detect(*(np.concatenate([positions] * len(MESHES)) for positions in (START, END)))
            given_up.append(False)
        except hc.Cancelled:
            given_up.append(True)

    begin = time.process_time()
    under_way = threading.Thread(target=detect)
    under_way.start()
    while under_way.is_alive() and time.process_time() - begin < seconds:
        time.sleep(0.05)
    detector.cancel()
    under_way.join()
    return given_up == [True]
