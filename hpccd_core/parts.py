# SPDX-License-Identifier: Apache-2.0
"""The contacts of the parts of a step as those of the step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from . import _core, arguments
from .contacts import Contacts
from .results import OUTPUT_ARRAYS, result_of, with_outputs
from .worlds import PAIR_KINDS

# Name, dtype, shape of a row.
_ARRAYS = [
    array
    for kind, columns in PAIR_KINDS.items()
    for array in ((kind, "uint32", (columns,)), (f"{kind}_toc", "float64", ()))
]


def contacts_of_step(results: Sequence[tuple[Contacts, int, int]]) -> Contacts:
    """The contacts of the parts of a step as those of the step: each pair once, as the first of the parts reports it.

    Parameters
    ----------
    results : sequence of (Contacts, int, int)
        Each (contacts, part, parts): the contacts of part number 0 to parts - 1 of equal duration, or (contacts, 0, 1)
        for the whole step.

    Returns
    -------
    Contacts
        Times are those of the step; order and hash as those of a detector.

    Raises
    ------
    TypeError
        If it is not a list, or an item is not (Contacts, integer, integer).
    ValueError
        For a part that the step does not have, contacts of many worlds, or contacts with different outputs.
    """
    if not isinstance(results, Iterable):
        raise TypeError(f"results: expected a list of (contacts, part, parts), got {type(results).__name__}")
    checked = [_checked(f"results[{k}]", result) for k, result in enumerate(results)]
    asked = {name: [name in contacts.outputs for contacts, _, _ in checked if len(contacts)] for name in OUTPUT_ARRAYS}
    for name, those in asked.items():
        if any(those) and not all(those):
            raise ValueError(f"results: some have {name} and others do not; use detectors with the same outputs")
    outputs = tuple(
        name for name, those in asked.items() if all(those or [name in contacts.outputs for contacts, _, _ in checked])
    )
    found: Any = _core.contacts_of_step([(_for_core(contacts), part, parts) for contacts, part, parts in checked])
    layout = next((contacts.layout for contacts, _, _ in checked if contacts.layout is not None), None)
    return result_of(Contacts, with_outputs(found, outputs), layout)


def hash_of(contacts: Contacts) -> int:
    """The `hash` that a detector returns for these contacts of one world."""
    return _core.hash_of_contacts(_for_core(_contacts("contacts", contacts)))


def _for_core(contacts: Contacts) -> SimpleNamespace:
    """The contacts with all outputs as the core reads them: without rows where they were not computed."""
    outputs = {
        name: contacts.outputs.get(name, np.empty((0, *kind.row), kind.dtype)) for name, kind in OUTPUT_ARRAYS.items()
    }
    arrays = {name: getattr(contacts, name) for name, _, _ in _ARRAYS}
    return SimpleNamespace(**arrays, **outputs, first_toc=contacts.first_toc, hash=contacts.hash)


def _checked(name: str, result: object) -> tuple[Contacts, int, int]:
    if not isinstance(result, (tuple, list)) or len(result) != 3:
        raise TypeError(f"{name}: expected (contacts, part, parts), got {type(result).__name__}")
    parts = arguments.whole_number(f"{name}, parts", result[2], 1, 2**53)
    return _contacts(name, result[0]), arguments.whole_number(f"{name}, part", result[1], 0, parts - 1), parts


def _contacts(name: str, contacts: object) -> Contacts:
    if not isinstance(contacts, Contacts):
        raise TypeError(f"{name}: expected hpccd_core.Contacts, got {type(contacts).__name__}")
    if contacts.slices is not None:
        raise ValueError(f"{name}: contacts of many worlds; give those of each world by itself")
    arrays: list[tuple[str, Any, str, tuple[int, ...]]] = [
        (field, getattr(contacts, field), dtype, row) for field, dtype, row in _ARRAYS
    ]
    arrays += [
        (field, array, OUTPUT_ARRAYS[field].dtype, OUTPUT_ARRAYS[field].row)
        for field, array in contacts.outputs.items()
    ]
    for field, array, dtype, row in arrays:
        if not isinstance(array, np.ndarray) or array.dtype != dtype or array.shape[1:] != row or array.ndim == 0:
            raise TypeError(f"{name}: {field} is not an array as detectors return it; expected (n, *{row}) {dtype}")
    return contacts
