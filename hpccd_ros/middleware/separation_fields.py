# SPDX-License-Identifier: Apache-2.0
"""The separation in force <-> the fields of ContactArray that tell it."""

from array import array

from hpccd.msg import ContactArray

from hpccd_ros.detect.separation import Separation


def fill_separation(message: ContactArray, separation: Separation) -> None:
    """Write it into ``message``, which has its ``mesh_names``."""
    index = {name: number for number, name in enumerate(message.mesh_names)}
    message.minimum_separation = float(separation.minimum)
    message.separation_mesh_a = array("I", (index[a] for a, _, _ in separation.pairs))
    message.separation_mesh_b = array("I", (index[b] for _, b, _ in separation.pairs))
    message.separations = array("d", (distance for _, _, distance in separation.pairs))


def read_separation(message: ContactArray) -> Separation:
    """Raises ValueError where the fields do not fit together, or tell what no scene can have."""
    mesh_a, mesh_b, distances = message.separation_mesh_a, message.separation_mesh_b, message.separations
    if not len(mesh_a) == len(mesh_b) == len(distances):
        raise ValueError(
            f"separation_mesh_a, separation_mesh_b and separations have {len(mesh_a)}, {len(mesh_b)} and "
            f"{len(distances)} entries; they belong together"
        )
    names = message.mesh_names
    if beyond := [number for number in (*mesh_a, *mesh_b) if number >= len(names)]:
        raise ValueError(f"separation_mesh_a, separation_mesh_b: {beyond[0]} names a mesh beyond the {len(names)}")
    pairs = tuple((names[a], names[b], d) for a, b, d in zip(mesh_a, mesh_b, distances, strict=True))
    separation = Separation(message.minimum_separation, pairs)
    if why := separation.unusable():
        raise ValueError(f"separation: {why}")
    return separation
