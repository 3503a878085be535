# SPDX-License-Identifier: Apache-2.0
"""Write a file atomically: its name never refers to a partial file."""

import contextlib
import errno
import os
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

# Characters of the file's name in that of the hidden folder beside it.
_SHOWN = 32
# Errors of writing to an open file, which name none: of a full disk, and of a failing one.
FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
FAILING = (errno.EIO, errno.EINTR)


def no_folder(path: str | Path) -> str:
    """That the folder of the file ``path`` does not exist, and the remedy; "": it does."""
    folder = Path(path).parent
    return "" if folder.is_dir() else f"there is no folder {folder}; create it"


@contextlib.contextmanager
def whole_file(path: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """The place to write to. Its content becomes the file `path` when the block ends without an exception.

    After an exception, an interrupt included, what was at `path` is unchanged and nothing else is left. The place has
    the name of `path`, in a hidden folder beside it, so writers that read the format from the name find it; a killed
    process leaves that folder. A device or a pipe is written to directly.

    Raises FileExistsError if `path` exists and may not be overwritten, FileNotFoundError if its folder does not exist.
    An OSError about the place, or of a full or failing disk, names `path`.
    """
    shown = str(path)
    target = Path(os.path.realpath(path))  # a link stays, and its file is replaced
    folder = own = None  # own: how names of the place begin in errors
    try:
        if _is_device(path):
            own = shown
            yield Path(path)  # not resolved: what /dev/stdout leads to may have no name
            return
        if os.path.lexists(target):
            if not overwrite:
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
            if target.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if why := no_folder(path) or no_folder(target):
            raise FileNotFoundError(errno.ENOENT, why)
        # Its name is known before it is made, so that an interrupt in between removes it too.
        folder = target.parent / f".{target.name[:_SHOWN]}.{os.urandom(8).hex()}.part"
        folder.mkdir(mode=0o700)
        own = str(folder)
        draft = folder / target.name
        yield draft
        if overwrite:
            if target.exists():
                shutil.copymode(target, draft)
            os.replace(draft, target)
        else:
            _move_to_free_name(draft, target)
    except OSError as error:
        unnamed = error.errno in FULL or (error.errno in FAILING and error.filename is None)
        if own is None or str(error.filename or "").startswith(own) or unnamed:
            error.filename = shown
        raise
    finally:
        if folder is not None:
            _remove(folder, folder / target.name)


def _remove(folder: Path, draft: Path) -> None:
    """Remove a folder with a file; what cannot be removed stays."""
    with contextlib.suppress(OSError):
        os.unlink(draft)  # in most cases the only file: neither this nor rmdir needs a free file descriptor
    for remove in (os.rmdir, shutil.rmtree, shutil.rmtree):  # twice, because most errors do not last
        with contextlib.suppress(OSError):
            remove(folder)
            return


def _is_device(path: str | Path) -> bool:
    """Whether there is something that is neither a file nor a folder."""
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _move_to_free_name(draft: Path, target: Path) -> None:
    """Raises FileExistsError if `target` has been made meanwhile."""
    try:
        os.link(draft, target)
    except (FileExistsError, FileNotFoundError):
        raise
    except OSError:  # a file system without hard links
        with open(target, "xb"):
            try:
                os.replace(draft, target)
            except OSError:
                os.unlink(target)
                raise
