# SPDX-License-Identifier: Apache-2.0
"""Search for the slowest elementary queries of the exact tier: `python -m fuzz.slowest --help`."""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from .differential import compare
from .mutations import HIGHEST, LOWEST, Query, mutated, within_range
from .questions import (
    CONTACT,
    CORE,
    INTERSECTIONS,
    PROXIMITY,
    SEPARATION,
    Batch,
    detector_of_pair,
    generators_of,
    kinds_of,
    truth,
)

SECONDS_BETWEEN_LINES = 30
QUESTIONS = (CONTACT, SEPARATION, PROXIMITY, INTERSECTIONS)


@dataclass
class Herd:
    """The slowest queries found so far, of one question and kind, slowest first."""

    question: str
    kind: str
    size: int
    queries: list[Query] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def offer(self, query: Query) -> None:
        """Measure a query and keep it if it is among the slowest, confirmed by a second measurement."""
        bar = self.seconds[-1] if len(self.seconds) == self.size else 0.0
        if seconds_of(self.question, self.kind, query, 2) <= bar:
            return
        seconds = seconds_of(self.question, self.kind, query, 10)
        if seconds <= bar or any(query[1] == q[1] and np.array_equal(query[0], q[0]) for q in self.queries):
            return
        at = sum(s > seconds for s in self.seconds)
        self.queries.insert(at, query)
        self.seconds.insert(at, seconds)
        del self.queries[self.size :], self.seconds[self.size :]

    def batch(self) -> Batch:
        points, distances = zip(*self.queries, strict=True)
        return Batch(self.question, self.kind, "slowest", np.array(points), np.array(distances))


def seconds_of(question: str, kind: str, query: Query, repeats: int) -> float:
    """CPU time of one query, the shortest of several runs, including about 10 us for the call from Python.

    Time of this thread only, so other processes do not count. A query of one frame builds a scene with boxes and a
    tree: about 30 us more.
    """
    points, distance = query
    detector = detector_of_pair(kind, "exact", "auto")
    if question == PROXIMITY:
        ask = lambda: detector.proximity(points, distance)  # noqa: E731
    elif question == INTERSECTIONS:
        ask = lambda: detector.intersections(points)  # noqa: E731
    else:
        ask = lambda: CORE[kind](points[None], accuracy="exact", minimum_separation=distance)  # noqa: E731
    shortest = np.inf
    for _ in range(repeats):
        start = time.thread_time()
        ask()
        shortest = min(shortest, time.thread_time() - start)
    return shortest


def seeds(rng: np.random.Generator, question: str, kind: str) -> list[Query]:
    """One query of each generator, and one whose coordinates differ widely in magnitude."""
    queries = []
    for generator in generators_of(question, kind).values():
        made = generator(rng, 1)
        points, distance = (made[0][0], float(made[1][0])) if isinstance(made, tuple) else (made[0], 0.0)
        exponents = rng.choice(rng.integers(LOWEST, HIGHEST - 3, size=3), size=points.shape)
        with np.errstate(over="ignore"):
            queries += [(points, distance), (np.ldexp(points, exponents), distance)]
    return queries


def improve(rng: np.random.Generator, herd: Herd, span: int) -> None:
    """Offer one new query: most often a mutation of one of the slowest, sometimes a random one."""
    if len(herd.queries) < 2 or rng.random() < 0.02:
        for query in seeds(rng, herd.question, herd.kind):
            herd.offer(within_range(query, span))
        return
    parent, other = (herd.queries[int(len(herd.queries) * rng.random() ** 2)] for _ in range(2))
    herd.offer(within_range(mutated(rng, herd.kind, parent, other), span))


def main(arguments: list[str] | None = None) -> int:
    a = _parser().parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else 120)
    rng = np.random.default_rng(a.seed)
    asked = QUESTIONS if a.question == "all" else (a.question,)
    slowest = {(q, kind): Herd(q, kind, a.keep) for q in asked for kind in kinds_of(q)}
    rounds = max(1, round(a.seconds / a.restart))
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    tried, reported, start = 0, 0.0, time.monotonic()
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("searching", total=a.seconds)
        try:
            for turn in range(rounds):
                herds = {key: Herd(*key, a.keep) for key in slowest}
                while (seconds := time.monotonic() - start) < a.seconds * (turn + 1) / rounds:
                    for herd in herds.values():
                        improve(rng, herd, a.span)
                        tried += 1
                    best = ", ".join(
                        f"{h.question} {h.kind} {max(h.seconds, default=0) * 1e6:.0f} us" for h in herds.values()
                    )
                    text = f"search {turn + 1} of {rounds}: {tried:,} tried, slowest {best}"
                    progress.update(bar, completed=seconds, description=text)
                    if not console.is_terminal and seconds > reported + SECONDS_BETWEEN_LINES:
                        console.print(text)  # the bar shows on terminals only
                        reported = seconds
                for key, herd in herds.items():
                    for query in herd.queries:
                        slowest[key].offer(query)
        except KeyboardInterrupt:
            console.print("Stopped early; what was found in full searches:")
    wrong = 0
    for (question, kind), herd in slowest.items():
        console.print(f"{question}, {kind}: " + ", ".join(f"{s * 1e6:.0f}" for s in herd.seconds[:10]) + " us")
        wrong += _different_from_oracle(herd)
    seconds = time.monotonic() - start
    console.print(f"{tried:,} queries in {seconds:.0f} s, seed {a.seed}; {wrong} differ from the oracle.")
    if a.save:
        _save(a.save, slowest)
        console.print(f"The slowest ones: {a.save}")
    return int(wrong > 0)


def _different_from_oracle(herd: Herd) -> int:
    if not herd.queries:
        return 0
    batch = herd.batch()
    return int(compare(batch, "exact", ("auto",), truth(batch)).broken_promises("exact").sum())


def _save(path: Path, slowest: dict[tuple[str, str], Herd]) -> None:
    """Keys: of contact the kind, as the file of the tests has it; else question|kind, and the same with |distances."""
    arrays = {}
    for (question, kind), herd in slowest.items():
        if herd.queries:
            key = kind if question == CONTACT else f"{question}|{kind}"
            batch = herd.batch()
            arrays[key] = batch.queries
            if question in (SEPARATION, PROXIMITY):
                arrays[f"{key}|distances"] = batch.distances
    np.savez_compressed(path, **arrays)


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m fuzz.slowest",
        description="Search for the queries that take accuracy='exact' longest, by changing the slowest ones found so "
        "far, from the beginning again and again; the shortest of ten times counts. Exit status 1 where a result "
        "differs from the exact oracle's.",
    )
    p.add_argument("--seconds", type=float, default=60.0, help="how long (default 60)")
    p.add_argument("--restart", type=float, default=30.0, help="seconds after which a new search begins (default 30)")
    p.add_argument("--keep", type=int, default=20, help="queries to keep of each kind (default 20)")
    p.add_argument("--seed", type=int, default=0, help="of the random numbers; times decide too, so runs differ")
    p.add_argument("--question", choices=(*QUESTIONS, "all"), default="all")
    p.add_argument(
        "--span", type=int, default=HIGHEST - LOWEST, help="how far apart binary exponents may be (default: all)"
    )
    p.add_argument("--save", type=Path, help=".npz file for the slowest queries of each kind")
    return p


if __name__ == "__main__":
    sys.exit(main())
