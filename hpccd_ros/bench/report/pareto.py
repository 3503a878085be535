# SPDX-License-Identifier: Apache-2.0
"""Of things that are to be small in several ways at once, those worth a look."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

Thing = TypeVar("Thing")


def front(things: Sequence[Thing], values: Callable[[Thing], tuple[float, ...]]) -> list[Thing]:
    """Those that no other one beats: none is as small in all values and smaller in one."""

    def beats(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
        return a != b and all(x <= y for x, y in zip(a, b, strict=True))

    return [thing for thing in things if not any(beats(values(other), values(thing)) for other in things)]
