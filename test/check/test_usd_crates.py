# SPDX-License-Identifier: Apache-2.0
"""Binary USD files whose sections claim more than they hold are rejected before memory is reserved for it."""

import struct

import numpy as np
import pytest

from hpccd_core.sequences.sequence import SequenceError
from hpccd_core.sequences.usd_crate import check_counts

Usd = pytest.importorskip("pxr.Usd", reason="reading USD needs the extra check")
from pxr import UsdGeom  # noqa: E402


def crate(tmp_path, n=1):
    """A file of n meshes, and (name -> begin, size) of its sections."""
    path = tmp_path / "a.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    for k in range(n):
        UsdGeom.Mesh.Define(stage, f"/m{k}").GetPointsAttr().Set(np.eye(3).tolist())
    stage.Save()
    data = path.read_bytes()
    toc = struct.unpack_from("<q", data, 16)[0]
    count = struct.unpack_from("<Q", data, toc)[0]
    found = (struct.unpack_from("<16sqq", data, toc + 8 + 32 * k) for k in range(count))
    return path, {name.rstrip(b"\0").decode(): place for name, *place in found}, toc


def changed(path, at, value):
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, at, value)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("n", [1, 5000])
def test_valid_files(tmp_path, n):
    """Specs of many equal meshes are packed 240 to a byte."""
    check_counts(crate(tmp_path, n)[0])


@pytest.mark.parametrize(
    ("name", "offset"),
    [(name, 0) for name in ("TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS")]
    + [(name, 8) for name in ("TOKENS", "FIELDS", "FIELDSETS", "PATHS", "SPECS")]
    + [("TOKENS", 16), ("PATHS", 16)],
)
@pytest.mark.parametrize("value", [10**8, 2**63, 2**64 - 1])
def test_counts_that_do_not_fit(tmp_path, name, offset, value):
    path, sections, _ = crate(tmp_path)
    with pytest.raises(SequenceError, match="is damaged: its sections do not fit; copy or export it again"):
        check_counts(changed(path, sections[name][0] + offset, value))


@pytest.mark.parametrize("offset", [0, 8 + 16, 8 + 24])
def test_a_table_of_contents_that_does_not_fit(tmp_path, offset):
    path, _, toc = crate(tmp_path)
    with pytest.raises(SequenceError, match="is damaged: its sections do not fit"):
        check_counts(changed(path, toc + offset, 2**40))
    with pytest.raises(SequenceError, match="is damaged: its sections do not fit"):
        check_counts(changed(path, 16, 2**40))


def test_other_files_are_left_alone(tmp_path):
    for content in (b"", b"PXR-USDC", b"#usda 1.0\n" + bytes(100)):
        (tmp_path / "a.usd").write_bytes(content)
        check_counts(tmp_path / "a.usd")
