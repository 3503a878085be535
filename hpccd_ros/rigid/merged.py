# SPDX-License-Identifier: Apache-2.0
"""The answers about the parts of a step as one answer about the step."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc

_EDGE_EDGE_SALT = 0x9E3779B97F4A7C15  # of hpccd_core/src/contacts/hash.h, as all numbers of _mixed


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
    if len(answers) == parts == 1:
        return found[0]
    vf = np.concatenate([contacts.vf for contacts, _, _ in answers])
    ee = np.concatenate([contacts.ee for contacts, _, _ in answers])
    vf_toc = np.concatenate([(part + contacts.vf_toc) / of for contacts, part, of in answers])
    ee_toc = np.concatenate([(part + contacts.ee_toc) / of for contacts, part, of in answers])
    vf_rows = _first_of_each(vf)
    ee_rows = _first_of_each(ee)

    def places(name: str) -> NDArray[np.float64]:
        arrays = [(getattr(contacts, name), len(contacts.vf)) for contacts, _, _ in answers]
        if not any(len(array) for array, _ in arrays):
            return arrays[0][0]  # not asked for, or no contacts
        of_vf = np.concatenate([array[:n] for array, n in arrays])
        of_ee = np.concatenate([array[n:] for array, n in arrays])
        return np.concatenate([of_vf[vf_rows], of_ee[ee_rows]])

    vf, vf_toc, ee, ee_toc = vf[vf_rows], vf_toc[vf_rows], ee[ee_rows], ee_toc[ee_rows]
    return hc.Contacts(
        vf=vf,
        vf_toc=vf_toc,
        ee=ee,
        ee_toc=ee_toc,
        points=places("points"),
        normals=places("normals"),
        closest=places("closest"),
        first_toc=min(float(toc.min()) if len(toc) else np.inf for toc in (vf_toc, ee_toc)),
        hash=contacts_hash(vf, vf_toc, ee, ee_toc),
    )


def earliest(contacts: hc.Contacts) -> hc.Contacts:
    """Those at first_toc alone, as a detector that reports "first" gives them."""
    of_vf, of_ee = (np.flatnonzero(toc == contacts.first_toc) for toc in (contacts.vf_toc, contacts.ee_toc))
    rows = np.concatenate([of_vf, len(contacts.vf) + of_ee])
    places = {
        name: values[rows] if len(values := getattr(contacts, name)) else values
        for name in ("points", "normals", "closest")
    }
    vf, vf_toc, ee, ee_toc = contacts.vf[of_vf], contacts.vf_toc[of_vf], contacts.ee[of_ee], contacts.ee_toc[of_ee]
    first, hashed = contacts.first_toc, contacts_hash(vf, vf_toc, ee, ee_toc)
    return hc.Contacts(vf=vf, vf_toc=vf_toc, ee=ee, ee_toc=ee_toc, **places, first_toc=first, hash=hashed)


def contacts_hash(
    vf: NDArray[np.uint32], vf_toc: NDArray[np.float64], ee: NDArray[np.uint32], ee_toc: NDArray[np.float64]
) -> int:
    """What the core gives for these contacts of one world: a sum over them, modulo 2**64."""
    of_vf = _hashes(vf[:, 0].astype(np.uint64), vf[:, 1].astype(np.uint64), vf_toc, 1)
    of_ee = _hashes(_packed(ee[:, :2]), _packed(ee[:, 2:]), ee_toc, _EDGE_EDGE_SALT)
    return (int(of_vf.sum(dtype=np.uint64)) + int(of_ee.sum(dtype=np.uint64))) % 2**64


def _first_of_each(pairs: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Rows of the first occurrence of each pair, in lexicographic order of the pairs."""
    keys = [_packed(pairs[:, k : k + 2]) for k in range(0, pairs.shape[1], 2)]
    order = np.lexsort(keys[::-1])  # stable: of equal pairs the first stays first
    new = np.zeros(len(pairs), bool)
    new[:1] = True
    for key in keys:
        ordered = key[order]
        new[1:] |= ordered[1:] != ordered[:-1]
    return order[new]


def _packed(edges: NDArray[np.uint32]) -> NDArray[np.uint64]:
    return (edges[:, 0].astype(np.uint64) << np.uint64(32)) | edges[:, 1].astype(np.uint64)


def _hashes(a: NDArray[np.uint64], b: NDArray[np.uint64], toc: NDArray[np.float64], salt: int) -> NDArray[np.uint64]:
    bits = np.ascontiguousarray(toc, np.float64).view(np.uint64)
    return _mixed(_mixed(_mixed(a + np.uint64(salt)) ^ b) ^ bits)


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    x = (x ^ (x >> np.uint64(33))) * np.uint64(0xFF51AFD7ED558CCD)
    x = (x ^ (x >> np.uint64(33))) * np.uint64(0xC4CEB9FE1A85EC53)
    return x ^ (x >> np.uint64(33))
