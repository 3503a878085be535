# SPDX-License-Identifier: Apache-2.0
"""The positions of one static mesh, by the coordinate frame that they are in. No ROS."""

from typing import NamedTuple

import numpy as np

from hpccd_ros.frames.types import MeshFrame

# Bounds what strangers can make the node keep.
_MOST_FRAMES = 4


class Kept(NamedTuple):
    """``frame``: the first message with these positions; ``newest``: the last one, which may be the same again."""

    frame: MeshFrame
    newest: MeshFrame


class StaticPositions:
    def __init__(self) -> None:
        self._by_frame_id: dict[str, Kept] = {}  # in the order of arrival

    @property
    def frame_ids(self) -> list[str]:
        """The last one that was sent last."""
        return list(self._by_frame_id)

    @property
    def last_sent(self) -> int | None:
        """When the last positions were sent; None: there are none."""
        return max((kept.newest.sent for kept in self._by_frame_id.values()), default=None)

    def keep(self, frame: MeshFrame) -> None:
        known = self._by_frame_id.pop(frame.frame_id, None)
        same = known is not None and np.array_equal(known.frame.vertices, frame.vertices)
        self._by_frame_id[frame.frame_id] = Kept(known.frame if same else frame, frame)
        if len(self._by_frame_id) > _MOST_FRAMES:
            del self._by_frame_id[next(iter(self._by_frame_id))]

    def fitting(self, frame_id: str) -> Kept | None:
        """The last positions in this coordinate frame; those that name none fit all, as does an empty frame_id."""
        fitting = [kept for name, kept in self._by_frame_id.items() if name in ("", frame_id) or not frame_id]
        return fitting[-1] if fitting else None

    def clear(self) -> None:
        self._by_frame_id.clear()
