# SPDX-License-Identifier: Apache-2.0
"""Hash of all that a scene gives. As a program: print those of NAME:SIZE:FRAMES[:SEED] arguments."""

import hashlib
import sys

import solved_cloth

from hpccd_ros import scenes


def make(word: str):
    """The scene NAME:SIZE:FRAMES[:SEED], of the product or of the example's solver."""
    name, size, frames, seed = (*word.split(":"), "0")[:4]
    kind = solved_cloth if name in solved_cloth.FRAMES else scenes
    return kind.make(name, float(size), int(frames), int(seed))


def digest(scene) -> str:
    """Hash of the faces, vertices and topology changes of all frames."""
    total = hashlib.sha256()
    for mesh in scene.meshes:
        total.update(mesh.faces.tobytes())
    for frame in scene.frames():
        for name, change in sorted(frame.topologies.items()):
            total.update(f"{frame.index} {name} {change.version} {change.n_vertices}".encode())
            total.update(change.faces.tobytes())
        for vertices in [*frame, *(frame.start or [])]:
            total.update(vertices.tobytes())
    return total.hexdigest()[:16]


if __name__ == "__main__":
    for word in sys.argv[1:]:
        print(digest(make(word)))
