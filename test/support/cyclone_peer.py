# SPDX-License-Identifier: Apache-2.0
"""A simulator without ROS: publishes a mesh with Cyclone DDS and saves the contacts that it receives.

`python cyclone_peer.py NAMESPACE INPUT OUTPUT`. INPUT: .npz with faces (F,3) and frames (K,V,3), float32 or float64.
OUTPUT: .json with the results, each a dictionary of the message's fields.
"""

import dataclasses
import json
import os
import sys
import time

import cyclone_types as types
import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PATIENCE = 240.0  # s
MOST_WAIT = 5.0  # s for a result before the next frame: one may be lost, see test_interop_cyclonedds.py


def qos(depth: int, latched: bool = False) -> Qos:
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=10)),
        Policy.History.KeepLast(depth),
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
    )


def wait(ready, what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not ready():
        if time.monotonic() > deadline:
            sys.exit(f"no {what} within {PATIENCE} s")
        time.sleep(0.02)


def header(stamp: int) -> types.Header:
    return types.Header(types.Time(0, stamp), "lab")


def as_dict(result: types.ContactArray) -> dict:
    # Not dataclasses.asdict of the whole: it would copy long lists element by element.
    fields = {field.name: getattr(result, field.name) for field in dataclasses.fields(result)}
    return {**fields, "header": dataclasses.asdict(result.header), "start": dataclasses.asdict(result.start)}


def main(namespace: str, source: str, target: str) -> None:
    with np.load(source) as archive:
        faces, frames = archive["faces"], archive["frames"]
    double = frames.dtype == np.float64
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))

    def topic(name: str, kind: type) -> Topic:
        return Topic(participant, f"rt{namespace}/{name}", kind)

    topology = DataWriter(participant, topic("meshes/cloth/topology", types.MeshTopology), qos(1, latched=True))
    vertices = DataWriter(participant, topic("meshes/cloth/vertices", types.MeshVertices), qos(20))
    contacts = DataReader(participant, topic("contacts", types.ContactArray), qos(20))
    topology.write(types.MeshTopology(header(0), 3, len(frames[0]), faces.ravel().tolist(), []))
    wait(lambda: vertices.get_matched_subscriptions() and contacts.get_matched_publications(), "node")
    results = []

    def has_result(step: int) -> bool:
        results.extend(sample for sample in contacts.take(10) if sample.sample_info.valid_data)
        return any(result.step == step for result in results)

    for k, frame in enumerate(frames):
        flat = frame.ravel().tolist()
        vertices.write(types.MeshVertices(header(k + 1), 3, k, [] if double else flat, flat if double else []))
        deadline = time.monotonic() + MOST_WAIT
        while k and not has_result(k) and time.monotonic() < deadline:
            time.sleep(0.01)
    # A frame has no result before the one behind it: all but one of the results come, sooner or later.
    steps = len(frames) - 1
    wait(lambda: has_result(steps) + len(results) >= steps, f"{steps - 1} results")
    assert not {"rclpy", "hpccd"} & sys.modules.keys(), "this peer is to be independent of ROS"
    with open(target, "w", encoding="utf-8") as file:
        json.dump([as_dict(result) for result in results], file)


if __name__ == "__main__":
    main(*sys.argv[1:])
