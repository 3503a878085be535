# SPDX-License-Identifier: Apache-2.0
"""Contacts of all steps, a column for each of their fields."""

import numpy as np
from hpccd.msg import ContactArray

from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware.contact_messages import FeaturePairs, fill_pairs
from hpccd_ros.picture.page.packing import Grid, packed

# Drawn of one step: more could not be told apart, and would be most of the page.
MOST = 20_000
# Of times of contact, which are 0..1.
TIMES = 65535


class ContactColumns:
    """Of each step the vertex-face contacts, then the edge-edge ones, with meshes and features as in ContactArray."""

    def __init__(self):
        self._meshes = [np.empty((0, 2), np.uint32)]
        self._features = [np.empty((0, 4), np.uint32)]
        self._toc, self._points = [np.empty(0)], [np.empty((0, 3))]

    def add(self, contacts, layout: Layout) -> tuple[int, int]:
        """How many vertex-face and edge-edge contacts of this step are drawn: at most MOST, evenly by time."""
        toc = np.concatenate([contacts.vf_toc, contacts.ee_toc])
        by_time = np.argsort(toc, kind="stable")
        kept = np.sort(by_time if len(toc) <= MOST else by_time[np.arange(MOST) * len(toc) // MOST])
        pairs = FeaturePairs.of(vf=contacts.vf, ee=contacts.ee).keep(kept)
        told = ContactArray()
        fill_pairs(told, pairs, layout)
        self._meshes.append(np.stack([told.mesh_a, told.mesh_b], axis=1).astype(np.uint32))
        sides = [np.asarray(side, np.uint32).reshape(-1, 2) for side in (told.features_a, told.features_b)]
        self._features.append(np.concatenate(sides, axis=1))
        self._toc.append(toc[kept])
        self._points.append(np.asarray(contacts.points).reshape(-1, 3)[kept])
        return len(pairs.vf), len(pairs.ee)

    def described(self) -> tuple[dict, dict[str, bytes]]:
        """(what the page says of them, {column: bytes})."""
        toc, points = np.concatenate(self._toc), np.concatenate(self._points)
        grid = Grid(points.min(axis=0), points.max(axis=0)) if len(points) else Grid(np.zeros(3), np.zeros(3))
        blobs = {
            "meshes": packed(np.concatenate(self._meshes)[None]),
            "features": packed(np.concatenate(self._features)[None]),
            # One row: times are in no order that would make differences small.
            "toc": packed(np.rint(toc * TIMES).astype(np.uint16).reshape(1, 1, -1)),
            "points": packed(grid.rounded(points)[None]),
        }
        return {**grid.described(), "count": len(toc), "times": TIMES}, blobs
