# SPDX-License-Identifier: Apache-2.0
"""Sums whose last bits are the same with any Python."""

import numpy as np

from hpccd_core.rigid.rounding import dot, in_order


def test_each_step_is_rounded():
    """sum() of Python 3.12 gives 1.0 of these."""
    assert in_order([1e16, 1.0, -1e16]) == 0.0
    assert in_order(iter([])) == 0.0


def test_dot():
    a, b = np.array([1e8, 1.0, 1e8]), np.array([1e8, 1.0, -1e8])
    assert dot(a, b) == 0.0
    assert isinstance(dot(a, b), float)
