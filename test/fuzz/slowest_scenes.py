# SPDX-License-Identifier: Apache-2.0
"""Search for scenes that take long for their size: `python -m fuzz.slowest_scenes --help`."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

import hpccd_core as hc

from .step_scenes import grid

SHAPES = ("grid", "bars", "fan", "dome", "points", "bodies")
QUERIES = ("detect", "separation", "free_step", "proximity", "intersections", "distances")
TURNS = ("none", "octant", "any")
PARSER = argparse.ArgumentParser(
    prog="python -m fuzz.slowest_scenes",
    formatter_class=argparse.RawDescriptionHelpFormatter,
    description="Search for scenes that take long for their size, by mutating the slowest ones found so far.",
    epilog="""\
A scene has a few meshes: grids, bundles of bars, fans (triangles around one vertex), domes (spheres), single points or
many small bodies. Each is squeezed along an axis, rotated, scaled and shifted. Meshes may be stacked, nested or far
apart, rest at the separation, or fall; a scene may have several worlds, and one vertex far away. The search mutates
these numbers.

The cost of a scene is the CPU time of one query on one thread, divided by the number of features (vertices, edges and
triangles) plus results, relative to a cloth over a ball of the same size. Ordinary scenes cost 0.3 to 3; a cost of 10
or more deserves a look. Results count like features, so a scene is not slow just because it has many; for a cancelled
query (--most) their number is unknown.

Examples:
  python -m fuzz.slowest_scenes --seconds 300 --query proximity
  python -m fuzz.slowest_scenes --seconds 60 --save slowest.json
  python -m fuzz.slowest_scenes --again slowest.json     # measure the saved scenes again
""",
)
PARSER.add_argument("--seconds", type=float, default=60.0, help="how long to search (default 60)")
PARSER.add_argument("--query", choices=(*QUERIES, "all"), default="all", help="which query to slow down (default all)")
PARSER.add_argument("--triangles", type=int, default=1500, help="triangles in each scene, about (default 1500)")
PARSER.add_argument("--keep", type=int, default=8, help="number of slowest scenes to keep for each query (default 8)")
PARSER.add_argument("--most", type=float, default=3.0, help="seconds after which a query is cancelled (default 3)")
PARSER.add_argument("--seed", type=int, default=0, help="random seed; runs still differ, because times do (default 0)")
PARSER.add_argument("--save", type=Path, help="write the slowest scenes of each query to this .json file")
PARSER.add_argument("--again", type=Path, help="measure the scenes of this .json file of --save; do not search")


@dataclass
class Part:
    """One mesh of a scene. Lengths are in units of the first mesh's size."""

    shape: str = "grid"
    share: float = 1.0  # of the scene's triangles
    scale: float = 0.0  # log10 of its size
    squeezed: float = 0.0  # log10 of the factor along its z axis
    turn: str = "none"
    direction: tuple[float, float, float] = (1.0, 1.0, 1.0)  # of its z axis after the rotation
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    distance: float = 0.0  # log10 of a factor of the shift
    rough: float = 0.0  # noise, relative to the spacing of its vertices
    self_collision: bool = True


@dataclass
class Shape:
    """A scene as the numbers that the search mutates."""

    parts: list[Part] = dataclasses.field(default_factory=lambda: [Part()])
    far: float = 0.0  # log10 of the distance of one vertex far away; 0: there is none
    fall: float = -2.0  # log10 of the last part's displacement
    separation: float = -2.0  # log10 of the separation or distance
    at_rest: bool = False  # the last part lies on the others at the separation
    worlds: int = 1


def triangles_of(part: Part, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faces, further edges, and positions of size 1, of about n triangles."""
    faces, edges = np.empty((0, 3), int), np.empty((0, 2), int)
    side = max(2, round(np.sqrt(n / 2)) + 1)
    if part.shape == "grid":
        faces, x = grid(side, side)
        x = x / (side - 1)
    elif part.shape == "dome":
        faces, x = grid(side, side)
        # Open at the poles and along one meridian: nearly coincident vertices would be slow in any scene.
        u, v = np.pi * (0.96 * x[:, 1] / (side - 1) + 0.5), 1.98 * np.pi * x[:, 0] / (side - 1)
        x = 0.5 * np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], 1)
    elif part.shape == "fan":
        angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
        rim = np.arange(1, n + 1)
        faces = np.stack([0 * rim, rim, np.roll(rim, -1)], 1)
        x = np.concatenate([[[0, 0, 0.0]], 0.5 * np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(7 * angle)], 1)])
    elif part.shape == "bars":
        m = max(2, round(np.sqrt(n)))
        i, j = np.divmod(np.arange(m * m), m)
        low = np.stack([i / m, j / m, 0.0 * i], 1) - [0.5, 0.5, 0.5]
        x = np.stack([low, low + [0, 0, 1]], 1).reshape(-1, 3)
        edges = np.arange(2 * m * m).reshape(-1, 2)
    elif part.shape == "points":
        x = rng.uniform(-0.5, 0.5, (n, 3))
    else:
        m = max(1, n // 4)
        body = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.3 / np.cbrt(m)
        x = (rng.uniform(-0.5, 0.5, (m, 1, 3)) + body).reshape(-1, 3)
        faces = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])
        faces = (faces + 4 * np.arange(m)[:, None, None]).reshape(-1, 3)
    return faces, edges, x + part.rough * rng.normal(size=x.shape) / side


def turned(x: np.ndarray, part: Part) -> np.ndarray:
    if part.turn == "none":
        return x
    z = np.sign(part.direction) + (np.array(part.direction) == 0) if part.turn == "octant" else np.array(part.direction)
    z = z / (np.linalg.norm(z) or 1.0) if np.any(z) else np.array([0.0, 0.0, 1.0])
    y = np.cross(z, [0.3, 0.5, 0.8] if abs(z @ [0.3, 0.5, 0.8]) < 0.9 else [0.8, -0.5, 0.3])
    y /= np.linalg.norm(y)
    return np.asarray(x @ np.stack([np.cross(y, z), y, z]))


@dataclass
class Case:
    """A scene and the two ends of its step."""

    scene: hc.Scene
    start: np.ndarray
    end: np.ndarray
    separation: float
    worlds: int
    n_features: int


def case_of(shape: Shape, triangles: int) -> Case:
    rng = np.random.default_rng(1)
    scene, n_features = hc.Scene(), 0
    places: list[np.ndarray] = []
    shares = sum(p.share for p in shape.parts)
    separation = 10**shape.separation
    for i, part in enumerate(shape.parts):
        n = max(4, int(triangles * part.share / shares / shape.worlds))
        faces, edges, x = triangles_of(part, n, rng)
        x = turned(x * [1, 1, 10**part.squeezed], part) * 10**part.scale
        x = x + np.array(part.shift) * (10**part.distance if part.distance else 1.0)
        if shape.at_rest and i and i == len(shape.parts) - 1:
            x[:, 2] += max(p[:, 2].max() for p in places) + separation - x[:, 2].min()
        scene.add_mesh(f"part{i}", faces, edges=edges, n_vertices=len(x), self_collision=part.self_collision)
        n_features += len(x) + len(faces) + len({*map(tuple, np.sort(_edges(faces, edges), 1))})
        places.append(x)
    if shape.far:
        scene.add_mesh("far", n_vertices=1)
        places.append(10**shape.far * np.array([[1.0, 0.9, 1.1]]))
        n_features += 1
    start = np.concatenate(places)
    last = slice(len(start) - len(places[-1]), None) if not shape.far else slice(0, len(places[0]))
    end = start.copy()
    end[last] -= [0, 0, 10**shape.fall]
    if shape.worlds > 1:
        start, end = (np.repeat(x[None], shape.worlds, 0) for x in (start, end))
    return Case(scene, start, end, separation, shape.worlds, n_features * shape.worlds)


def _edges(faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]], edges])


def asked(query: str, case: Case) -> tuple[Any, Callable[[], int]]:
    """A detector, and a function that runs the query once and returns the number of results."""
    options: dict[str, Any] = {"minimum_separation": case.separation} if query == "separation" else {}
    if case.worlds > 1:
        options["worlds"] = case.worlds
    detector: Any = hc.Detector(case.scene, threads=1, backend="cpu", **options)
    if query in ("detect", "separation"):
        return detector, lambda: len(detector.detect(case.start, case.end))
    if query == "free_step":
        return detector, lambda: np.size(detector.collision_free_step(case.start, case.end))
    if query == "proximity":
        return detector, lambda: len(detector.proximity(case.start, case.separation))
    if query == "intersections":
        return detector, lambda: len(detector.intersections(case.start))
    return detector, lambda: np.size(detector.distances(case.start))


def seconds_of(query: str, case: Case, most: float) -> tuple[float, int]:
    """CPU time of the second call, because the first one builds the tree, and the number of results, or -1 if a call
    was cancelled."""
    detector, ask = asked(query, case)
    for _ in range(2):
        late = threading.Timer(most, detector.cancel)
        late.start()
        start = time.thread_time()
        try:
            results = ask()
        except hc.Cancelled:
            results = -1
        finally:
            late.cancel()
        seconds = time.thread_time() - start
        if results < 0:
            break
    return seconds, results


def ordinary(query: str, triangles: int) -> float:
    """CPU seconds per feature and result of a cloth over a ball."""
    cloth, ball = Part(share=1, rough=0.2, shift=(0, 0, 0.52)), Part(shape="dome", share=1)
    case = case_of(Shape(parts=[ball, cloth], separation=-2.0, fall=-1.5), triangles)
    seconds, results = min(seconds_of(query, case, 60) for _ in range(5))
    return seconds / (case.n_features + results)


def mutated(rng: np.random.Generator, shape: Shape, other: Shape) -> Shape:
    new = from_numbers(dataclasses.asdict(shape))
    for _ in range(rng.integers(1, 4)):
        part = new.parts[rng.integers(len(new.parts))]
        change = rng.integers(14)
        if change == 0 and len(new.parts) < 4:
            new.parts.append(dataclasses.replace(other.parts[rng.integers(len(other.parts))]))
        elif change == 1 and len(new.parts) > 1:
            new.parts.remove(part)
        elif change == 2:
            part.shape = str(rng.choice(SHAPES))
        elif change == 3:
            part.scale = float(np.clip(part.scale + rng.normal(0, 1), -5, 5))
        elif change == 4:
            part.squeezed = float(rng.choice([0, rng.normal(0, 1), rng.uniform(-6, 2)]))
        elif change == 5:
            part.turn = str(rng.choice(TURNS))
        elif change == 6:
            part.direction = tuple(rng.normal(size=3).tolist())
        elif change == 7:
            part.shift = tuple((rng.normal(size=3) * rng.integers(2, size=3)).tolist())
        elif change == 8:
            part.distance = float(rng.choice([0, rng.uniform(-3, 8)]))
        elif change == 9:
            part.rough = float(rng.choice([0, 10 ** rng.uniform(-6, 0)]))
            part.share = float(10 ** rng.uniform(-1, 1))
        elif change == 10:
            new.far = float(rng.choice([0, rng.uniform(0.5, 12)]))
        elif change == 11:
            new.fall, new.at_rest = float(rng.uniform(-6, 1)), bool(rng.integers(2))
        elif change == 12:
            new.separation = float(rng.uniform(-6, -0.5))
        else:
            part.self_collision = bool(rng.integers(2))
            new.worlds = int(rng.choice([1, 1, 1, 4, 16]))
    return new


def from_numbers(numbers: dict[str, Any]) -> Shape:
    fields = dict(numbers)
    parts = [Part(**p) for p in fields.pop("parts")]
    return Shape(parts=parts, **fields)


@dataclass
class Found:
    cost: float
    seconds: float
    features: int
    results: int
    shape: Shape


def measured(query: str, shape: Shape, a: argparse.Namespace, per_feature: float) -> Found:
    case = case_of(shape, a.triangles)
    seconds, results = seconds_of(query, case, a.most)
    cost = seconds / (case.n_features + max(results, 0)) / per_feature
    return Found(cost, seconds, case.n_features, results, shape)


def search(query: str, a: argparse.Namespace, rng: np.random.Generator, console: Console) -> list[Found]:
    per_feature = ordinary(query, a.triangles)
    found: list[Found] = []
    tried, end = 0, time.monotonic() + a.seconds / (len(QUERIES) if a.query == "all" else 1)
    while time.monotonic() < end:
        if len(found) < 4 or rng.random() < 0.1:
            shape = mutated(rng, Shape(parts=[Part(shape=str(rng.choice(SHAPES)))]), Shape())
        else:
            parent, other = (found[int(len(found) * rng.random() ** 2)].shape for _ in range(2))
            shape = mutated(rng, parent, other)
        tried += 1
        new = measured(query, shape, a, per_feature)
        if len(found) < a.keep or new.cost > found[-1].cost:
            found = sorted([*found, new], key=lambda f: -f.cost)[: a.keep]
    console.print(f"[bold]{query}[/]: {tried} scenes; an ordinary one takes {1e9 * per_feature:.0f} ns a feature")
    return found


def show(found: list[Found], console: Console) -> None:
    for f in found:
        console.print(
            f"  {f.cost:7.1f} times: {1e3 * f.seconds:.1f} ms, {f.features} features, "
            f"{'cancelled' if f.results < 0 else f'{f.results} results'}: "
            f"{_description(f.shape)}",
            highlight=False,
        )


def _description(shape: Shape) -> str:
    """The fields that differ from their defaults."""

    def differing(x: Any, default: Any) -> str:
        fields = [f.name for f in dataclasses.fields(x) if f.name != "parts"]
        values = {n: getattr(x, n) for n in fields if getattr(x, n) != getattr(default, n)}
        return ", ".join(f"{n} {_short(v)}" for n, v in values.items())

    parts = "; ".join(f"{p.shape} ({differing(dataclasses.replace(p, shape='grid'), Part())})" for p in shape.parts)
    return f"{parts}; {differing(shape, Shape())}"


def _short(value: Any) -> str:
    if isinstance(value, tuple | list):
        return "(" + " ".join(_short(v) for v in value) + ")"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def main(arguments: list[str] | None = None) -> int:
    a = PARSER.parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else 160)
    rng = np.random.default_rng(a.seed)
    slowest: dict[str, list[Found]] = {}
    kept = json.loads(a.again.read_text()) if a.again else {}
    for query in QUERIES if a.query == "all" else (a.query,):
        if not a.again:
            slowest[query] = search(query, a, rng, console)
        elif query in kept:
            per_feature = ordinary(query, a.triangles)
            console.print(f"[bold]{query}[/]: an ordinary scene takes {1e9 * per_feature:.0f} ns a feature")
            slowest[query] = [measured(query, from_numbers(s), a, per_feature) for s in kept[query]]
        else:
            continue
        show(slowest[query], console)
    if a.save:
        a.save.write_text(json.dumps({q: [dataclasses.asdict(f.shape) for f in found] for q, found in slowest.items()}))
        console.print(f"The slowest scenes: {a.save}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
