# SPDX-License-Identifier: Apache-2.0
"""Point clouds of any layout."""

from array import array

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

F32, F64 = PointField.FLOAT32, PointField.FLOAT64


def cloud(points, *, names="xyz", offsets=None, step=None, kinds=None, height=1, row_pad=0, big=False):
    """PointCloud2 of (n,3) points; one datatype an axis; extra bytes are filled with 0xAB."""
    kinds = kinds or [PointField.FLOAT32] * 3
    types = [np.dtype({PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}.get(k, "i4")) for k in kinds]
    offsets = offsets or np.cumsum([0, *(t.itemsize for t in types[:2])]).tolist()
    step = step or max(o + t.itemsize for o, t in zip(offsets, types, strict=True))
    width = len(points) // height
    row_step = width * step + row_pad
    data = np.full((height, row_step), 0xAB, np.uint8)
    for i, point in enumerate(points):
        row, column = divmod(i, width)
        for axis in range(3):
            raw = np.frombuffer(np.asarray(point[axis], types[axis]).tobytes(), np.uint8)
            at = column * step + offsets[axis]
            data[row, at : at + len(raw)] = raw
    message = PointCloud2(height=height, width=width, point_step=step, row_step=row_step, is_bigendian=big)
    message.fields = [
        PointField(name=n, offset=o, datatype=k, count=1) for n, o, k in zip(names, offsets, kinds, strict=True)
    ]
    message.data = array("B", data.tobytes())
    return message
