# SPDX-License-Identifier: Apache-2.0
"""The answers about the parts of a step as one answer about the step."""

from collections.abc import Iterable, Sequence

import numpy as np

from . import _core, arguments
from .contacts import Contacts
from .worlds import answer_of

# Name, dtype, shape of a row.
_ARRAYS = (
    *(("vf", "uint32", (2,)), ("vf_toc", "float64", ()), ("ee", "uint32", (4,)), ("ee_toc", "float64", ())),
    *(("points", "float64", (3,)), ("normals", "float64", (3,)), ("closest", "float64", (2, 3))),
)


def contacts_of_step(answers: Sequence[tuple[Contacts, int, int]]) -> Contacts:
    """Each pair once, as the first of the answers tells it: (contacts, part, parts), about part number 0 to parts - 1
    of equal duration, or (contacts, 0, 1) about all of it. Times become those of the step. Order and hash as usual.

    Raises TypeError if it is not a list, or an answer is not (Contacts, integer, integer). Raises ValueError for a part
    that the step does not have, for answers of many worlds, and for answers with different outputs.
    """
    if not isinstance(answers, Iterable):
        raise TypeError(f"answers: expected a list of (contacts, part, parts), got {type(answers).__name__}")
    checked = [_checked(f"answers[{k}]", answer) for k, answer in enumerate(answers)]
    for name in ("points", "normals", "closest"):
        with_rows = [len(getattr(contacts, name)) > 0 for contacts, _, _ in checked if len(contacts)]
        if any(with_rows) and not all(with_rows):
            raise ValueError(f"answers: some have {name} and others do not; use detectors with the same outputs")
    return answer_of(Contacts, _core.contacts_of_step(checked))


def hash_of(contacts: Contacts) -> int:
    """What a detector gives as `hash` for these contacts of one world."""
    return _core.hash_of_contacts(_contacts("contacts", contacts))


def _checked(name: str, answer: object) -> tuple[Contacts, int, int]:
    if not isinstance(answer, (tuple, list)) or len(answer) != 3:
        raise TypeError(f"{name}: expected (contacts, part, parts), got {type(answer).__name__}")
    parts = arguments.whole_number(f"{name}, parts", answer[2], 1, 2**53)
    return _contacts(name, answer[0]), arguments.whole_number(f"{name}, part", answer[1], 0, parts - 1), parts


def _contacts(name: str, contacts: object) -> Contacts:
    if not isinstance(contacts, Contacts):
        raise TypeError(f"{name}: expected hpccd_core.Contacts, got {type(contacts).__name__}")
    if contacts.slices is not None:
        raise ValueError(f"{name}: contacts of many worlds; give those of each world by itself")
    for field, dtype, row in _ARRAYS:
        array = getattr(contacts, field)
        if not isinstance(array, np.ndarray) or array.dtype != dtype or array.shape[1:] != row or array.ndim == 0:
            raise TypeError(f"{name}: {field} is not an array as detectors return it; expected (n, *{row}) {dtype}")
    return contacts
