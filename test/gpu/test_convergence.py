# SPDX-License-Identifier: Apache-2.0
"""Kernels in which warps wait for each other come out of their branches whole (gpu/item_of_thread.cuh)."""

import re
import shutil
import subprocess

import pytest

from hpccd_core import _core

WHOLE_WARPS = re.compile(r"\b(VOTEU?|SHFL|MATCH|REDUX|BAR)\b")
KEPT_BARRIER = re.compile(r"BMOV\.32(\.\w+)? B\d+, R\d+")


def kernels():
    """(name, instructions) of each kernel of this build."""
    program = shutil.which("cuobjdump") or shutil.which("cuobjdump", path="/usr/local/cuda/bin")
    if not program:
        pytest.skip("cuobjdump is not installed: it comes with the CUDA toolkit")
    text = subprocess.run([program, "--dump-sass", _core.__file__], capture_output=True, text=True, check=True).stdout
    for part in text.split("Function : ")[1:]:
        name, instructions = part.split("\n", 1)
        yield name.strip(), instructions


def test_no_kernel_that_keeps_barriers_in_registers_asks_whole_warps():
    """There are some that do; they must be free of votes and shuffles."""
    n_kernels, deep = 0, []
    for name, instructions in kernels():
        n_kernels += 1
        if KEPT_BARRIER.search(instructions):
            deep.append(name)
            assert not WHOLE_WARPS.search(instructions), name
    assert n_kernels > 50
    assert any("integers_kernel" in name for name in deep)
