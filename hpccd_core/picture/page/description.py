# SPDX-License-Identifier: Apache-2.0
"""What a page says of its steps: the JSON that the viewer reads, beside the bytes of `packing`."""

from collections.abc import Sequence

import numpy as np

from hpccd_core.mesh_files.errors import shortened
from hpccd_core.picture import curves
from hpccd_core.picture.contacts import BACKGROUND, FAINT, INK, INTERSECTING, TOC_COLOURS
from hpccd_core.picture.page.packing import ContactColumns, Curves, FaceLists, MeshPositions
from hpccd_core.picture.tint import RADIUS, STRENGTH

# Colours of times of contact between which the page blends.
TOC_SHADES = 33


def described(
    title: str,
    view: dict,
    meshes: Sequence[tuple[MeshPositions, dict]],
    contacts: ContactColumns,
    marked: FaceLists,
    lines: Curves,
    steps: list[dict],
    notes: list[str],
    origin: str,
    intersecting_are: str = "faces that intersect another mesh",
) -> tuple[dict, dict[str, bytes]]:
    """(what the page says, as JSON can hold it, {name: bytes} of what it draws).

    view: azimuth, elevation. meshes: with colour, group, hidden, plane and thickness of each. steps: as the viewer's
    `recording.js` reads them. origin: how the contacts were computed, as a sentence.
    """
    of_meshes = []
    blobs: dict[str, bytes] = {}
    for number, (mesh, looks) in enumerate(meshes):
        description, of_mesh = mesh.described()
        of_meshes.append({**description, **looks})
        blobs |= {f"mesh-{number}-{name}": data for name, data in of_mesh.items()}
    of_contacts, columns = contacts.described()
    blobs |= {f"contacts-{name}": data for name, data in columns.items()}
    blobs["intersecting-faces"] = marked.packed()
    of_curves, columns = lines.described()
    blobs |= {f"curves-{name}": data for name, data in columns.items()}
    description = {
        "title": shortened(title),
        "view": view,
        "colours": {
            "background": BACKGROUND,
            "ink": INK,
            "faint": FAINT,
            "tint": STRENGTH,
            "radius": RADIUS,
            "intersecting": INTERSECTING,
            "curves": curves.COLOUR,
            "depth": curves.DEPTH,
            "toc": [[float(c) for c in TOC_COLOURS(t)[:3]] for t in np.linspace(0.0, 1.0, TOC_SHADES)],
        },
        "meshes": of_meshes,
        "contacts": of_contacts,
        "curves": of_curves,
        "steps": steps,
        "notes": notes,
        "origin": origin,
        "intersectingFacesAre": intersecting_are,
    }
    return description, blobs
