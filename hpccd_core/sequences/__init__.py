# SPDX-License-Identifier: Apache-2.0
"""Readers of frame sequences: one mesh file a frame, arrays, USD, glTF, point caches, recordings."""

from .opening import open_sequence
from .sequence import Frame, FrameSequence, SequenceError, SequenceMesh

__all__ = ["Frame", "FrameSequence", "SequenceError", "SequenceMesh", "open_sequence"]
