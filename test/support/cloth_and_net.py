# SPDX-License-Identifier: Apache-2.0
"""Two waving sheets, one a little above the other and ahead of it."""

import numpy as np
from waving_sheet import sheet_faces, sheet_positions

N = 8
FACES = sheet_faces(N)
MESHES = ("cloth", "net")


def positions(k):
    """Of both meshes in frame k."""
    return sheet_positions(N, k), sheet_positions(N, k + 2, offset=0.02)


def frame(k):
    return np.concatenate(positions(k))
