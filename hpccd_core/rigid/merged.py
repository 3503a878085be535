# SPDX-License-Identifier: Apache-2.0
"""The answers about the parts of a step as one answer about the step."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import hpccd_core as hc
from hpccd_core.parts import contacts_of_step, hash_of


def merged(found: Sequence[hc.Contacts], parts: int, whole: hc.Contacts | None = None) -> hc.Contacts:
    """Each pair once, from the earliest part in which it is reported: its toc as a time of the step, point, normal and
    nearest points. Order and hash as the core's.

    found: of the first parts in their order, each of one world; fewer than ``parts`` where a detector that reports
    "first" or "any" found some: give no later ones then. whole: of the whole step, about pairs of meshes that were not
    cut, in the same numbering and with the same outputs.
    """
    if not 1 <= len(found) <= parts:
        raise ValueError(f"found: answers of {len(found)} parts, the step has {parts}")
    answers = [(contacts, part, parts) for part, contacts in enumerate(found)]
    if whole is not None:
        answers.insert(0, (whole, 0, 1))
    if any(contacts.slices is not None for contacts, _, _ in answers):
        raise ValueError("found: answers of many worlds; give those of each world by itself")
    return found[0] if len(answers) == parts == 1 else contacts_of_step(answers)


def earliest(contacts: hc.Contacts) -> hc.Contacts:
    """Those at first_toc alone, as a detector that reports "first" gives them."""
    of_vf, of_ee = (np.flatnonzero(toc == contacts.first_toc) for toc in (contacts.vf_toc, contacts.ee_toc))
    rows = np.concatenate([of_vf, len(contacts.vf) + of_ee])
    first = hc.Contacts(
        vf=contacts.vf[of_vf],
        vf_toc=contacts.vf_toc[of_vf],
        ee=contacts.ee[of_ee],
        ee_toc=contacts.ee_toc[of_ee],
        first_toc=contacts.first_toc,
        hash=0,
        outputs={name: values[rows] for name, values in contacts.outputs.items()},
        layout=contacts.layout,
    )
    return replace(first, hash=hash_of(first))
