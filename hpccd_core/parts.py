# SPDX-License-Identifier: Apache-2.0
"""The answers about the parts of a step as one answer about the step."""

from collections.abc import Sequence

from . import _core
from .contacts import Contacts
from .worlds import answer_of


def contacts_of_step(answers: Sequence[tuple[Contacts, int, int]]) -> Contacts:
    """Each pair once, as the first of the answers tells it: (contacts, part, parts), about part number 0 to parts - 1
    of equal duration, or (contacts, 0, 1) about all of it. Times become those of the step. Order and hash as usual.

    Raises ValueError: answers of many worlds.
    """
    if any(contacts.slices is not None for contacts, _, _ in answers):
        raise ValueError("answers: of many worlds; give those of each world by itself")
    return answer_of(Contacts, _core.contacts_of_step(answers))


def hash_of(contacts: Contacts) -> int:
    """What a detector gives as `hash` for these contacts of one world."""
    return _core.hash_of_contacts(contacts)
