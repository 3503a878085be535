# SPDX-License-Identifier: Apache-2.0
"""Valid and invalid requests to ~/detect, with waving sheets."""

import math

import numpy as np
from hpccd.srv import Detect
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import mesh_messages

N = 16
FACES = sheet_faces(N)


def request(step=0, *, n=N, names=("cloth",), topologies=True, dtype=np.float32, **fields):
    out = Detect.Request(mesh_names=list(names), **fields)
    if topologies:
        out.topologies = [mesh_messages.topology_message(sheet_faces(n), n * n) for _ in names]
    for i, _ in enumerate(names):
        for target, k in ((out.start, step), (out.end, step + 1)):
            positions = sheet_positions(n, k + 2 * i, offset=0.003 * i, dtype=dtype)
            target.append(mesh_messages.vertices_message(positions, k, step=k, frame_id="lab"))
    return out


def changed(change, **options):
    out = request(**options)
    change(out)
    return out


def many_names(r):
    r.mesh_names = [f"mesh{k}" for k in range(1001)]


def cut_end(r):
    r.end = []


def cut_vertices(r):
    r.end[0].vertices_f32 = r.end[0].vertices_f32[:-3]


def put_nan(r):
    r.start[0].vertices_f32[5] = math.nan


def put_far(r):
    points = sheet_positions(N, 1, dtype=np.float64)
    points[7, 2] = 1e151
    r.end[0] = mesh_messages.vertices_message(points, 1)


def bad_stamp(r):
    r.start[0].header.stamp.nanosec = 10**9


def other_version(r):
    r.start[0].topology_version = 4


def bad_index(r):
    r.topologies[0].faces[0] = N * N


# Each with a part of the reason for which it is rejected.
BAD = [
    (request(names=("ghost",), topologies=False), "unknown mesh 'ghost'"),
    (request(names=("a", "a")), "names must differ"),
    (changed(many_names), "1,001 meshes, at most 1000 are taken (parameter max_meshes)"),
    (changed(cut_end), "end: 0 entries for 1 mesh"),
    (changed(cut_vertices), "end[0] (cloth): 255 vertices, the topology has 256"),
    (changed(put_nan), "start[0] (cloth): vertex 1 is"),
    (changed(put_far), "end[0] (cloth): vertex 7 is"),
    (changed(bad_stamp), "start[0] (cloth): stamp has sec 0 and nanosec 1000000000"),
    (changed(other_version), "start[0] (cloth): topology_version 4"),
    (changed(bad_index), "topologies[0] (cloth): face 0 names vertex 256"),
    (request(names=("g" * 2_000_000,), topologies=False), "unknown mesh 'ggg"),
    (request(names=("a" * 1_000_000, "b", "a" * 1_000_000)), "names must differ"),
    (changed(cut_end, names=("a" * 1_000_000, "b" * 1_000_000)), "end: 0 entries for 2 meshes"),
    (changed(bad_index, names=("a" * 2_000_000,)), "face 0 names vertex 256"),
    (request(accuracy="s" * 2_000_000), "accuracy"),
    (request(accuracy="sloppy"), "accuracy"),
    (request(report="some"), "report"),
    (request(time_limit=-1.0), "time_limit"),
    (request(time_limit=math.nan), "time_limit"),
]
BAD_IDS = (
    "mesh names many count vertices nan far stamp version index mesh-2MB names-2MB count-2MB index-2MB "
    "accuracy-2MB accuracy report limit nan-limit"
).split()

LARGE = 300  # a million contacts in this step: far longer to compute than small requests and steps take
