# SPDX-License-Identifier: Apache-2.0
"""Where the time of a step goes on the CPU, beside the least time that this machine needs for the same work.

  python -m bench limit                       the files of HPCCD_DATA, on one thread and on all
  python -m bench limit run.mcap --steps 8    a recording
  python -m bench limit --accuracy fast --threads-list 1

Work: what the program counts in a step (pairs of nodes, of leaves, candidates, what each filter left) times what one of
each takes in comparisons, floating-point operations and bytes (test/bench/core/limit_work.py). Least time: that
work at the machine's own rates, which the command measures first, with as many threads: comparisons and arithmetic in
registers, bytes from a core's second cache, and bytes from wherever as much data lie as the stage has. No stage can
be faster than that without doing less; rows with the largest distance are those where most can be gained. Times are
averages over the fastest third of the calls.

  bounds      positions checked, and boxes and k-DOPs of the motion of each vertex
  refit       corners and k-DOPs of leaves, boxes of leaves and nodes
  nodes       pairs of nodes, and what threads wait for each other
  leaf pairs  features of two leaves whose boxes overlap (timed for one pair in 64)
  k-DOPs      the filter of bounds along eight more directions, on each candidate pair of features
  tests       all other filters, the elementary tests and their fallbacks
  contacts    sorted, hashed, handed out
"""

from __future__ import annotations

from bench import command
from bench.core import limit_work, measure
from bench.core.limit_rates import Rates
from bench.core.variants import Variant
from bench.report import progress
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.report import cores

# Parts of stages that some builds or methods do not time, or of which too few came to be timed: told with the whole.
PARTS = {"leaf pairs": "nodes", "k-DOPs": "tests"}


def configure(parser):
    command.configure(parser, default=("data",), steps=4)
    command.tier_option(parser, default="exact")
    parser.add_argument("--threads-list", metavar="N,...", help="default: 1 and all cores")


def run(args) -> int:
    threads = command.numbers("--threads-list", args.threads_list or f"1,{cores()}", int)
    report, sources = command.begin(args)
    report.note(measure.NOTE)
    every = [Rates(n) for n in threads]
    for source in sources:
        variants = {
            rates.threads: Variant(
                f"{rates.threads} threads", {"accuracy": args.accuracy, "backend": "cpu", "threads": rates.threads}
            )
            for rates in every
        }
        series = measure.measure(source, [measure.CoreRunner(v) for v in variants.values()], args.repeat, args.steps)
        with progress.bar(f"{source.name}: rates of the machine", len(every) * len(limit_work.STAGES)) as bar:
            for rates in every:
                for row in _rows(source, series[variants[rates.threads].name], rates, args, bar):
                    report.add(part="stage", scene=source.name, accuracy=args.accuracy, threads=rates.threads, **row)
    for rates in every:
        for (name, size), found in rates.measured.items():
            report.add(part="rate", threads=rates.threads, rate=name, bytes=size, per_second=found)
    _print(report.rows)
    return command.end(args, report)


def _rows(source, series, rates, args, bar) -> list[dict]:
    """Of each stage, the farthest from its least time first; the whole step at the end."""
    ms = _stages(series, rates.threads)
    untimed = {part: whole for part, whole in PARTS.items() if not ms[part]}
    count = limit_work.average(
        [limit_work.counts(source.step(k), samples[-1].stats) for k, samples in series.by_step.items()]
    )
    rows = []
    for stage in limit_work.STAGES:
        bar.step(stage)
        if stage in untimed:
            continue
        told = [stage, *(part for part, whole in untimed.items() if whole == stage)]
        work = sum((limit_work.of_stage(name, count) for name in told), limit_work.Work())
        least = rates.least(work, args.accuracy == "fast")
        rows.append(
            {
                "stage": ", ".join(told),
                "ms": ms[stage],
                "least_ms": least.ms,
                "limited_by": least.by,
                "distance_ms": ms[stage] - least.ms,
                "over_least": ms[stage] / least.ms if least.ms else None,
                "items": {item.count: count[item.count] for item in limit_work.TABLE if item.stage in told},
                "work": vars(work),
            }
        )
    rows.sort(key=lambda row: -row["distance_ms"])
    least_of_all = sum(row["least_ms"] for row in rows)
    whole = ms["step"]
    rest = whole - sum(row["ms"] for row in rows)
    return [
        *rows,
        {"stage": "rest", "ms": rest, "distance_ms": rest},
        {
            "stage": "step",
            "ms": whole,
            "least_ms": least_of_all,
            "distance_ms": whole - least_of_all,
            "over_least": whole / least_of_all if least_of_all else None,
        },
    ]


def _stages(series, threads) -> dict[str, float]:
    """ms of an average step, by stage, and of the whole "step". Parts are told as time of all threads."""

    def of(call):
        leaves = min(1e-6 * call.stats.get("leaf_pairs_ns", 0) / threads, call.profile["traverse"])
        kdops = min(1e-6 * call.stats.get("slabs_ns", 0) / threads, call.profile["elementary"])
        return {
            "bounds": call.profile["bounds"],
            "refit": call.profile.get("refit", 0.0),
            "nodes": call.profile["traverse"] - leaves,
            "leaf pairs": leaves,
            "k-DOPs": kdops,
            "tests": call.profile["elementary"] - kdops,
            "contacts": call.profile["contacts"],
            "step": call.ms,
        }

    return limit_work.average(
        [limit_work.average([of(call) for call in _calm(samples)]) for samples in series.by_step.values()]
    )


def _calm(samples):
    """The third of the calls that took least: what others on the machine take is in none of the stages, and averages,
    other than medians, add up."""
    return sorted(samples, key=lambda call: call.ms)[: max(1, len(samples) // 3)]


def _print(rows):
    rates = [r for r in rows if r["part"] == "rate"]
    tables.show(
        "what this machine does at most, a second",
        ["threads", "rate", "of data, KB", "10^9"],
        [
            [r["threads"], r["rate"], r["bytes"] / 1024 or None, r["per_second"] / 1e9]
            for r in sorted(rates, key=lambda r: (r["threads"], r["rate"], r["bytes"]))
        ],
        "comparisons of floats, operations on floats and doubles, bytes",
    )
    tables.show(
        "where the time goes, ms of an average step, the farthest from its least first",
        [
            "scene",
            "threads",
            "stage",
            "ms",
            "least",
            "times",
            "farther by",
            "limited by",
            "comparisons",
            "flops",
            "MB once",
            "MB again",
        ],
        [
            [
                r["scene"],
                r["threads"],
                r["stage"],
                r["ms"],
                r.get("least_ms"),
                r.get("over_least"),
                r["distance_ms"],
                r.get("limited_by", ""),
                *_millions(r.get("work")),
            ]
            for r in rows
            if r["part"] == "stage"
        ],
        "comparisons and flops in millions; rest: building the hierarchy anew, and what the core did not see",
    )


def _millions(work):
    if work is None:
        return [None] * 4
    amounts = (work["comparisons"], work["flops"], work["read"] + work["written"], work["touched"])
    return [1e-6 * amount for amount in amounts]
