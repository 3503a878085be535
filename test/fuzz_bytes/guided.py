# SPDX-License-Identifier: Apache-2.0
"""One target under Atheris, in a process of its own: libFuzzer ends the process, and instruments only what is imported
later.

python -m fuzz_bytes.guided TARGET FAULTS [ARGUMENTS OF LIBFUZZER]
"""

import hashlib
import io
import os
import sys
import traceback
from pathlib import Path
from random import Random

import atheris

from .target import Fault

INSTRUMENTED = ["hpccd_core", "hpccd_ros", "mcap", "mcap_ros2", "collada", "meshio", "yaml"]


def main() -> None:
    name, folder, *arguments = sys.argv[1:]
    with atheris.instrument_imports(include=INSTRUMENTED, enable_loader_override=False):
        from . import targets

        target = targets.load(name.partition(".")[0])[name]
        for seed in target.seeds():  # imports what is imported late
            target(seed)
    faults = Faults(Path(folder))
    sys.stdout = io.StringIO()

    def one(data: bytes) -> None:
        sys.stdout.seek(0)
        sys.stdout.truncate()
        try:
            target(data)
        except Exception as error:
            faults.add(data, error)

    def mutated(data: bytes, most: int, seed: int) -> bytes:
        return target.mutate(Random(seed), data, atheris.Mutate)[:most]

    options = {} if target.mutate.__name__ == "anywhere" else {"custom_mutator": mutated}
    atheris.Setup([sys.argv[0], *arguments], one, **options)
    atheris.Fuzz()


class Faults:
    """The first input of each fault, in a folder: libFuzzer would stop at the first one, and find it again."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known = {path.name.partition("-")[0] for path in folder.glob("*-*")}

    def add(self, data: bytes, error: Exception) -> None:
        # An error with an improper message is known by where it was raised.
        source = error.__cause__ if isinstance(error, Fault) and error.__cause__ is not None else error
        place = traceback.extract_tb(source.__traceback__)[-1]
        key = hashlib.sha256(repr((type(error), place.filename, place.lineno)).encode()).hexdigest()[:8]
        if key in self._known:
            return
        self._known.add(key)
        (self._folder / f"{key}-{type(error).__name__}").write_bytes(data)
        text = "".join(traceback.format_exception(error))
        (self._folder / f"{key}-{type(error).__name__}.txt").write_text(text, errors="backslashreplace")
        print(
            f"FAULT {key} {type(error).__name__} {place.filename}:{place.lineno} {str(error)[:200]!a}", file=sys.stderr
        )


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
