# SPDX-License-Identifier: Apache-2.0
"""YAML that PyYAML's constructors fail on."""

import pytest
import yaml

from hpccd_ros.base.yaml_text import loaded
from hpccd_ros.params import parameter_file

INVALID = [
    "2001-99-99",  # ValueError
    "!!bool maybe",  # KeyError
    "!!int ''",  # IndexError
    "!!float a:b",
    "!!timestamp soon",  # AttributeError
    "!!binary é",
    "[" * 5000,  # RecursionError
    "{",
]


@pytest.mark.parametrize("text", INVALID)
def test_every_failure_is_a_yaml_error(text):
    with pytest.raises(yaml.YAMLError):
        loaded(text)


@pytest.mark.parametrize("text", INVALID)
def test_a_value_that_is_no_yaml_is_a_text(text):
    assert parameter_file.value(text) == text
    assert parameter_file.parameter_value(text) == text
