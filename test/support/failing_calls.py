# SPDX-License-Identifier: Apache-2.0
"""Every system call of what writes files fails once, at each point, with each error that it may have.

python test/support/failing_calls.py                     all of it; a table of calls, errors and outcomes
python test/support/failing_calls.py --only record       one scenario
python test/support/failing_calls.py --points 3          at most 3 points of each call
"""

import argparse
import collections
import contextlib
import ctypes
import errno
import gc
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
# As in failing_calls.c.
CALLS = (
    ("open", ("ENOSPC", "EIO", "EINTR", "EMFILE", "EACCES", "EDQUOT")),
    ("read", ("EIO", "EINTR", "SHORT")),
    ("write", ("ENOSPC", "EIO", "EINTR", "EDQUOT", "EFBIG", "SHORT", "ZERO")),
    ("close", ("EIO", "EINTR", "ENOSPC", "EDQUOT")),
    ("sync", ("EIO", "ENOSPC", "EDQUOT", "EINTR")),
    ("rename", ("EIO", "ENOSPC", "EACCES", "EDQUOT")),
    ("mkdir", ("ENOSPC", "EIO", "EACCES", "EDQUOT")),
    ("unlink", ("EIO", "EACCES")),
    ("stat", ("EIO", "EACCES")),
    ("truncate", ("EIO", "EINTR")),
    ("seek", ("EIO",)),
    ("link", ("EIO", "ENOSPC", "EACCES", "EPERM", "EMLINK")),
    ("chmod", ("EPERM", "EIO")),
    ("dup", ("EMFILE",)),
    ("flock", ("EIO", "EINTR")),
)
NAMES = [name for name, _ in CALLS]
SPECIAL = {"SHORT": -1, "ZERO": -2, "SLOW": -3}
# Errors that stay: a disk that is full or gone.
LASTING = {("open", "EMFILE"), ("write", "ENOSPC"), ("write", "EIO"), ("sync", "EIO"), ("open", "EACCES")}


def build(folder: Path) -> Path | None:
    """The library for LD_PRELOAD, or None without a C compiler."""
    compiler = next(filter(None, map(shutil.which, (os.environ.get("CC", "cc"), "gcc", "clang"))), None)
    if compiler is None:
        return None
    library = folder / "failing_calls.so"
    source = HERE / "failing_calls.c"
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True, timeout=60)
    return library


def run(library: Path, *options) -> list[dict]:
    """The results of all cases, from a process with the library."""
    from sources import SOURCES

    environment = {**os.environ, "LD_PRELOAD": str(library), "PYTHONPATH": SOURCES}
    command = [sys.executable, "-W", "ignore", __file__, "--json", *map(str, options)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr[-3000:]
    return [json.loads(line) for line in done.stdout.splitlines()]


# ---------------------------------------------------------------- in the process with the library


@contextlib.contextmanager
def failing(folder: Path, call: str = "", number: int = -1, error: str = "EIO", lasting: bool = False):
    """The `number`-th call of a kind (from 0) on a path in `folder` fails. Yields {call: number of calls}, filled at
    the end."""
    library = ctypes.CDLL(None)
    code = SPECIAL.get(error) or getattr(errno, error)
    found = (ctypes.c_int * len(CALLS))()
    counts: dict[str, int] = {}
    index = NAMES.index(call) if call else -1
    library.faults_start(os.fsencode(folder), index, number, code, int(lasting))
    try:
        yield counts
    finally:
        library.faults_stop(found)
        counts |= dict(zip(NAMES, found, strict=True))


class Scenario:
    """name: of the scenario. Each run is in a new folder, with `inputs` and the outputs beside."""

    def __init__(self, name: str):
        self.name = name

    def prepare(self, folder: Path) -> None:
        """Write what is read."""

    def act(self, folder: Path) -> dict:
        """Do it; results for `check`."""
        raise NotImplementedError

    def check(self, folder: Path, done: dict, harmless: bool) -> list[str]:
        """Problems. harmless: nothing failed."""
        raise NotImplementedError


TEXT = random.Random(6).randbytes(300).hex()
TOTAL = 40


class Record(Scenario):
    """The writer of `hpccd record` and of the node's own recording."""

    def __init__(self, name, target, **options):
        super().__init__(name)
        self.target, self.options = target, options

    def act(self, folder):
        from bag_tools import STRING, text_message

        from hpccd_ros.bag.writer import BagWriter, Topic

        try:
            bag = BagWriter(
                folder / self.target,
                info={"a": 1},
                attachments=[("x", b"abc")],
                chunk_size=3000,
                flush_interval=0.0 if self.options.get("sync") else 1e9,
                retry_interval=0.0,
                **self.options,
            )
        except OSError as error:
            return {"raised": str(error)}
        bag.add_topic(Topic("/text", STRING, []))
        for number in range(TOTAL):
            bag.write("/text", text_message(f"{number:05}{TEXT}"), 10**18 + number, 10**18 + number, number)
            if number == TOTAL // 2:
                bag.attach("late", b"def")
                bag.flush()
        bag.close()
        return {"bag": bag}

    def check(self, folder, done, harmless):
        from hpccd_ros.bag.examine import examine

        there = {path for path in folder.rglob("*") if path.is_file() and "inputs" not in path.parts}
        if "bag" not in done:
            problems = [] if str(folder) in done["raised"] else [f"no path in the error: {done['raised']}"]
            return problems + [f"left: {path}" for path in folder.iterdir()]
        bag = done["bag"]
        problems = []
        listed = {folder / self.target / "metadata.yaml"} if (folder / self.target).is_dir() else set()
        if left := there - set(bag.file_paths) - listed:
            problems.append(f"left: {left}")
        kept = []
        for path in bag.file_paths:
            found = examine(path)
            if not found.sound and path not in bag.torn_files:
                problems.append(f"not sound and not called torn: {path.name}: {found.problem}")
            kept += _texts(path)
        if kept != sorted(set(kept)):
            problems.append(f"messages twice or out of order: {kept}")
        if len(kept) + bag.not_written.total() != TOTAL or len(kept) != bag.message_count:
            problems.append(f"{len(kept)} kept of {bag.message_count}, {bag.not_written.total()} not written")
        lost = bag.not_written.total() or bag.not_synced or bag.torn_files
        if lost and not bag.write_errors:
            problems.append("lost and no error counted")
        if bag.write_errors and str(folder) not in bag.last_error:
            problems.append(f"no path in the error: {bag.last_error}")
        if self.options.get("sync") and bag.synced_count + bag.not_synced < len(kept):
            problems.append(f"{bag.synced_count} synced + {bag.not_synced} not synced of {len(kept)}")
        if harmless and (lost or bag.write_errors):
            problems.append(f"an error for nothing: {bag.last_error}")
        if listed:
            problems += _metadata(folder / self.target, bag)
        return problems


def _texts(path):
    import corruption

    data = path.read_bytes()
    begin = len(corruption.MAGIC)
    found = []
    with contextlib.suppress(corruption.Contradiction):
        for _, op, body in corruption.frames(data, begin, len(data)):
            if op == corruption.CHUNK:
                records = corruption.Chunk.read(body).records
                found += [int(content[30:35]) for kind, content in records if kind == corruption.MESSAGE]
            elif op == corruption.DATA_END:
                break
    return found


def _metadata(folder, bag):
    import yaml

    finished = [path.name for path in bag.file_paths if path not in bag.torn_files]
    path = folder / "metadata.yaml"
    if not path.exists():
        return ["no metadata.yaml"] if finished and not bag.write_errors else []
    names = yaml.safe_load(path.read_text())["rosbag2_bagfile_information"]["relative_file_paths"]
    if not set(names) <= set(finished):
        return [f"metadata.yaml lists {names}, finished are {finished}"]
    if names != finished and not bag.write_errors:
        return [f"metadata.yaml lists {names}, finished are {finished}"]
    return []


class Command(Scenario):
    """`hpccd WORDS` in a folder; {in}, {out}: a recording and the folder of outputs. good: (name, function that says
    whether the file is whole)."""

    def __init__(self, name, words, outputs, source="sound.mcap"):
        super().__init__(name)
        self.words, self.outputs, self.source = words, outputs, source

    def prepare(self, folder):
        shutil.copytree(SHARED, folder / "inputs")

    def act(self, folder):
        from in_process import hpccd

        names = {"in": folder / "inputs" / self.source, "out": folder}
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            done = hpccd(*(word.format(**names) for word in self.words))
        return {"done": done}

    def check(self, folder, done, harmless):
        done = done["done"]
        problems = []
        if done.traceback:
            problems.append(f"traceback: {done.traceback}")
        there = {path.name for path in folder.iterdir()} - {"inputs", "cache"}
        if left := there - {name.split("/")[0] for name in self.outputs}:
            problems.append(f"left: {left}")
        for name, whole in self.outputs.items():
            path = folder / name
            try:
                good = path.exists() and whole(path)
            except Exception as error:
                good = False
                problems.append(f"{name} is not whole: {error!r}")
            if path.exists() and not good:
                problems.append(f"{name} is there and not whole")
            if done.status == 0 and not good:
                problems.append(f"status 0 without {name}")
        if done.status and str(folder) not in done.err + done.out:
            problems.append(f"no path in the error: {done.err}")
        if done.status not in (0, 1, 2):
            problems.append(f"status {done.status}")
        if harmless and done.status:
            problems.append(f"an error for nothing: {done.err}")
        return problems


SHARED: Path


def _sound(count):
    def whole(path):
        from hpccd_ros.bag.examine import examine

        found = examine(path)
        return found.sound and (count is None or found.message_count == count)

    return whole


def _ends(text: bytes):
    return lambda path: path.read_bytes().rstrip().endswith(text)


def _rows(path):
    return len(path.read_text().splitlines()) == 8


def _verified(path):
    return json.loads(path.read_text())[0]["result"] == "VERIFIED"


def _arrays(path):
    import numpy as np

    with np.load(path) as found:
        return all(found[name].shape is not None for name in found.files)


PNG = b"IEND\xaeB`\x82"
SCENE = ("scene", "cloth-drop", "--size", "0.02", "--frames", "3")


def scenarios(messages: int) -> list[Scenario]:
    recorded = {"run": {}, "lz4": {"compression": "lz4"}, "sync": {"sync": True}}
    return [
        *(Record(f"record a file, {name}", "run.mcap", **options) for name, options in recorded.items()),
        *(Record(f"record a folder, {name}", "run", max_bytes=8000, **options) for name, options in recorded.items()),
        Command(
            "doctor --recover",
            ("doctor", "{in}", "--recover", "{out}/x.mcap"),
            {"x.mcap": _sound(None)},
            source="cut.mcap",
        ),
        Command("cut", ("cut", "{in}", "--from", "0", "-o", "{out}/x.mcap"), {"x.mcap": _sound(messages)}),
        Command(
            "replay --csv --json",
            ("replay", "{in}", "--csv", "{out}/x.csv", "--json", "{out}/x.json", "--backend", "cpu"),
            {"x.csv": _rows, "x.json": _verified},
        ),
        Command("view, picture", ("view", "{in}", "-o", "{out}/x.png"), {"x.png": _ends(PNG)}),
        Command(
            "view --every",
            ("view", "{in}", "--every", "4", "-o", "{out}/x"),
            {"x/000056.png": _ends(PNG), "x/000060.png": _ends(PNG)},
        ),
        Command("view --html", ("view", "{in}", "--html", "{out}/x.html"), {"x.html": _ends(b"</html>")}),
        Command("scene --mcap", (*SCENE, "--mcap", "{out}/x.mcap"), {"x.mcap": _sound(8)}),
        Command("scene --npz", (*SCENE, "--npz", "{out}/x.npz"), {"x.npz": _arrays}),
        Command(
            "scene --params",
            (*SCENE, "--params", "{out}/x.yaml"),
            {"x.yaml": lambda path: b"ball" in path.read_bytes()},
        ),
        Command("scene --png", (*SCENE, "--png", "{out}/x.png"), {"x.png": _ends(PNG)}),
    ]


def _open_files():
    gc.collect()
    found = {}
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            found[number] = os.readlink(f"/proc/self/fd/{number}")
    return {number: path for number, path in found.items() if not path.startswith(("/proc", "/dev", "pipe"))}


def run_case(scenario: Scenario, root: Path, call="", number=-1, error="EIO", lasting=False) -> dict:
    folder = root / "case"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    scenario.prepare(folder)
    os.environ["XDG_CACHE_HOME"] = str(root / "cache")
    before, began = _open_files(), time.monotonic()
    problems = []
    done = {}
    with failing(folder, call, number, error, lasting) as counts:
        try:
            done = scenario.act(folder)
        except Exception:
            problems.append(f"raised: {traceback.format_exc()}")
    if leaked := set(_open_files().items()) - set(before.items()):
        problems.append(f"files left open: {leaked}")
    harmless = not call or (error in ("EINTR", "SHORT") and call not in ("close",))
    if done:
        problems += scenario.check(folder, done, harmless)
    # What cannot be removed stays.
    if call in ("unlink", "open", "stat", "chmod", "close") or lasting:
        problems = [problem for problem in problems if not (call == "unlink" and problem.startswith("left: "))]
    outcome = "raised"
    if "bag" in done:
        bag = done["bag"]
        outcome = f"{bag.write_errors} errors, {bag.not_written.total()} lost, {len(bag.torn_files)} torn"
    elif "done" in done:
        outcome = f"status {done['done'].status}"
    return {
        "scenario": scenario.name,
        "call": call,
        "point": number,
        "error": error + (" from then on" if lasting else ""),
        "outcome": outcome,
        "counts": counts,
        "seconds": round(time.monotonic() - began, 3),
        "problems": problems,
    }


def _cases(counts: dict[str, int], points: int, all_errors: bool):
    for call, errors in CALLS:
        total = counts[call]
        numbers = range(total) if total <= points else sorted(random.Random(call).sample(range(total), points))
        for k, number in enumerate(numbers):
            for error in errors if all_errors else [errors[k % len(errors)]]:
                yield call, number, error, False
                if (call, error) in LASTING:
                    yield call, number, error, True


def work(args, root: Path):
    global SHARED
    import corruption
    from base_bags import write_all

    SHARED = root / "inputs"
    SHARED.mkdir()
    write_all(root)
    corruption._as_recorded(root / "streams.mcap", SHARED / "sound.mcap", "none")
    data = (SHARED / "sound.mcap").read_bytes()
    (SHARED / "cut.mcap").write_bytes(data[: len(data) * 3 // 4])
    messages = len(corruption.meaning(data)[0])
    for scenario in scenarios(messages):
        if args.only and args.only not in scenario.name:
            continue
        run_case(scenario, root)  # loads fonts and modules
        first = run_case(scenario, root)
        yield first | {"call": "(none)"}
        for case in _cases(first["counts"], args.points, args.all_errors):
            yield run_case(scenario, root, *case)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--points", type=int, default=10**6)
    parser.add_argument("--all-errors", action="store_true", help="every error at each point, instead of one in turn")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        root = Path(name).resolve()
        if not args.json:  # from a shell: again, with the library
            if (library := build(root)) is None:
                sys.exit("no C compiler")
            rows = run(library, *sys.argv[1:])
            table = collections.Counter((r["scenario"], r["call"], r["error"], r["outcome"]) for r in rows)
            for (scenario, call, error, outcome), count in sorted(table.items()):
                print(f"{count:5} {scenario}: {call} {error}: {outcome}")
            bad = [row for row in rows if row["problems"]]
            for row in bad:
                print(json.dumps(row))
            print(f"{len(rows)} cases, {len(bad)} with problems")
            return 1 if bad else 0
        out = os.fdopen(os.dup(1), "w")
        bad = False
        for row in work(args, root):
            print(json.dumps(row), file=out, flush=True)
            bad |= bool(row["problems"])
        return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
