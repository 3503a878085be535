# SPDX-License-Identifier: Apache-2.0
"""The folders of the C++ core include only what stands before them; the script that says so sees what is planted."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def check(*folder):
    return subprocess.run(
        [sys.executable, ROOT / "scripts" / "check_includes.py", *folder], capture_output=True, text=True, check=False
    )


def plant(tmp_path, **files):
    for name, text in files.items():
        path = tmp_path / name.replace("__", "/")
        path = path.with_suffix(".h")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return check(tmp_path)


def test_the_core_includes_one_way():
    result = check()
    assert result.returncode == 0, result.stdout


def test_an_include_that_runs_up_is_named(tmp_path):
    result = plant(tmp_path, base__a='#pragma once\n#include "bvh/tree.h"\n', bvh__tree='#include "base/b.h"\n')
    assert result.returncode == 1
    assert f'{tmp_path}/base/a.h:2: base -> bvh: includes "bvh/tree.h"' in result.stdout
    assert "tree.h:1" not in result.stdout


def test_files_beside_the_rooms_come_last(tmp_path):
    assert plant(tmp_path, detector='#include "gpu/frames.h"\n').returncode == 0
    result = plant(tmp_path, gpu__frames='#include "detector.h"\n')
    assert result.returncode == 1 and "frames.h:1: gpu -> the files beside the folders" in result.stdout


def test_a_new_folder_needs_a_place(tmp_path):
    result = plant(tmp_path, attic__a="", base__b='#include "attic/a.h"\n')
    assert result.returncode == 1
    assert "the folder attic/ has no place in the order" in result.stdout and "none of the folders" in result.stdout


def test_a_wrong_folder_is_an_error_of_its_own(tmp_path):
    result = check(tmp_path / "nowhere")
    assert result.returncode == 2 and "there is no folder" in result.stderr
