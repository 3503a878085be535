# SPDX-License-Identifier: Apache-2.0
"""Fuzz detection on coarse meshes: every contact of the full meshes has a pair of the two coarse faces in time.

A scene is two small bodies; many lie side by side in one call, as components of two meshes. `python -m fuzz.detail`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

import hpccd_core as hc


def bodies(rng, n, far):
    """n bodies of one kind, `far` apart: vertices (n, V, 3) around the origin of each, and the faces of one."""
    kind = rng.integers(3)
    if kind == 0:
        vertices, faces = hc.shapes.grid(*rng.integers(2, 5, 2))
    elif kind == 1:
        vertices, faces = hc.shapes.icosphere(int(rng.integers(1, 3)))
    else:
        vertices, faces = hc.shapes.box(tuple(rng.random(3) + 0.2))
    vertices = np.asarray(vertices, float) / np.abs(vertices).max() * 0.5
    x = np.repeat(vertices[None], n, axis=0) + rng.normal(size=(n, len(vertices), 3)) * rng.choice([0, 0.01, 0.1])
    turns = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    if rng.random() < 0.3:  # on a lattice: exact touching, coplanar faces, vertices on edges
        turns = np.broadcast_to(np.eye(3), turns.shape)
        x = np.round(x * 8) / 8
    return np.einsum("nij,nvj->nvi", turns, x), np.asarray(faces)


def batch(rng, n, tally):
    """Detects n scenes in one call and checks them. Returns failures as text."""
    far = 8.0
    places = far * np.stack(np.unravel_index(np.arange(n), (int(np.ceil(n ** (1 / 3))) + 1,) * 3), axis=1)
    scene, starts, ends = hc.Scene(), [], []
    thickness = float(rng.choice([0, 0, 0.02]))
    for name in ("a", "b"):
        x, faces = bodies(rng, n, far)
        shift = np.round(rng.normal(size=(n, 1, 3)) * 0.7 * 8) / 8
        move = rng.normal(size=(n, 1, 3)) * 0.5 + rng.normal(size=x.shape) * rng.choice([0, 0.05, 0.3])
        if rng.random() < 0.3:
            move = np.round(move * 8) / 8
        start = x + shift + places[:, None]
        starts.append(start.reshape(-1, 3)), ends.append((start + move).reshape(-1, 3))
        each = (faces[None] + x.shape[1] * np.arange(n)[:, None, None]).reshape(-1, 3)
        of_faces = rng.random(len(each)) * thickness if rng.random() < 0.5 else thickness
        scene.add_mesh(name, each, n_vertices=n * x.shape[1], self_collision=False, thickness=of_faces)
    dtype = rng.choice([np.float32, np.float64])
    start, end = (np.concatenate(x).astype(dtype) for x in (starts, ends))
    options = {"minimum_separation": float(rng.choice([0, 0.0625])), "threads": 1, "backend": "cpu"}
    options["accuracy"] = str(rng.choice(["exact", "conservative"]))
    ratio = float(rng.choice([0.1, 0.25, 0.5]))
    detail = ratio if rng.random() < 0.7 else {"a": {"error": float(rng.choice([0, 0.05, 0.3]))}, "b": ratio}
    detector = hc.Detector(scene, detail=detail, **options)
    found, true = detector.detect(start, end), hc.Detector(scene, **options).detect(start, end)
    tally["contacts"] += len(true)
    tally["rows"] += len(found)
    tally["crossing"] += len(found.ef)
    tally["coarse"] += len(detector.faces)
    tally["faces"] += scene.n_faces
    return late_pairs(scene, detector, found, true)


def late_pairs(scene, detector, found, true):
    """Contacts of the full meshes for which no pair of features of their coarse faces is reported in time."""
    core = detector._core
    held = []
    for mesh, level in zip(core.meshes, core._last.levels, strict=True):
        n = len(mesh.faces)
        pairs = np.repeat(np.arange(n), 2).reshape(-1, 2) if level is None else level.held.astype(np.int64)
        held.append(pairs + [core._last.face_slices[mesh.number].start, scene.face_offset(mesh.number)])
    held = np.concatenate(held)
    coarse, full = np.asarray(detector.faces), hc.Detector(scene, threads=1, backend="cpu").faces
    n_coarse = len(coarse)
    # The pairs of coarse faces of each row, and their earliest time.
    vertex, edge = Lists.of_vertices(coarse), Lists.of_edges(coarse)
    reported = [
        joined(vertex[found.vf[:, 0]], single(found.vf[:, 1]), found.vf_toc),
        joined(edge[keys(found.ee[:, :2])], edge[keys(found.ee[:, 2:])], found.ee_toc),
        joined(edge[keys(found.ef[:, :2])], single(found.ef[:, 2]), np.zeros(len(found.ef))),
    ]
    p, q, toc = (np.concatenate(x) for x in zip(*reported, strict=True))
    earliest = Earliest(np.minimum(p, q) * n_coarse + np.maximum(p, q), toc)
    # The pairs of coarse faces that hold each contact of two full faces.
    vertex, edge = Lists.of_vertices(full), Lists.of_edges(full)
    contacts = [
        joined(vertex[true.vf[:, 0]], single(true.vf[:, 1]), true.vf_toc),
        joined(edge[keys(true.ee[:, :2])], edge[keys(true.ee[:, 2:])], true.ee_toc),
    ]
    f, g, toc = (np.concatenate(x) for x in zip(*contacts, strict=True))
    holders = Lists(held[:, 1], held[:, 0])
    p, q, contact = joined(holders[f], holders[g], np.arange(len(f)))
    of_pair = earliest[np.minimum(p, q) * n_coarse + np.maximum(p, q)]
    first = np.full(len(f), np.inf)
    np.minimum.at(first, contact, of_pair)
    late = np.flatnonzero(first > toc + 1e-12)
    return [f"faces {f[i]} and {g[i]} touch at {toc[i]!r}, reported at {first[i]!r}" for i in late[:3]]


def keys(edges):
    low, high = edges.min(axis=1).astype(np.int64), edges.max(axis=1).astype(np.int64)
    return low << 32 | high


class Lists:
    """Values by key; lists[keys] are the values of each key: (row of the key, value)."""

    def __init__(self, key, value):
        order = np.argsort(key, kind="stable")
        self.key, self.value = np.asarray(key)[order], np.asarray(value)[order]

    @classmethod
    def of_vertices(cls, faces):
        return cls(faces.ravel().astype(np.int64), np.repeat(np.arange(len(faces)), 3))

    @classmethod
    def of_edges(cls, faces):
        sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        return cls(keys(sides), np.tile(np.arange(len(faces)), 3))

    def __getitem__(self, wanted):
        wanted = np.asarray(wanted, np.int64)
        begin, end = (np.searchsorted(self.key, wanted, side) for side in ("left", "right"))
        count = end - begin
        row = np.repeat(np.arange(len(wanted)), count)
        at = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(begin, count)
        return row, self.value[at]


def single(values):
    return np.arange(len(values)), np.asarray(values, np.int64)


def joined(a, b, value):
    """All pairs of the values of both sides of each row, with the value of the row."""
    (row_a, value_a), (row_b, value_b) = a, b
    row, other = Lists(row_b, value_b)[row_a]
    return value_a[row], other, np.asarray(value)[row_a[row]]


class Earliest:
    """The least value of each key, infinite for others."""

    def __init__(self, key, value):
        order = np.lexsort((value, key))
        self.key, first = np.unique(np.asarray(key)[order], return_index=True)
        self.value = np.asarray(value, float)[order][first]

    def __getitem__(self, wanted):
        if not len(self.key):
            return np.full(len(wanted), np.inf)
        at = np.minimum(np.searchsorted(self.key, wanted), len(self.key) - 1)
        return np.where(self.key[at] == wanted, self.value[at], np.inf)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m fuzz.detail", description=__doc__)
    parser.add_argument("--count", type=int, default=100_000, help="scenes")
    parser.add_argument("--batch", type=int, default=2000, help="scenes in one call")
    parser.add_argument("--seed", type=int, default=0)
    a = parser.parse_args(arguments)
    tally = dict.fromkeys(("contacts", "rows", "crossing", "coarse", "faces"), 0)
    done, number, failures, began = 0, 0, 0, time.monotonic()
    while done < a.count:
        late = batch(np.random.default_rng([a.seed, number]), a.batch, tally)
        failures += len(late)
        for text in late:
            print(f"seed {a.seed}, batch {number} of {a.batch}: {text}", flush=True)
        done, number = done + a.batch, number + 1
        if number % 100 == 0:
            print(f"{done:,} scenes, {time.monotonic() - began:.0f} s, {failures} failures, {tally}", flush=True)
    print(f"{done:,} scenes in {time.monotonic() - began:.0f} s, {failures} failures, {tally}")
    return 1 if failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
