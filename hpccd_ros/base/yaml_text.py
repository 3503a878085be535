# SPDX-License-Identifier: Apache-2.0
"""YAML of others: every failure is a yaml.YAMLError."""

from typing import Any

import yaml


def loaded(text: str, loader: type[yaml.SafeLoader] = yaml.SafeLoader) -> Any:
    """The value of the first document.

    Raises yaml.YAMLError. SafeLoader itself raises whatever its constructors meet: ValueError for the date 2001-99-99,
    KeyError for !!bool maybe, IndexError, AttributeError or TypeError for others, RecursionError for deep nesting.
    """
    try:
        return yaml.load(text, loader)
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise yaml.YAMLError(f"a value has an invalid form ({error}); put texts in quotes") from error
