# SPDX-License-Identifier: Apache-2.0
"""Choose the reader of a sequence."""

import difflib
import glob
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from .. import arguments
from ..mesh_files.errors import shortened
from . import arrays, gltf, point_caches, recording, usd
from .mesh_folder import SUFFIXES, MeshFolder, in_folder
from .sequence import FrameSequence, SequenceError, reading
from .splitting import SplitSequence

# Formats that hold all frames in one file.
WHOLE = (*arrays.SUFFIXES, *usd.SUFFIXES, *gltf.SUFFIXES, *point_caches.SUFFIXES, *recording.SUFFIXES)
PathLike = str | os.PathLike[str]


def open_sequence(
    paths: PathLike | Sequence[PathLike], *, faces: PathLike | None = None, split: bool = False
) -> FrameSequence:
    """Open a sequence of frames. Frames are read when they are asked for.

    Parameters
    ----------
    paths : str, os.PathLike, or a sequence of them
        A folder of mesh files, a pattern such as ``"frames/*.obj"``, or files in any order; or one NPZ, NPY, USD, glTF,
        PC2, PC16, MDD or MCAP file with all frames.
    faces : str or os.PathLike, optional
        The faces of a format that has none (NPY, PC2, PC16, MDD): a mesh file, or integers (F, 3) in NPY or NPZ.
    split : bool
        Connected components of each mesh become meshes of their own.

    Returns
    -------
    FrameSequence
        Each frame (``frame(k)``, or in a loop) has the positions (V, 3) float64 and the faces (F, 3) uint32 of each
        mesh.

    Raises
    ------
    SequenceError
        A file is missing, damaged, of an unknown format or does not fit the others. The message names the file, the
        problem and the remedy.

    Notes
    -----
    Contents of each format; parts that are ignored or rejected:

    - Mesh files (OBJ, PLY, STL and DAE as for :func:`hpccd_core.load_mesh`; VTK, VTU): names differ by the
      frame number; ``missing`` counts those that are absent, relative to the usual difference. Files with other
      names are other meshes of the same frames, as in ``cloth_0001.obj``, ``body_0001.obj``; a single file beside many
      is a static mesh. A folder may contain other files, but only one of these formats. STL has no vertex numbers:
      corners are joined as in the first frame where that fits. Of VTK: polygons, and the boundaries of tetrahedra.
    - NPZ, NPY: positions (frames, vertices, 3) in float16, float32 or float64, read one frame at a time. Their names in
      NPZ are ``vertices``, ``positions``, ``points`` or ``v``, with ``faces``, ``triangles`` or ``f`` (faces, 3); of
      several meshes ``NAME_vertices`` and ``NAME_faces``. Positions (vertices, 3) are those of a static mesh.
    - USD: all Mesh prims with references, payloads and instances, at the times of all samples of points, topology and
      transforms; placed by their transforms, in metres. Ignored: invisible meshes, purposes guide and proxy,
      holes, subdivision, other prims. Rejected: skeletons and blend shapes that are not baked.
    - glTF, GLB: nodes of the default scene at the key times of all animations, with morph targets and skins. Vertices
      that coincide in all frames, as at seams of textures, are joined. Rejected: Draco and meshopt.
    - PC2, PC16 (PC2 in float16), MDD: positions of one mesh.
    - MCAP: recordings of the ROS node whose meshes all come from MeshVertices in one coordinate frame. Frames are
      joined by their stamps.

    Polygons are split into triangles by their shape in the first frame, so that faces do not change while a mesh
    deforms. NaN, infinities and coordinates beyond 1e150 are rejected.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from hpccd_core.sequences import open_sequence
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> for number in (1, 2, 10):
    ...     _ = (folder / f"sheet_{number}.obj").write_text(f"v 0 0 {number}\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> sequence = open_sequence(folder)
    >>> [frame.name for frame in sequence]
    ['sheet_1.obj', 'sheet_2.obj', 'sheet_10.obj']
    >>> sequence.notes
    ('frames 3 to 9 are missing between sheet_2.obj and sheet_10.obj',)
    """
    split = arguments.flag("split", split)
    given = list(paths) if isinstance(paths, Iterable) and not isinstance(paths, (str, bytes)) else [paths]
    if not given:
        raise SequenceError("paths: no file is given; give a folder, a pattern or files")
    names = [_name("paths", path) for path in given]
    source = shortened(names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more")
    of_faces = None if faces is None else Path(os.path.expanduser(_name("faces", faces)))
    with reading(source):
        sequence = _opened(names, source, of_faces)
    return SplitSequence(sequence) if split else sequence


def _name(argument: str, path: object) -> str:
    if not isinstance(path, (str, os.PathLike)) or not isinstance(name := os.fspath(path), str):
        raise TypeError(f"{argument}: expected the name of a file as str or Path, got {type(path).__name__}")
    if not name:
        raise SequenceError(f"{argument}: a name is empty; give a folder, a pattern or files")
    return name


def _opened(names: list[str], source: str, faces: Path | None) -> FrameSequence:
    files = _files(names)
    suffixes = {file.suffix.lower() for file in files}
    if suffixes <= set(SUFFIXES):
        if faces is not None:
            raise SequenceError(f"{source}: has faces of its own; leave out faces (--faces)")
        return MeshFolder(files, source)
    if len(files) > 1:
        whole = next(file for file in files if file.suffix.lower() not in SUFFIXES)
        raise SequenceError(f"{shortened(whole)}: has all frames of a sequence; give it alone")
    suffix = suffixes.pop()
    if suffix in arrays.SUFFIXES:
        return arrays.ArrayFile(files[0], faces)
    if suffix in point_caches.SUFFIXES:
        return point_caches.PointCache(files[0], faces)
    if faces is not None:
        raise SequenceError(f"{source}: has faces of its own; leave out faces (--faces)")
    if suffix in usd.SUFFIXES:
        return usd.UsdStage(files[0])
    return gltf.GltfScene(files[0]) if suffix in gltf.SUFFIXES else recording.Recording(files[0])


def _no_file(path: Path) -> SequenceError:
    what = "a folder" if path.is_dir() else "a broken link" if not path.exists() else "a device or a pipe"
    return SequenceError(f"{shortened(path)}: is {what}; give a regular file")


def _files(names: list[str]) -> list[Path]:
    """The files of folders, patterns and paths."""
    files: list[Path] = []
    for name in names:
        path = Path(os.path.expanduser(name))
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
        elif os.path.lexists(path):
            raise _no_file(path)
        else:
            raise SequenceError(
                f"{shortened(name)}: no such file or folder{_nearest(path)} (relative paths start from {Path.cwd()})"
            )
    for file in files:
        if not file.is_file():
            raise _no_file(file)
        if file.suffix.lower() not in (*SUFFIXES, *WHOLE):
            raise SequenceError(
                f"{shortened(file)}: unknown format; use one of {', '.join((*SUFFIXES, *WHOLE))}; other files are "
                "ignored in a folder"
            )
    return list(dict.fromkeys(files))  # patterns may overlap


def _nearest(path: Path) -> str:
    """The end of an error message: the name in the same folder that is spelled most like the path, if one is."""
    try:
        near = difflib.get_close_matches(path.name, os.listdir(path.parent), n=1, cutoff=0.8)
    except OSError:
        return ""
    return f"; did you mean {shortened(path.with_name(near[0]))}?" if near else ""
