# SPDX-License-Identifier: Apache-2.0
"""Optional dependencies: imported where they are, and what brings them where they are not."""

import math

import pytest

from hpccd_ros.base import extras
from hpccd_ros.base.errors import UserError


def test_what_is_installed_is_imported():
    assert extras.require("math", "nothing", "counting") is math


def test_what_is_missing_is_named_with_its_extra():
    with pytest.raises(UserError) as rejected:
        extras.require("no_such_package.part", "cluster", "many recordings at once")
    text = str(rejected.value)
    assert text.startswith("many recordings at once needs the Python package no_such_package (")
    assert "pip install '.[cluster]'" in text
