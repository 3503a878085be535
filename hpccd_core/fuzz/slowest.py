# SPDX-License-Identifier: Apache-2.0
"""Search for the elementary queries that take the exact tier longest: `python -m hpccd_core.fuzz.slowest --help`."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from .differential import CORE, ORACLE
from .generators import EDGE_EDGE, GENERATORS, VERTEX_FACE

SECONDS_BETWEEN_LINES = 30
LOWEST, HIGHEST = -1074, 497  # binary exponents: from the smallest number to 1e150, the largest coordinate accepted


@dataclass
class Herd:
    """The slowest queries found so far, of one kind, slowest first."""

    kind: str
    size: int
    queries: list[np.ndarray] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def offer(self, query: np.ndarray) -> None:
        """Measure a query and keep it if it is among the slowest, which a second look must confirm."""
        bar = self.seconds[-1] if len(self.seconds) == self.size else 0.0
        if seconds_of(self.kind, query, 2) <= bar:
            return
        seconds = seconds_of(self.kind, query, 10)
        if seconds <= bar or any(np.array_equal(query, q) for q in self.queries):
            return
        at = sum(s > seconds for s in self.seconds)
        self.queries.insert(at, query)
        self.seconds.insert(at, seconds)
        del self.queries[self.size :], self.seconds[self.size :]


def seconds_of(kind: str, query: np.ndarray, repeats: int) -> float:
    """Processor time of one query (8,3), the shortest of so many; the call from Python, about 10 us, included.

    Of this thread: other processes that run meanwhile do not count.
    """
    queries, shortest = query[None], np.inf
    for _ in range(repeats):
        start = time.thread_time()
        CORE[kind](queries, accuracy="exact")
        shortest = min(shortest, time.thread_time() - start)
    return shortest


def seeds(rng: np.random.Generator, kind: str) -> list[np.ndarray]:
    """One query of each generator as it is, and one whose coordinates lie far apart in magnitude."""
    queries = []
    for generator in GENERATORS[kind].values():
        query = generator(rng, 1)[0]
        exponents = rng.choice(rng.integers(LOWEST, HIGHEST - 3, size=3), size=(8, 3))
        queries += [query, np.ldexp(query, exponents)]
    return [within_range(q) for q in queries]


def mutated(rng: np.random.Generator, query: np.ndarray, other: np.ndarray) -> np.ndarray:
    """One to four changes, each of a random kind."""
    query = query.copy()
    for _ in range(rng.integers(1, 5)):
        CHANGES[rng.integers(len(CHANGES))](rng, query, other)
    return within_range(query)


def within_range(query: np.ndarray) -> np.ndarray:
    return np.clip(query, -(2.0**HIGHEST), 2.0**HIGHEST)


def new_exponent(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    point, axis = _place(rng)
    query[point, axis] = np.ldexp(np.frexp(query[point, axis])[0] or 1.0, rng.integers(LOWEST, HIGHEST))


def next_exponent(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    place = _place(rng)
    query[place] = np.ldexp(query[place], rng.integers(-3, 4))


def new_value(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[_place(rng)] = np.ldexp(rng.choice([-1.0, 0.0, 1.0, rng.uniform(-1, 1)]), rng.integers(LOWEST, HIGHEST))


def other_mantissa(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    place = _place(rng)
    bits = query[place].view(np.uint64) ^ np.uint64(1 << int(rng.integers(52)))
    query[place] = bits.view(np.float64)


def negative(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[_place(rng)] *= -1


def one_ulp(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    place = _place(rng)
    query[place] = np.nextafter(query[place], rng.choice([-np.inf, np.inf]))


def same_number(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[_place(rng)] = rng.choice([-1.0, 1.0]) * query[_place(rng)]


def same_point(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[rng.integers(8)] = query[rng.integers(8)]


def scaled_axis(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[rng.integers(8), :] *= np.ldexp(1.0, rng.integers(-60, 61, size=3))


def flat(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    """Coplanar throughout."""
    query[:, rng.integers(3)] = 0


def crossed(rng: np.random.Generator, query: np.ndarray, other: np.ndarray) -> None:
    mask = rng.random((8, 3)) < 0.3 if rng.random() < 0.5 else rng.random((8, 1)) < 0.3
    query[:] = np.where(mask, other, query)


Change = Callable[[np.random.Generator, np.ndarray, np.ndarray], None]
CHANGES: tuple[Change, ...] = (
    new_exponent, next_exponent, new_value, other_mantissa, negative, one_ulp,
    same_number, same_point, scaled_axis, flat, crossed,
)  # fmt: skip


def _place(rng: np.random.Generator) -> tuple[int, int]:
    return int(rng.integers(8)), int(rng.integers(3))


def improve(rng: np.random.Generator, herd: Herd) -> None:
    """Offer one new query: now and then from nowhere, most often a change of one of the slowest."""
    if len(herd.queries) < 2 or rng.random() < 0.02:
        for query in seeds(rng, herd.kind):
            herd.offer(query)
        return
    parent, other = (herd.queries[int(len(herd.queries) * rng.random() ** 2)] for _ in range(2))
    herd.offer(mutated(rng, parent, other))


def main(arguments: list[str] | None = None) -> int:
    a = _parser().parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else 120)
    rng = np.random.default_rng(a.seed)
    slowest = {kind: Herd(kind, a.keep) for kind in (VERTEX_FACE, EDGE_EDGE)}
    rounds = max(1, round(a.seconds / a.restart))
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    tried, reported, start = 0, 0.0, time.monotonic()
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("searching", total=a.seconds)
        try:
            for turn in range(rounds):
                herds = {kind: Herd(kind, a.keep) for kind in slowest}
                while (seconds := time.monotonic() - start) < a.seconds * (turn + 1) / rounds:
                    for herd in herds.values():
                        improve(rng, herd)
                        tried += 1
                    best = ", ".join(f"{h.kind} {max(h.seconds, default=0) * 1e6:.0f} us" for h in herds.values())
                    text = f"search {turn + 1} of {rounds}: {tried:,} tried, slowest {best}"
                    progress.update(bar, completed=seconds, description=text)
                    if not console.is_terminal and seconds > reported + SECONDS_BETWEEN_LINES:
                        console.print(text)  # the bar shows on terminals only
                        reported = seconds
                for kind, herd in herds.items():
                    for query in herd.queries:
                        slowest[kind].offer(query)
        except KeyboardInterrupt:
            console.print("Stopped early; what was found in full searches:")
    wrong = 0
    for kind, herd in slowest.items():
        console.print(f"{kind}: " + ", ".join(f"{s * 1e6:.0f}" for s in herd.seconds[:10]) + " us")
        wrong += _different_from_oracle(kind, herd)
    seconds = time.monotonic() - start
    console.print(f"{tried:,} queries in {seconds:.0f} s, seed {a.seed}; {wrong} differ from the oracle.")
    if a.save:
        np.savez_compressed(a.save, **{kind: np.array(herd.queries) for kind, herd in slowest.items()})
        console.print(f"The slowest ones: {a.save}")
    return int(wrong > 0)


def _different_from_oracle(kind: str, herd: Herd) -> int:
    if not herd.queries:
        return 0
    queries = np.array(herd.queries)
    (hit, toc), (true_hit, true_toc) = CORE[kind](queries, accuracy="exact"), ORACLE[kind](queries)
    both = hit & true_hit
    return int((hit != true_hit).sum() + (np.abs(toc[both] - true_toc[both]) > 1e-12).sum())


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m hpccd_core.fuzz.slowest",
        description="Search for the queries that take accuracy='exact' longest, by changing the slowest ones found so "
        "far, from the beginning again and again; the shortest of ten times counts. Exit status 1 where an answer "
        "differs from the exact oracle's.",
    )
    p.add_argument("--seconds", type=float, default=60.0, help="how long (default 60)")
    p.add_argument("--restart", type=float, default=30.0, help="seconds after which a new search begins (default 30)")
    p.add_argument("--keep", type=int, default=20, help="so many queries of each kind (default 20)")
    p.add_argument("--seed", type=int, default=0, help="of the random numbers; times decide too, so runs differ")
    p.add_argument("--save", type=Path, help=".npz file for the slowest queries of each kind")
    return p


if __name__ == "__main__":
    sys.exit(main())
