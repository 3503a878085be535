# SPDX-License-Identifier: Apache-2.0
"""Choose the reader of a sequence."""

import glob
import os
from collections.abc import Sequence
from pathlib import Path

from ..mesh_files.errors import shortened
from . import gltf, usd
from .arrays import ArrayFile
from .mesh_folder import SUFFIXES, MeshFolder, in_folder
from .point_caches import PointCache
from .recording import Recording
from .sequence import FrameSequence, SequenceError, reading
from .splitting import SplitSequence

# Formats that hold all frames in one file.
WHOLE = (".npz", ".npy", ".pc2", ".mdd", *usd.SUFFIXES, *gltf.SUFFIXES, ".mcap")
PathLike = str | os.PathLike[str]


def open_sequence(
    paths: PathLike | Sequence[PathLike], *, faces: PathLike | None = None, split: bool = False
) -> FrameSequence:
    """Open a sequence of frames. Frames are read when they are asked for.

    Parameters
    ----------
    paths : str, os.PathLike, or a sequence of them
        A folder of mesh files, a pattern such as ``"frames/*.obj"``, or files in any order; or one NPZ, NPY, USD, glTF,
        PC2, MDD or MCAP file with all frames.
    faces : str or os.PathLike, optional
        The faces of a format that has none (NPY, PC2, MDD): a mesh file, or integers (F, 3) in NPY or NPZ.
    split : bool
        Connected components of each mesh become meshes of their own.

    Returns
    -------
    FrameSequence
        Its ``frame(k)`` has the positions (V, 3) float64 and the faces (F, 3) uint32 of each mesh.

    Raises
    ------
    SequenceError
        A file is missing, damaged, of an unknown format or does not fit the others. The message names the file, the
        problem and the remedy.

    Notes
    -----
    The last digits of a file name are its frame number. Files with other names are other meshes of the same frames, as
    in ``cloth_0001.obj``, ``body_0001.obj``; a single file beside many is a static mesh.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from hpccd_core.sequences import open_sequence
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> for number in (1, 2, 10):
    ...     _ = (folder / f"sheet_{number}.obj").write_text(f"v 0 0 {number}\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> sequence = open_sequence(folder)
    >>> [sequence.frame(k).name for k in range(len(sequence))]
    ['sheet_1.obj', 'sheet_2.obj', 'sheet_10.obj']
    >>> sequence.notes
    ('frames 3 to 9 are missing between sheet_2.obj and sheet_10.obj',)
    """
    given = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    if not given:
        raise SequenceError("paths: no file is given; give a folder, a pattern or files")
    names = [os.fspath(path) for path in given]
    source = shortened(names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more")
    with reading(source):
        sequence = _opened(names, source, None if faces is None else Path(faces).expanduser())
    return SplitSequence(sequence) if split else sequence


def _opened(names: list[str], source: str, faces: Path | None) -> FrameSequence:
    files = _files(names)
    suffixes = {file.suffix.lower() for file in files}
    if suffixes <= set(SUFFIXES):
        if faces is not None:
            raise SequenceError(f"{source}: has faces of its own; leave out faces (--faces)")
        return MeshFolder(files, source)
    if len(files) > 1:
        whole = next(file for file in files if file.suffix.lower() not in SUFFIXES)
        raise SequenceError(f"{shortened(whole)}: is a whole sequence; give it alone")
    suffix = suffixes.pop()
    match suffix:
        case ".npz" | ".npy":
            return ArrayFile(files[0], faces)
        case ".pc2" | ".mdd":
            return PointCache(files[0], faces)
    if faces is not None:
        raise SequenceError(f"{source}: has faces of its own; leave out faces (--faces)")
    if suffix == ".mcap":
        return Recording(files[0])
    return usd.UsdStage(files[0]) if suffix in usd.SUFFIXES else gltf.GltfScene(files[0])


def _files(names: list[str]) -> list[Path]:
    """The files of folders, patterns and paths."""
    files: list[Path] = []
    for name in names:
        path = Path(name).expanduser()
        if path.is_dir():
            if len(names) > 1:
                raise SequenceError(f"{shortened(name)}: is a folder among other paths; give one folder, or files")
            return in_folder(path)
        if path.is_file():
            files.append(path)
        elif glob.has_magic(name):
            found = [Path(match) for match in sorted(glob.glob(str(path)))]
            if not found:
                raise SequenceError(f"{shortened(name)}: no file matches this pattern (from {Path.cwd()}); correct it")
            files += found
        else:
            raise SequenceError(f"{shortened(name)}: no such file or folder (relative paths start from {Path.cwd()})")
    for file in files:
        if file.suffix.lower() not in (*SUFFIXES, *WHOLE):
            raise SequenceError(f"{shortened(file)}: unknown format; use one of {', '.join((*SUFFIXES, *WHOLE))}")
    return files
