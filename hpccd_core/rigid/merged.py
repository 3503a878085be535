# SPDX-License-Identifier: Apache-2.0
"""The contacts of the parts of a step as those of the step."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import hpccd_core as hc
from hpccd_core.parts import contacts_of_step, hash_of


def merged(found: Sequence[hc.Contacts], parts: int, whole: hc.Contacts | None = None) -> hc.Contacts:
    """The contacts of the parts of a step as those of the step: each pair once, from the earliest part that has it.

    Parameters
    ----------
    found : sequence of Contacts
        Contacts of the parts in their order, of one world each. After a part in which a detector with report="first"
        or "any" found contacts, leave out the later parts.
    parts : int
        Number of parts of the step.
    whole : Contacts, optional
        Contacts of the whole step between meshes that were not cut, in the same numbering, with the same outputs.

    Returns
    -------
    Contacts
        Times are those of the step; order and hash as those of a detector.

    Raises
    ------
    ValueError
        If there are more results than parts or none, or results of many worlds.
    """
    if not 1 <= len(found) <= parts:
        raise ValueError(f"found: results of {len(found)} parts, the step has {parts}")
    results = [(contacts, part, parts) for part, contacts in enumerate(found)]
    if whole is not None:
        results.insert(0, (whole, 0, 1))
    if any(contacts.slices is not None for contacts, _, _ in results):
        raise ValueError("found: results of many worlds; give those of each world by itself")
    return found[0] if len(results) == parts == 1 else contacts_of_step(results)


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
