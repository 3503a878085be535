# SPDX-License-Identifier: Apache-2.0
"""Winding numbers, signed distances, separating translations, depth and points of intersections, by the core and by the
oracle."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

import numpy as np
import oracle

import hpccd_core as hc

from .solid_scenes import DEPTH_SCENES, TRANSLATION_SCENES, WINDING_SCENES, Meshes

Results = tuple[np.ndarray, np.ndarray]
Ask = Callable[[np.ndarray, np.ndarray], Results]
TOLERANCE = 1e-12  # of distances, relative to the largest coordinate


def true_windings(kind: str, queries: np.ndarray, threads: int) -> Results:
    """hit: on the surface or inside; value: a positive number that stands for both results."""
    faces = WINDING_SCENES[kind].faces[0]
    return _of_groups(
        queries, faces, lambda vertices, points: oracle.winding_numbers((vertices, faces), points, threads)
    )


def core_windings(kind: str, queries: np.ndarray, accuracy: str, simd: str) -> Results:
    scene = WINDING_SCENES[kind]
    detector = _detector(kind, accuracy, simd)
    ask = lambda vertices, points: detector.winding_numbers(vertices, points, "mesh0")  # noqa: E731
    return _of_groups(queries, scene.faces[0], ask)


def _of_groups(queries: np.ndarray, faces: np.ndarray, ask: Ask) -> Results:
    hit, value = np.zeros(len(queries), bool), np.zeros(len(queries))
    for rows, vertices, points in _groups(queries):
        numbers, on_surface = ask(vertices, points)
        hit[rows] = on_surface | (numbers != 0)
        value[rows] = numbers + len(faces) + 1000.0 * on_surface
    return hit, value


def _groups(queries: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Rows with the same vertices, which are asked together; their vertices and points."""
    changes = (queries[1:, :-1] != queries[:-1, :-1]).any(axis=(1, 2))
    for rows in np.split(np.arange(len(queries)), np.flatnonzero(changes) + 1):
        yield rows, np.ascontiguousarray(queries[rows[0], :-1]), np.ascontiguousarray(queries[rows, -1])


def true_signed_distances(kind: str, queries: np.ndarray, threads: int) -> Results:
    """Two columns. hit: negative or 0; value: the distance, and that of the reported face."""
    faces = WINDING_SCENES[kind].faces[0]
    hit, value = np.zeros(len(queries), bool), np.zeros(len(queries))
    for rows, vertices, points in _groups(queries):
        numbers, on_surface = oracle.winding_numbers((vertices, faces), points, threads)
        hit[rows] = on_surface | (numbers != 0)
        value[rows] = _distances(points[:, None], vertices[faces][None], threads).min(axis=1)
    return np.column_stack([hit, hit]), np.column_stack([value, value])


def core_signed_distances(kind: str, queries: np.ndarray, accuracy: str, simd: str) -> Results:
    faces, detector = WINDING_SCENES[kind].faces[0], _detector(kind, accuracy, simd)
    hit, value = np.zeros((len(queries), 2), bool), np.zeros((len(queries), 2))
    for rows, vertices, points in _groups(queries):
        found = detector.signed_distances(vertices, points, "mesh0")
        hit[rows] = (found.distance <= 0)[:, None]
        value[rows, 0] = np.abs(found.distance)
        value[rows, 1] = _distances(points, vertices[faces[found.faces]])
        size = max(np.abs(vertices).max(), np.finfo(float).tiny)
        apart = np.abs(found.closest - points).max(axis=1) <= value[rows, 0] + TOLERANCE * size
        near = _distances(found.closest, vertices[faces[found.faces]]) <= TOLERANCE * size
        value[rows, 1] = np.where(apart & near, value[rows, 1], np.inf)
    return hit, value


def _distances(points: np.ndarray, corners: np.ndarray, threads: int = 1) -> np.ndarray:
    shape = np.broadcast_shapes(points.shape[:-1], corners.shape[:-2])
    points = np.broadcast_to(points, (*shape, 3))[..., None, :]
    both = np.concatenate([points, np.broadcast_to(corners, (*shape, 3, 3))], axis=-2)
    return oracle.distance_vertex_face(both.reshape(-1, 4, 3), threads).reshape(shape)


def true_translations(kind: str, queries: np.ndarray, threads: int) -> Results:
    """hit: not free at the start."""
    scene = TRANSLATION_SCENES[kind]
    pairs = [tuple(zip(_split(scene, q[:-1]), scene.faces, strict=True)) for q in queries]
    value = oracle.separating_translations(pairs, queries[:, -1], threads)
    return value > 0, value


def core_translations(kind: str, queries: np.ndarray, accuracy: str, simd: str) -> Results:
    detector = _detector(kind, accuracy, simd)
    value = np.array([detector.separating_translation(q[:-1], "mesh0", "mesh1", q[-1]) for q in queries])
    return value > 0, value


def true_points(queries: np.ndarray, threads: int) -> Results:
    """(Q,5): edge parameter, barycentric coordinates, and how far the point is from the true one (0)."""
    parameters, weights, _ = oracle.edge_face_points(queries, threads)
    hit = np.isfinite(parameters)
    value = np.column_stack([parameters, weights, np.zeros(len(queries))])
    return np.repeat(hit[:, None], 5, axis=1), np.where(np.isfinite(value) & hit[:, None], value, 0.0)


def core_points(queries: np.ndarray, accuracy: str, simd: str) -> Results:
    detector = _edge_and_face(accuracy, simd)
    parameters, weights, places = oracle.edge_face_points(queries)
    size = np.maximum(np.abs(queries).max(axis=(1, 2)), np.finfo(float).tiny)
    hit, value = np.zeros((len(queries), 5), bool), np.zeros((len(queries), 5))
    for i, points in enumerate(queries):
        found = detector.intersections(points)
        rows = np.flatnonzero((found.ef == (0, 1, 1)).all(axis=1))
        if len(rows):
            k = rows[0]
            hit[i] = True
            flat = np.isnan(weights[i]).any()
            error = np.abs(found.points[k] - places[i]).max() / size[i]
            value[i] = found.edge_parameters[k], *(np.zeros(3) if flat else found.weights[k]), np.nan_to_num(error)
    return hit, value


def true_depths(kind: str, queries: np.ndarray, threads: int) -> Results:
    scene = DEPTH_SCENES[kind]
    value = oracle.convex_depths(
        [tuple(zip(_split(scene, q), scene.faces, strict=True)) for q in queries], threads
    )  # fmt: skip
    return value > 0, value


def core_depths(kind: str, queries: np.ndarray, accuracy: str, simd: str) -> Results:
    detector = _detector(kind, accuracy, simd)
    value = np.array([detector.penetration(q, "mesh0", "mesh1").depth for q in queries])
    return value > 0, value


def break_promises(kind: str, queries: np.ndarray, accuracy: str, simd: str, true_depth: np.ndarray) -> np.ndarray:
    """Mask of the pairs that are not free after the translation, whose depth is not its length, or whose lower bound is
    above the true depth."""
    detector, scene = _detector(kind, accuracy, simd), DEPTH_SCENES[kind]
    first = len(scene.rest[0])
    broken = np.zeros(len(queries), bool)
    for i, (q, depth) in enumerate(zip(queries, true_depth, strict=True)):
        found = detector.penetration(q, "mesh0", "mesh1")
        length = np.linalg.norm(found.translation)
        moved = np.concatenate([q[:first] + found.translation, q[first:]])
        free = not len(
            oracle.intersections(moved, scene.faces, no_self_collision=[0, 1], threads=1)
        ) and not oracle.contained(list(zip(_split(scene, moved), scene.faces, strict=True)), 1).any()  # fmt: skip
        size = np.abs(q).max()
        within = abs(found.depth - length) <= 1e-15 * size and found.lower_bound <= depth + 1e-15 * size
        broken[i] = not (free and within)
    return broken


def _split(scene: Meshes, points: np.ndarray) -> list[np.ndarray]:
    return np.split(points, scene.ends[:-1])


@functools.cache
def _detector(kind: str, accuracy: str, simd: str) -> hc.Detector:
    scene = hc.Scene()
    scenes = {**WINDING_SCENES, **TRANSLATION_SCENES, **DEPTH_SCENES}
    for number, (faces, rest) in enumerate(zip(*scenes[kind], strict=True)):
        scene.add_mesh(f"mesh{number}", faces, n_vertices=len(rest))
    return hc.Detector(scene, accuracy=accuracy, simd=simd, backend="cpu", threads=1)


@functools.cache
def _edge_and_face(accuracy: str, simd: str) -> hc.Detector:
    scene = hc.Scene()
    scene.add_mesh("edge", [[0, 1, 1]], n_vertices=2)
    scene.add_mesh("face", [[0, 1, 2]], n_vertices=3)
    return hc.Detector(scene, accuracy=accuracy, simd=simd, backend="cpu", threads=1, outputs=("points",))
