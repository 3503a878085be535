# SPDX-License-Identifier: Apache-2.0
"""A sequence of frames: what all readers return."""

from __future__ import annotations

import contextlib
import operator
import os
import threading
import uuid
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import MeshFileError, shortened
from ..mesh_files.load import first_unusable

if TYPE_CHECKING:
    from typing import Self


class SequenceError(MeshFileError):
    """A sequence cannot be used. The message names the file, the problem and the remedy."""


@dataclass(frozen=True, eq=False)
class SequenceMesh:
    """One mesh of a frame.

    Parameters
    ----------
    name : str
        Unique within the frame.
    faces : (F, 3) uint32
        Triangles, as numbers of this mesh's own vertices.
    n_vertices : int
        The number of its vertices.
    """

    name: str
    faces: NDArray[np.uint32]
    n_vertices: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", _encodable(self.name))


@dataclass(frozen=True, eq=False)
class Frame:
    """The meshes and positions of one frame.

    Parameters
    ----------
    index : int
        Its number in the sequence, from 0.
    name : str
        The file name, or the file and the frame in it.
    meshes : tuple of SequenceMesh
        The same object from frame to frame while names, numbers of vertices and faces stay the same.
    vertices : (V, 3) float64
        Positions of all meshes, one mesh after the other, in the unit of the sequence.
    """

    index: int
    name: str
    meshes: tuple[SequenceMesh, ...]
    vertices: NDArray[np.float64]


class FrameSequence(ABC):
    """Frames in order, read when they are asked for. It can be pickled, and is used by one thread at a time.

    Parameters
    ----------
    source : str
        The files, for messages.
    n_frames : int
        The number of frames, at least 1.
    notes : tuple of str
        Sentences for a report: units, transforms, missing frames, number formats.
    missing : dict of int to int
        The number of frames that are missing right before a frame, for frames where some are.
    up : {"x", "y", "z"} or None
        The axis that points up, if the file says so.

    Raises
    ------
    SequenceError
        There are no frames.
    """

    _key: str
    _of_thread: tuple[tuple[int, int], dict[str, Any]] = ((0, 0), {})

    def __new__(cls, *_: Any, **__: Any) -> Self:
        made = super().__new__(cls)
        made._key = uuid.uuid4().hex  # kept by pickle
        return made

    def __init__(
        self,
        source: str,
        n_frames: int,
        notes: tuple[str, ...] = (),
        missing: dict[int, int] | None = None,
        up: str | None = None,
    ) -> None:
        if n_frames < 1:
            raise SequenceError(f"{source}: has no frames; export it again")
        self.source = _encodable(source)
        self.n_frames = n_frames
        self.notes = tuple(map(_encodable, notes))
        self.missing = missing or {}
        self.up = up

    def __len__(self) -> int:
        return self.n_frames

    def __iter__(self) -> Iterator[Frame]:
        return (self.frame(index) for index in range(self.n_frames))

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_of_thread"}

    @property
    def _opened(self) -> dict[str, Any]:
        """Open files and the last topology, of this thread: a child process would share the position in a file."""
        owner = os.getpid(), threading.get_ident()
        if self._of_thread[0] != owner:
            self._of_thread = owner, _shared((*owner, self._key))
        return self._of_thread[1]

    def frame(self, index: int) -> Frame:
        """Read one frame. Forward order is the cheapest.

        Parameters
        ----------
        index : int
            From 0 to ``n_frames - 1``.

        Returns
        -------
        Frame
            Its positions are finite and not larger than 1e150.

        Raises
        ------
        SequenceError
            A file is missing, damaged or holds no usable mesh.
        IndexError
            There is no such frame.
        """
        try:
            index = operator.index(index)
        except TypeError:
            raise TypeError(f"index: expected an integer, got {type(index).__name__}") from None
        if not 0 <= index < self.n_frames:
            raise IndexError(f"index: {index} is not a frame of {self.source}; use 0 to {self.n_frames - 1}")
        with reading(self.source):
            name, meshes, vertices = self._read(index)
        _check(name, meshes, vertices)
        return Frame(index, _encodable(name), meshes, vertices)

    @abstractmethod
    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        """(name, meshes, vertices) of a frame."""


def _encodable(text: str) -> str:
    """Bytes of a file name that are no UTF-8 are escaped, so that every report can hold it."""
    return text.encode("utf-8", "backslashreplace").decode()


# Workers of a pool get a new copy of a sequence with each part: the last ones keep their files open.
_MOST_OPEN = 4
_of_copies = threading.local()


def _shared(key: tuple[int, int, str]) -> dict[str, Any]:
    """The files that all copies of a sequence have opened in this thread."""
    states: dict[tuple[int, int, str], dict[str, Any]] = _of_copies.__dict__.setdefault("states", {})
    states[key] = states.pop(key, {})
    while len(states) > _MOST_OPEN:
        del states[next(iter(states))]
    return states[key]


@contextlib.contextmanager
def reading(source: str) -> Iterator[None]:
    """Turns errors of the system and of parsers into SequenceError."""
    try:
        yield
    except SequenceError:
        raise
    except MeshFileError as error:
        raise SequenceError(str(error)) from error
    except MemoryError as error:
        raise SequenceError(f"{source}: does not fit into memory; give a shorter or coarser sequence") from error
    except OSError as error:
        where = shortened(error.filename) if error.filename else source
        raise SequenceError(f"{where}: cannot be read: {error.strerror or error}; give another file") from error
    except Exception as error:  # parsers raise whatever they meet
        why = shortened(" ".join(str(error).split())) or type(error).__name__
        raise SequenceError(f"{source}: is damaged: {why}; copy or export it again") from error


def _check(name: str, meshes: tuple[SequenceMesh, ...], vertices: NDArray[np.float64]) -> None:
    """Raises SequenceError where a coordinate is not finite or too large."""
    if not len(vertices):
        raise SequenceError(f"{name}: has no vertices; export it again")
    if len(vertices) != (n := sum(mesh.n_vertices for mesh in meshes)):
        raise SequenceError(f"{name}: has {len(vertices)} positions of {n} vertices; export it again")
    names = Counter(mesh.name for mesh in meshes)
    if len(names) < len(meshes):
        raise SequenceError(
            f"{name}: has several meshes named {names.most_common(1)[0][0]!r}; give each a name of its own"
        )
    found = first_unusable(vertices)
    if found is None:
        return
    at, limits = found
    vertex = at
    for mesh in meshes:
        if vertex < mesh.n_vertices:
            break
        vertex -= mesh.n_vertices
    raise SequenceError(
        f"{name}: vertex {vertex} of mesh {mesh.name!r} is {vertices[at].tolist()}; coordinates must {limits}"
    )
