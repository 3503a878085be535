# SPDX-License-Identifier: Apache-2.0
"""Targets: functions that read untrusted bytes, and the errors that they may raise."""

import atexit
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from .mutations import Mutate, anywhere

# Characters of a message: hpccd_ros/base/quoting.py quotes at most ten names of 80 characters, or 1,000 of a text.
LONGEST_MESSAGE = 4000


class Fault(AssertionError):
    """A promise that was broken: by the text of an error, or by a result."""


@dataclass(frozen=True)
class Target:
    """``read`` takes the bytes of an input and raises nothing but ``errors``, whose messages are one printable line.

    ``seeds``: valid inputs. ``mutate``: (random generator, input, mutation of bytes) -> another input, for formats with
    lengths or checksums. ``largest``: bytes of an input. ``words``: of the format, put into inputs. ``seconds``: for
    one input. ``needs``: packages of extras. ``native``: it is read by a library that damaged inputs may crash, so that
    the test suite makes no new ones.
    """

    read: Callable[[bytes], object]
    seeds: Callable[[], list[bytes]]
    errors: tuple[type[Exception], ...]
    mutate: Callable[[Random, bytes, Mutate], bytes] = anywhere
    largest: int = 2000
    words: tuple[bytes, ...] = field(default=(), repr=False)
    seconds: int = 10
    needs: tuple[str, ...] = ()
    native: bool = False

    def __call__(self, data: bytes) -> None:
        try:
            self.read(data)
        except self.errors as error:
            text = str(error)
            if not text or len(text) > LONGEST_MESSAGE or not text.isprintable():
                raise Fault(f"the message of {type(error).__name__} is {text[:500]!r}") from error


def _folder() -> Path:
    """A folder in memory, for code that takes paths only."""
    memory = Path("/dev/shm")
    folder = Path(tempfile.mkdtemp(prefix="hpccd-fuzz-", dir=memory if os.access(memory, os.W_OK) else None))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


FOLDER = _folder()


def file_of(data: bytes, name: str) -> Path:
    """A file with these bytes."""
    path = FOLDER / name
    path.write_bytes(data)
    return path


def missing(name: str) -> Path:
    """The path of a file that does not exist, to be written."""
    path = FOLDER / name
    path.unlink(missing_ok=True)
    return path
