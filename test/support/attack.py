# SPDX-License-Identifier: Apache-2.0
"""Damaged and hostile recordings through doctor, recover, replay, view and play, in a process that may be lost.

python test/support/attack.py --random 2000 --crafted 2000     counts by outcome; what failed, with its name
python test/support/attack.py --only crafted/bomb/3            one case, its output and its traceback
"""

import argparse
import collections
import faulthandler
import functools
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import base_bags
import damage
import hostile
import matplotlib
import recording_oracle
from in_process import hpccd
from mcap_model import Bag
from sources import SOURCES

from hpccd_ros.picture import view

# Seconds for one case on an overloaded machine; the slowest takes three on an idle one.
PATIENCE = 120
# Memory that a case may use in addition, MB; the bomb of hostile.py unpacks to 268.
MEMORY = 900
BASES = ("streams", "everything")
# Kinds of cases that are also published over DDS, which uses only topics, types and bytes.
PLAYED = {
    "metadata_of_a_topic",
    "topic_name",
    "type_name",
    "type_of_another_topic",
    "payload",
    "payload_lengths",
    "schema_of_no_topic",
    "channel_twice",
    "times_of_messages",
    "order_of_messages",
}


def cases(n_random: int, n_crafted: int, seed: int = 1) -> list[str]:
    """Names of cases: family/kind/seed. Each kind in turn."""
    random_kinds, crafted = [kind.__name__ for kind in damage.KINDS], list(hostile.KINDS)
    return [f"random/{random_kinds[k % len(random_kinds)]}/{seed + k}" for k in range(n_random)] + [
        f"crafted/{crafted[k % len(crafted)]}/{seed + k}" for k in range(n_crafted)
    ]


def make_case(name: str, folder: Path) -> bytes:
    """The bytes of the recording of a case."""
    family, kind, _ = name.split("/")
    rng = random.Random(name)
    base = Bag.read(folder / f"{rng.choice(BASES)}.mcap")
    if family == "crafted":
        return hostile.make(kind, rng, base)
    base.compression = rng.choice(("", "lz4", "zstd"))
    base.chunk_bytes = rng.choice((20_000, 20_000, 0))
    base.summary = rng.random() < 0.8
    base.check_sums = rng.random() < 0.6
    data = bytearray(base.bytes())
    getattr(damage, kind)(rng, data)
    return bytes(data)


# ---------------------------------------------------------------- in the process that may be lost


def work(folder: Path) -> None:
    """Read names of cases, write one line of JSON for each."""
    matplotlib.rcParams["savefig.dpi"] = 20  # pictures that nobody looks at
    view.draw_step = functools.partial(view.draw_step, size=(160, 120))
    # Far above MEMORY: for what would otherwise take the machine along.
    resource.setrlimit(resource.RLIMIT_AS, (12 << 30, 12 << 30))
    out = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        name = line.strip()
        faulthandler.dump_traceback_later(PATIENCE, exit=True)
        result = run_case(name, folder)
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps(result), file=out, flush=True)


def run_case(name: str, folder: Path) -> dict:
    """{command: outcome} and problems (texts) of one case."""
    ends = ("in.mcap", "out.mcap", "x.png", "x.html", "x.json", "x.csv")
    path, saved, picture, page, table, steps = (folder / f"{os.getpid()}-{end}" for end in ends)
    for leftover in (saved, picture, page, table):
        leftover.unlink(missing_ok=True)
    path.write_bytes(make_case(name, folder))
    problems, outcomes = [], {}
    began, before = time.monotonic(), _memory(reset=True)

    def command(label, *words):
        done = hpccd(*words)
        outcomes[label] = done.status
        if done.traceback:
            problems.append(f"{label}: traceback: {done.traceback}")
        elif done.status == 2 and not done.err.startswith(f"hpccd {words[0]}: "):
            problems.append(f"{label}: no sentence: {done.err[:300]!r}")
        elif done.status not in (0, 1, 2):
            problems.append(f"{label}: status {done.status}")
        return done

    def replay(label, recording):
        table.unlink(missing_ok=True)
        steps.unlink(missing_ok=True)
        done = command(label, "replay", recording, "--json", table, "--csv", steps, "--backend", "cpu")
        if table.exists():
            (row,) = json.loads(table.read_text())
            outcomes[label] = row["result"]
            if row["result"] == "VERIFIED" or re.search("^VERIFIED", done.out, re.MULTILINE):
                problems.extend(recording_oracle.lies(recording, row, steps, done.out))
        return done

    sound = command("doctor", "doctor", path)
    command("recover", "doctor", path, "--recover", saved)
    replayed = replay("replay", path)
    command("view", "view", path, "-o", picture)
    command("page", "view", path, "--html", page)
    if name.split("/")[1] in PLAYED:
        command("play", "replay", path, "--publish", "--all", "--subscribers", 0, "--wait", 0, "--rate", 0)
    if outcomes["doctor"] == 0 and re.search(r" is damaged | is cut off", replayed.err):
        problems.append(f"doctor says sound, replay: {replayed.err}")
    if outcomes["recover"] == 0:
        if hpccd("doctor", saved).status != 0:
            problems.append("recover: what it saved is not sound")
        replay("replay of what was saved", saved)
    elif saved.exists():
        problems.append("recover: failed and left a file")
    grown = _memory() - before
    if grown > MEMORY:
        problems.append(f"{grown} MB of memory")
    return {
        "name": name,
        "outcomes": outcomes,
        "problems": problems,
        "seconds": round(time.monotonic() - began, 2),
        "memory": grown,
        "told": [*sound, *replayed],
    }


def _memory(reset=False) -> int:
    """Peak memory of this process since the last reset, MB."""
    if reset:
        Path("/proc/self/clear_refs").write_text("5")
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) // 1024


# ---------------------------------------------------------------- from outside


class Worker:
    """A process that runs cases; it is replaced if it crashes."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._process = None

    def run(self, name: str) -> dict:
        if self._process is None:
            self._log = open(self._folder / f"worker-{time.monotonic_ns()}.log", "w+")
            self._process = subprocess.Popen(
                [sys.executable, __file__, "--work", str(self._folder)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                text=True,
                env={**os.environ, "PYTHONPATH": SOURCES},
            )
        self._process.stdin.write(name + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if line:
            return json.loads(line)
        status = self._process.wait()
        self._log.seek(0)
        words = self._log.read()[-3000:]
        self._process = None
        return {
            "name": name,
            "outcomes": {"process": status},
            "seconds": 0,
            "memory": 0,
            "problems": [f"lost the process: status {status} (hang or crash): {words}"],
        }

    def close(self):
        if self._process is not None:
            self._process.stdin.close()
            self._process.wait(PATIENCE)


def attack(names, folder: Path, on_result=lambda result: None) -> list[dict]:
    """Run all cases; return the results with problems."""
    worker = Worker(folder)
    bad = []
    try:
        for name in names:
            result = worker.run(name)
            on_result(result)
            if result["problems"]:
                bad.append(result)
    finally:
        worker.close()
    return bad


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, default=2000)
    parser.add_argument("--crafted", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", help="names of cases, commas between")
    parser.add_argument("--keep", type=Path, help="folder for the recordings of cases that failed")
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.work:
        work(args.work)
        return 0
    counts = collections.defaultdict(collections.Counter)
    slowest, largest = ("", 0.0), ("", 0)

    def tell(result):
        nonlocal slowest, largest
        family = result["name"].partition("/")[0]
        for command, outcome in result["outcomes"].items():
            counts[family, command][str(outcome)] += 1
        slowest = max(slowest, (result["name"], result["seconds"]), key=lambda pair: pair[1])
        largest = max(largest, (result["name"], result["memory"]), key=lambda pair: pair[1])
        for problem in result["problems"]:
            print(f"{result['name']}: {problem}", flush=True)
        if args.only:
            print(json.dumps(result, indent=1))

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        base_bags.write_all(folder)
        names = args.only.split(",") if args.only else cases(args.random, args.crafted, args.seed)
        bad = attack(names, folder, tell)
        if args.keep:
            args.keep.mkdir(parents=True, exist_ok=True)
            for result in bad if not args.only else [{"name": n} for n in names]:
                target = args.keep / (result["name"].replace("/", "-") + ".mcap")
                target.write_bytes(make_case(result["name"], folder))
    for (family, command), outcomes in sorted(counts.items()):
        print(f"{family:8} {command:24} " + ", ".join(f"{k}: {n}" for k, n in sorted(outcomes.items())))
    print(f"{len(names)} cases, {len(bad)} with problems; slowest {slowest}, most memory {largest}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
