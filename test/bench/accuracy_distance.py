# SPDX-License-Identifier: Apache-2.0
"""Errors of each tier in distance queries: compared with the truth in HPCCD_DATA/distance, and with rational arithmetic
on hard queries as `make fuzz` generates them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from fuzz import questions
from fuzz.questions import INTERSECTIONS, PROXIMITY, SEPARATION, Batch
from fuzz.snapshots import EDGE_FACE

from bench import accuracy_sweep
from bench.distance import Question
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import measure, truth
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.sources import Source, Step, of_npz

QUESTIONS = (SEPARATION, PROXIMITY, INTERSECTIONS)
# Keys of a file of truth: which queries it covers, and the name of their value.
KEYS = dict.fromkeys(("s", "s2", "s3"), ("separation", "toc"))
KEYS |= dict.fromkeys(("p", "p2"), ("proximity", "distance")) | {"x": ("intersections", "")}
SINGLE = "queries.npz"


def scenes(folder: Path) -> list[tuple[Source, dict[str, np.ndarray]]]:
    """Each scene with its truth. A file NAME-distance.npz has its motion in NAME.npz above the folder."""
    found = []
    for path in sorted(folder.glob("*.npz")):
        if path.name == SINGLE:
            continue
        with np.load(path, allow_pickle=False) as archive:
            known = {key: archive[key] for key in archive.files}
        motion = path if "faces" in known else folder.parent / f"{path.stem.removesuffix('-distance')}.npz"
        if not motion.is_file():
            raise UserError(f"{path}: has no faces, and there is no {motion} with its motion")
        found.append((of_npz(motion), known))
    return found


def on_scene(source: Source, known: dict, variants: dict[str, dict], rounds: int) -> Iterator[dict]:
    """Rows {"scene", "query", "distance", "variant", ...}: each query that the truth covers, for each detector's
    options, timed in turn."""
    step = source.step(0)
    for key, (query, value) in KEYS.items():
        kinds = ("vf", "ee", "ef", f"vf_{value}", f"ee_{value}")
        true = {kind: known[f"{key}_{kind}"] for kind in kinds if f"{key}_{kind}" in known}
        if not true:
            continue
        question = Question(query, float(known[f"{key}_d"]) if f"{key}_d" in known else None)
        of = {name: question.runner(options, name=name) for name, options in variants.items()}
        series = measure.measure(source, list(of.values()), rounds)
        for name, variant in of.items():
            found = question.ask(variant.detector(step), step)
            errors = truth.of_scene(found, true, value, _size(step) if query == "proximity" else 1.0)
            yield {
                **{"scene": source.name, "query": query, "distance": question.distance, "variant": name},
                **{"triangles": step.triangles, "true": errors.true, "missed": errors.missed},
                **{"invented": errors.invented, "value_worst": errors.toc_worst, "latest": errors.latest},
                **series[name].times(),
            }


def hard(tiers: list[str], n: int, seed: int, folder: Path | None) -> Iterator[dict]:
    """Rows {"query", "generator", "accuracy", ...}: n queries of each kind from each generator, and the single queries
    of the folder, whose truth is known."""
    for question in QUESTIONS:
        rows = accuracy_sweep.adversarial(tiers, n, seed, question) if n else []
        if folder and (folder / SINGLE).is_file():
            rows += [{"generator": SINGLE, **row} for row in accuracy_sweep.ask(*_singles(folder, question, tiers))]
        for row in rows:
            row["value_worst"] = row.pop("toc_worst")
            yield {"query": question, **row}


def _singles(folder: Path, question: str, tiers: list[str]):
    """The arguments of accuracy_sweep.ask for the file of single queries."""
    batches, known = [], []
    with np.load(folder / SINGLE, allow_pickle=False) as file:
        for kind in questions.kinds_of(question):
            short = "".join(word[0] for word in kind.split("-"))
            prefix = {SEPARATION: f"{short}_", PROXIMITY: f"p_{short}_", INTERSECTIONS: "x_"}[question]
            queries, hit = file[prefix + "q"], file[prefix + "hit"]
            none = np.zeros(len(queries))
            distances = none if kind == EDGE_FACE else file[prefix + "d"]
            value = {SEPARATION: "toc", PROXIMITY: "distance", INTERSECTIONS: "hit"}[question]
            batches.append(Batch(question, kind, SINGLE, queries, distances))
            known.append((hit, none if kind == EDGE_FACE else file[prefix + value]))
    return batches, tiers, known


def _size(step: Step) -> float:
    return float(max(np.abs(step.vertices_t0).max(), np.abs(step.vertices_t1).max()))


def show(of_scenes: list[dict], of_queries: list[dict], tiers: list[str]) -> None:
    if of_scenes:
        columns = {"scene": "scene", "query": "query"}
        columns["d"] = lambda row: "" if row["distance"] is None else f"{row['distance']:g}"
        columns |= {key: key for key in ("backend", "simd", "accuracy")} | {"ms": "step_ms"}
        columns |= {key: key for key in ("true", "missed", "invented")} | {"worst": "value_worst"}
        worst = "worst: error of toc (the step is 1) or of the distance (the largest coordinate is 1)"
        tables.show("distance queries on whole scenes", columns, of_scenes, worst)
    lines: dict = {}
    for row in of_queries:
        line = lines.setdefault((row["query"], row["generator"]), dict(row))
        line[row["accuracy"]] = f"{row['missed']} + {row['invented']}"
    if lines:
        columns = {"query": "query", "generator": "generator", "queries": "n", "true": "true"}
        title = "hard distance queries: missed + invented of all (rational arithmetic is the truth)"
        tables.show(title, columns | {tier: tier for tier in tiers}, lines.values())
