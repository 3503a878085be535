# SPDX-License-Identifier: Apache-2.0
"""Between the executor and the detection thread: what is in the books when a frame gets into the queue."""

import numpy as np

from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import AssemblyRules, MeshFrame, MeshSettings, Topology
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.input_subscription import hand_over

MESHES = (MeshSettings("cloth"), MeshSettings("ball"))


def push(pipeline, accounts, mesh, stamp):
    hand_over(pipeline.push(mesh, MeshFrame(stamp, np.zeros((3, 3)))), pipeline, accounts)


def test_drops_are_counted_and_told_before_the_detection_thread_is_let_in():
    pipeline = FramePipeline(MESHES, AssemblyRules())
    queue = pipeline.start(1)
    queued_when_told = []
    accounts = Accounts(lambda text: queued_when_told.append((text.partition(" stamp")[0], len(queue.frames()))))
    for mesh in MESHES:
        hand_over(pipeline.push(mesh.name, Topology(0, 3, np.array([[0, 1, 2]], np.uint32))), pipeline, accounts)
    for stamp in (1, 2, 3, 4):
        push(pipeline, accounts, "cloth", stamp)
    push(pipeline, accounts, "ball", 4)
    assert queued_when_told == [("cloth: incomplete:", 0)] and accounts.dropped.total == 3
    assert [frame.stamp for frame in queue.frames()] == [4]


def test_what_the_queue_has_no_room_for_is_counted():
    pipeline, accounts = FramePipeline(MESHES[:1], AssemblyRules()), Accounts(print)
    queue = pipeline.start(1)
    hand_over(pipeline.push("cloth", Topology(0, 3, np.array([[0, 1, 2]], np.uint32))), pipeline, accounts)
    for stamp in (1, 2, 3):
        push(pipeline, accounts, "cloth", stamp)
    assert [frame.stamp for frame in queue.frames()] == [1, 3]
    assert accounts.dropped.by_mesh_and_reason() == {("cloth", Reason.OVERLOAD): 1}
