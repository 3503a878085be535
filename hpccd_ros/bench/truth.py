# SPDX-License-Identifier: Apache-2.0
"""Reported pairs compared with the true ones: false negatives, false positives, errors of times or distances."""

from __future__ import annotations

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Errors:
    """missed, invented: numbers of false negatives and false positives. toc_worst, toc_p99: of |toc - true toc| over
    true pairs that were found, 0 if there are none; latest: of toc - true toc; earliest: of true toc - toc. The same
    for distances, relative to the size of the scene or query."""

    true: int
    missed: int
    invented: int
    toc_worst: float
    toc_p99: float
    latest: float
    earliest: float


def of_scene(found, truth: dict[str, np.ndarray], value: str = "toc", size: float = 1.0) -> Errors:
    """found: hpccd_core.Contacts; truth: {"vf", "vf_toc", "ee", "ee_toc"} in any order. Proximity: value="distance",
    and the size of the scene. Intersections: {"ef"}."""
    missed = invented = 0
    off = [np.empty(0)]
    kinds = [kind for kind in ("vf", "ee", "ef") if kind in truth]
    for kind in kinds:
        there, here = _keys(getattr(found, kind)), _keys(truth[kind])
        common, i, j = np.intersect1d(there, here, assume_unique=True, return_indices=True)
        missed += len(here) - len(common)
        invented += len(there) - len(common)
        if f"{kind}_{value}" in truth:
            off.append((getattr(found, f"{kind}_{value}")[i] - truth[f"{kind}_{value}"][j]) / size)
    return errors(sum(len(truth[kind]) for kind in kinds), missed, invented, np.concatenate(off))


def of_one(found, truth: dict[str, np.ndarray], earliest: bool) -> Errors:
    """Errors of a result that must contain one contact, the earliest or any, if there is one. Missed: it has none;
    times: of the earliest one, or of the reported one."""
    of_named = of_scene(found, truth)
    true = np.concatenate([toc for key, toc in truth.items() if key.endswith("_toc")])
    there, missed = min(1, len(true)), int(len(true) > 0 and len(found) == 0)
    if not earliest:
        return dataclasses.replace(of_named, true=there, missed=missed)
    late = np.array([found.first_toc - true.min()] if there and not missed else [])
    return errors(there, missed, of_named.invented, late)


def errors(true, missed, invented, late):
    off = np.abs(late)
    worst, p99 = (float(off.max()), float(np.percentile(off, 99))) if len(off) else (0.0, 0.0)
    latest, earliest = float(late.max(initial=0.0)), float((-late).max(initial=0.0))
    return Errors(true, missed, invented, worst, p99, latest, earliest)


def _keys(pairs):
    rows = np.ascontiguousarray(pairs, np.uint32)
    return rows.view([("", np.uint32)] * rows.shape[1]).ravel()
