# SPDX-License-Identifier: Apache-2.0
"""`hpccd doctor`: reports the result of an examination of a recording."""

from datetime import UTC, datetime
from pathlib import Path

from hpccd_ros.bag.examine import Examination, examine
from hpccd_ros.bag.reader import Recording, recording_files
from hpccd_ros.bag.recover import recover
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted, printable


def main(args) -> int:
    """Examine, and recover if requested. 0: sound or recovered, 1: damaged.

    Raises UserError if nothing can be saved.
    """
    files = recording_files(Path(args.file))
    if args.recover:
        if len(files) != 1:
            raise UserError(f"--recover takes one file; {args.file} has {len(files)}: recover each by itself")
        return _recover(files[0], args)
    examinations = [examine(path) for path in files]
    for examination in examinations:
        _print_examination(examination)
    if all(e.sound for e in examinations):
        _read(args.file)
        return 0
    if not any(e.message_count for e in examinations):
        raise UserError(f"{args.file} has no complete message: it is not a recording, or nothing is left of it")
    return 1


def _recover(source, args) -> int:
    try:
        found = recover(source, args.recover, args.compression)
    except FileExistsError as error:
        raise UserError(f"--recover {args.recover}: exists; recordings are not overwritten") from error
    except OSError as error:
        raise UserError(f"--recover {args.recover}: {error.strerror}") from error
    _print_examination(found)
    print(f"saved {counted(found.message_count, 'message')}, {_seconds(found):.3f} s: {args.recover}")
    return 0


def _read(path) -> None:
    """Raises RecordingError if the reader of the other commands cannot read all of it."""
    with Recording(path) as recording:
        for _ in recording.messages():
            pass
        for note in recording.notes:
            print(f"  {note}")


def _print_examination(found: Examination) -> None:
    print(f"{found.path}: {_verdict(found)}")
    print(
        f"  {found.size:,} bytes, written by {printable(found.library) or '?'}, "
        f"profile {printable(found.profile) or '?'}, {counted(found.chunks, 'chunk')}, compression {found.compression}"
    )
    if found.message_count:
        begin = datetime.fromtimestamp(found.start * 1e-9, UTC).strftime("%Y-%m-%d %H:%M:%S")
        print(f"  {counted(found.message_count, 'message')} in {_seconds(found):.3f} s from {begin} UTC")
    for topic, count in found.counts.items():
        print(f"    {count:7} {printable(topic)}  {printable(found.types.get(topic, '(type unknown)'))}")
    if found.problem:
        print(f"  readable up to byte {found.readable:,}; the first problem: {printable(found.problem)}")
    if found.damaged_chunks:
        print(
            f"  {counted(found.damaged_chunks, 'damaged chunk')} skipped"
            + (f", and {counted(found.orphans, 'message')} that only they described" if found.orphans else "")
        )
    if not found.sound and found.message_count:
        print(f"  `hpccd doctor {found.path} --recover OUT.mcap` saves the messages above")


def _verdict(found: Examination) -> str:
    if found.sound:
        return "sound"
    if found.message_count == 0:
        return "NO WHOLE MESSAGE"
    if found.damaged_chunks or found.ended:
        return "DAMAGED"
    return "CUT OFF, not finished by its recorder"


def _seconds(found: Examination) -> float:
    return (found.end - found.start) * 1e-9
