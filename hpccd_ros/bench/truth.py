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


def of_pairs_of_meshes(found, truth: dict[str, np.ndarray], mesh_of_vertex, faces, found_faces) -> Errors:
    """Errors of a result that must name the pairs of different meshes that touch. Times: the first of each pair.

    faces (F,3), found_faces: to which the rows of the truth and of the result refer, in scene-wide vertices.
    """
    there = _first_of_meshes(truth, mesh_of_vertex, faces)
    rows = {f"{kind}{end}": getattr(found, kind + end, ()) for kind in ("vf", "ee") for end in ("", "_toc")}
    here = _first_of_meshes({**rows, "ef": getattr(found, "ef", ())}, mesh_of_vertex, found_faces)
    late = np.array([here[pair] - there[pair] for pair in sorted(there.keys() & here.keys())])
    return errors(len(there), len(there.keys() - here.keys()), len(here.keys() - there.keys()), late)


def _first_of_meshes(rows, mesh_of_vertex, faces) -> dict[tuple[int, int], float]:
    """By pair of different meshes, the first time. Faces that an edge intersects at the start are there at time 0."""
    first: dict[tuple[int, int], float] = {}
    for kind, second in (
        ("vf", lambda r: faces[r[:, 1], 0]),
        ("ee", lambda r: r[:, 2]),
        ("ef", lambda r: faces[r[:, 2], 0]),
    ):
        of_kind = np.asarray(rows.get(kind, ()), np.int64)
        if not len(of_kind):
            continue
        pairs = np.sort(np.stack([mesh_of_vertex[of_kind[:, 0]], mesh_of_vertex[second(of_kind)]], 1), axis=1)
        toc = np.zeros(len(pairs)) if kind == "ef" else np.asarray(rows[f"{kind}_toc"])
        named, which = np.unique(pairs, axis=0, return_inverse=True)
        least = np.full(len(named), np.inf)
        np.minimum.at(least, which.ravel(), toc)
        for (a, b), t in zip(named.tolist(), least.tolist(), strict=True):
            if a != b:
                first[a, b] = min(t, first.get((a, b), np.inf))
    return first


def errors(true, missed, invented, late):
    off = np.abs(late)
    worst, p99 = (float(off.max()), float(np.percentile(off, 99))) if len(off) else (0.0, 0.0)
    latest, earliest = float(late.max(initial=0.0)), float((-late).max(initial=0.0))
    return Errors(true, missed, invented, worst, p99, latest, earliest)


def _keys(pairs):
    rows = np.ascontiguousarray(pairs, np.uint32)
    return rows.view([("", np.uint32)] * rows.shape[1]).ravel()
