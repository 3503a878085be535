# SPDX-License-Identifier: Apache-2.0
"""Write a file atomically: its name never refers to a partial file."""

import contextlib
import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

# Characters of the file's name in that of the hidden folder beside it.
_SHOWN = 32
# Errors of writing to an open file, which name none.
FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


@contextlib.contextmanager
def whole_file(path: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """The place to write to. Its content becomes the file `path` when the block ends without an exception.

    After an exception, an interrupt included, what was at `path` is unchanged and nothing else is left. The place has
    the name of `path`, in a hidden folder beside it, so writers that read the format from the name find it. A device or
    a pipe is written to directly.

    Raises FileExistsError if `path` exists and may not be overwritten. An OSError about the place or a full disk names
    `path`.
    """
    shown = str(path)
    target = Path(os.path.realpath(path))  # a link stays, and its file is replaced
    if os.path.lexists(target):
        if not overwrite:
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), shown)
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), shown)
        if not target.is_file():
            yield target
            return
        if not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), shown)
    folder = None
    try:
        folder = Path(tempfile.mkdtemp(prefix=f".{target.name[:_SHOWN]}.", suffix=".part", dir=target.parent))
        draft = folder / target.name
        yield draft
        if overwrite:
            if target.exists():
                shutil.copymode(target, draft)
            os.replace(draft, target)
        else:
            _move_to_free_name(draft, target)
    except OSError as error:
        about = str(error.filename or "")
        if folder is None or about.startswith(str(folder)) or error.errno in FULL:
            error.filename = shown
        raise
    finally:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)


def _move_to_free_name(draft: Path, target: Path) -> None:
    """Raises FileExistsError if `target` has been made meanwhile."""
    try:
        os.link(draft, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        with open(target, "xb"):
            os.replace(draft, target)
