# SPDX-License-Identifier: Apache-2.0
"""Order of files by the frame numbers in their names."""

import os
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from ..mesh_files.errors import shortened
from .sequence import SequenceError

_NUMBER = re.compile(r"((?:(?<=[ ._])-)?[0-9]+)")  # frames before the first one, as in f_-2.obj, are negative
_FRACTION = re.compile(r"(.*[0-9])\.[0-9]+", re.DOTALL)
_SEPARATORS = " ._-/"
_MOST_NOTES = 10  # places with missing frames that are listed one by one


@dataclass(frozen=True)
class Numbered:
    """Files by mesh and frame.

    Parameters
    ----------
    meshes : dict of str to list of Path
        The files of each mesh in order of their frames; one file only if the mesh is static, or if there is one frame.
    n_frames : int
        The number of frames.
    missing : dict of int to int
        The number of frames that are missing right before a frame.
    notes : tuple of str
        Sentences about missing frames and static meshes.
    names : dict of Path to str
        The name of each file, relative to the folder that contains all files.
    """

    meshes: dict[str, list[Path]]
    n_frames: int
    missing: dict[int, int]
    notes: tuple[str, ...]
    names: dict[Path, str]


def arrange(files: list[Path]) -> Numbered:
    """Sort files into meshes and frames.

    Where names differ in several numbers, the one with the most values is that of the frame; if several have as many,
    the last one. The rest of a name is the mesh.

    Raises
    ------
    SequenceError
        Two files have the same number, numbers have fractions, or meshes have different frames.
    """
    found: dict[tuple[str, str], dict[int, Path]] = {}
    names = dict(zip(files, _relative(files), strict=True))
    stems = [name.removesuffix(file.suffix) for file, name in names.items()]
    _reject_fractions(dict(zip(stems, files, strict=True)))
    parts = _parts(stems)
    for file, (prefix, number, suffix) in zip(names, parts, strict=True):
        of_mesh = found.setdefault((prefix, suffix), {})
        if number in of_mesh:
            raise SequenceError(
                f"{file}: has the same frame number as {of_mesh[number]}; keep one of them or number them apart"
            )
        of_mesh[number] = file
    numbers = _common_numbers(found)
    meshes = _named(found)
    notes = []
    if len(numbers) > 1:
        static = [name for name, of_mesh in meshes.items() if len(of_mesh) == 1]
        notes += [f"{names[meshes[name][0]]} is one file: its mesh is the same in all frames" for name in static]
    elif len(files) > 1:
        notes.append(f"no two files differ in their frame number only: the {len(files)} files are meshes of one frame")
    if numbered := _apart_by_numbers(meshes):
        named = shortened(numbered, 100)
        notes.append(
            f"files differ in several numbers: one counts frames, the others are parts of mesh names ({named})"
        )
    moving = next((of_mesh for of_mesh in meshes.values() if len(of_mesh) > 1), [])
    missing, of_missing = missing_between(numbers, [names[file] for file in moving])
    return Numbered(meshes, max(1, len(numbers)), missing, (*notes, *of_missing), names)


def _apart_by_numbers(meshes: dict[str, list[Path]]) -> str:
    """The names of meshes that differ in numbers only: these could be parts of a time such as 0.25."""
    texts = {name: _NUMBER.sub("", name) for name, of_mesh in meshes.items() if len(of_mesh) > 1}
    counts = Counter(texts.values())
    return ", ".join(name for name, text in texts.items() if counts[text] > 1)


def _relative(files: list[Path]) -> list[str]:
    """Names of files, relative to the folder that contains all of them."""
    if len({file.parent for file in files}) == 1:
        return [file.name for file in files]
    common = os.path.commonpath([file.absolute().parent for file in files])
    return [file.absolute().relative_to(common).as_posix() for file in files]


def _reject_fractions(files: dict[str, Path]) -> None:
    """Raises SequenceError for names such as cloth.1.25 beside cloth.1 and cloth.2: no order by whole numbers fits."""
    pairs = [(name, match[1]) for name in files if (match := _FRACTION.fullmatch(name)) and match[1] in files]
    if len({whole for _, whole in pairs}) > 1:
        name, whole = min(pairs)
        raise SequenceError(
            f"{files[name]}: its number looks like a fraction of a frame, because {files[whole].name} is there too; "
            "number all frames by whole numbers"
        )


def _parts(names: list[str]) -> list[tuple[str, int, str]]:
    """(text before the frame number, that number, text after it) of each name; without digits the number is 0."""
    pieces = [_NUMBER.split(name) for name in names]  # text, digits, text, ...
    alike: dict[tuple[str, ...], list[list[str]]] = {}
    for split in pieces:
        alike.setdefault(tuple(split[::2]), []).append(split)
    place = {
        texts: max(range(1, len(of[0]), 2), key=lambda k: (len({int(split[k]) for split in of}), k), default=0)
        for texts, of in alike.items()
    }
    found = []
    for name, split in zip(names, pieces, strict=True):
        k = place[tuple(split[::2])]
        found.append(("".join(split[:k]), int(split[k]), "".join(split[k + 1 :])) if k else (name, 0, ""))
    return found


def _common_numbers(found: dict[tuple[str, str], dict[int, Path]]) -> list[int]:
    """The sorted frame numbers of all meshes that have several; empty if none has."""
    moving = [of_mesh for of_mesh in found.values() if len(of_mesh) > 1]
    for other in moving[1:]:
        if apart := sorted(moving[0].keys() ^ other.keys()):
            first, second = (moving[0], other) if apart[0] in moving[0] else (other, moving[0])
            number = apart[0]
            raise SequenceError(
                f"{first[number]}: {second[min(second)].name} and the other files of its mesh have no frame {number}; "
                "give each mesh the same frame numbers, or check the meshes one at a time"
            )
    return sorted(moving[0]) if moving else []


def _named(found: dict[tuple[str, str], dict[int, Path]]) -> dict[str, list[Path]]:
    """Files of each mesh, sorted by the names of the meshes."""
    names = {}
    for (prefix, suffix), of_mesh in found.items():
        parts = [part.strip(_SEPARATORS) for part in (prefix, suffix)]
        only = next(iter(of_mesh.values()))
        names[prefix, suffix] = "_".join(filter(None, parts)) or "mesh" if len(of_mesh) > 1 else only.stem
    if len(set(names.values())) < len(names):
        names = {(prefix, suffix): f"{prefix}#{suffix}" for prefix, suffix in names}
    return {
        names[key]: [found[key][number] for number in sorted(found[key])]
        for key in sorted(names, key=lambda key: names[key])
    }


def missing_between(numbers: list[int], names: list[str]) -> tuple[dict[int, int], list[str]]:
    """(frames missing right before a frame, notes), relative to the most common difference of frame numbers."""
    differences = Counter(b - a for a, b in zip(numbers, numbers[1:], strict=False))
    if not differences or min(differences) < 1:
        return {}, []
    step = min(differences, key=lambda difference: (-differences[difference], difference))
    missing, notes = {}, []
    for k, (a, b) in enumerate(zip(numbers, numbers[1:], strict=False), 1):
        if (count := (b - a - 1) // step) > 0:
            missing[k] = count
            what = f"frame {a + step} is" if count == 1 else f"frames {a + step} to {a + count * step} are"
            notes.append(f"{what} missing between {names[k - 1]} and {names[k]}")
    if len(notes) > _MOST_NOTES:
        rest = sum(list(missing.values())[_MOST_NOTES:])
        notes[_MOST_NOTES:] = [f"{rest} more frames are missing in {len(notes) - _MOST_NOTES} more places"]
    if step > 1:
        notes.insert(0, f"frame numbers increase by {step}")
    return missing, notes
