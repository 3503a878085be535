# SPDX-License-Identifier: Apache-2.0
"""Hash of all that a scene gives. As a program: print those of NAME:SIZE:FRAMES arguments."""

import hashlib
import sys


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
    from hpccd_ros import scenes

    for word in sys.argv[1:]:
        name, size, frames = word.split(":")
        print(digest(scenes.make(name, float(size), int(frames))))
