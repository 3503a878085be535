# SPDX-License-Identifier: Apache-2.0
"""A file appears whole, or not at all: whatever ends the writer, an earlier file stays and nothing lies beside it."""

import errno
import os
import signal
import threading

import pytest

from hpccd_core import whole_file as module
from hpccd_core.whole_file import whole_file


def _names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("overwrite", [True, False])
def test_content_appears_when_the_block_ends(tmp_path, overwrite):
    path = tmp_path / "run.png"
    with whole_file(path, overwrite=overwrite) as draft:
        assert draft.name == "run.png", "writers read the format from the name"
        draft.write_text("new")
        assert not path.exists()
    assert path.read_text() == "new" and _names(tmp_path) == ["run.png"]
    assert path.stat().st_mode & 0o777 == 0o666 & ~_umask()


def _umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_an_earlier_file_is_replaced_with_its_permissions(tmp_path):
    path = tmp_path / "run.png"
    path.write_text("old")
    path.chmod(0o640)
    with whole_file(path, overwrite=True) as draft:
        draft.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new" and path.stat().st_mode & 0o777 == 0o640 and _names(tmp_path) == ["run.png"]


def test_an_earlier_file_is_not_replaced_unless_asked_for(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_text("old")
    with pytest.raises(FileExistsError) as rejected, whole_file(path):
        pytest.fail("nothing is written")
    assert rejected.value.filename == str(path)
    assert path.read_text() == "old" and _names(tmp_path) == ["run.mcap"]


@pytest.mark.parametrize("links", [True, False], ids=["links", "no-links"])
def test_nor_is_one_that_was_made_meanwhile(tmp_path, monkeypatch, links):
    def no_links(*_):
        raise OSError(errno.EPERM, "no hard links here")

    if not links:
        monkeypatch.setattr(module.os, "link", no_links)
    path = tmp_path / "run.mcap"
    with pytest.raises(FileExistsError) as rejected, whole_file(path) as draft:
        draft.write_text("new")
        path.write_text("of another process")
    assert rejected.value.filename == str(path)
    assert path.read_text() == "of another process" and _names(tmp_path) == ["run.mcap"]
    path.unlink()
    with whole_file(path) as draft:
        draft.write_text("new")
    assert path.read_text() == "new" and _names(tmp_path) == ["run.mcap"]


@pytest.mark.parametrize("overwrite", [True, False])
@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt, "signal", OSError])
def test_a_failure_leaves_what_was_there(tmp_path, overwrite, failure):
    path = tmp_path / "run.png"
    if overwrite:
        path.write_text("old")
    expected = KeyboardInterrupt if failure == "signal" else failure
    with pytest.raises(expected), whole_file(path, overwrite=overwrite) as draft:
        draft.write_text("half")
        if failure == "signal":
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            threading.Event().wait(60)
        raise failure
    assert _names(tmp_path) == ["run.png"] * overwrite
    assert not overwrite or path.read_text() == "old"


def test_errors_name_the_file_and_not_the_draft(tmp_path):
    path = tmp_path / "run.png"
    with pytest.raises(OSError) as failed, whole_file(path) as draft:
        open(draft / "in a file that is no folder", "w")
    assert failed.value.filename == str(path)
    with pytest.raises(FileNotFoundError) as missing, whole_file(tmp_path / "no" / "run.png"):
        pytest.fail("there is no such folder")
    assert missing.value.filename == str(tmp_path / "no" / "run.png")
    assert missing.value.strerror == f"there is no folder {tmp_path / 'no'}; create it"
    (tmp_path / "link").symlink_to(tmp_path / "no" / "run.png")
    with pytest.raises(FileNotFoundError, match="there is no folder .*/no; create"), whole_file(tmp_path / "link"):
        pytest.fail("the link leads into no folder")
    (tmp_path / "link").unlink()
    with pytest.raises(OSError) as other, whole_file(path):
        open(tmp_path / "another file")
    assert other.value.filename == str(tmp_path / "another file")
    assert _names(tmp_path) == []


def test_a_link_stays_and_its_file_is_replaced(tmp_path):
    (tmp_path / "kept").mkdir()
    path, target = tmp_path / "latest.png", tmp_path / "kept" / "run.png"
    path.symlink_to(target)
    for text in ("first", "second"):
        with whole_file(path, overwrite=True) as draft:
            draft.write_text(text)
        assert path.is_symlink() and target.read_text() == text


def test_a_pipe_is_written_to_directly(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    read = []
    reader = threading.Thread(target=lambda: read.append(path.read_text()))
    reader.start()
    with whole_file(path, overwrite=True) as draft:
        draft.write_text("streamed")
    reader.join()
    assert read == ["streamed"] and _names(tmp_path) == ["pipe"]


def test_a_pipe_without_a_name_is_written_to_directly():
    read, write = os.pipe()
    with open(read) as reader:
        for overwrite in (True, False):
            with whole_file(f"/dev/fd/{write}", overwrite=overwrite) as draft:
                draft.write_text("streamed\n")
            assert reader.readline() == "streamed\n"
        os.close(write)
    with pytest.raises(OSError) as full, whole_file("/dev/full") as draft:
        draft.write_text("x")
    assert (full.value.errno, full.value.filename) == (errno.ENOSPC, "/dev/full")


@pytest.mark.parametrize("links", [True, False], ids=["links", "no-links"])
@pytest.mark.parametrize("overwrite", [True, False])
def test_a_writer_that_writes_nothing_makes_no_file(tmp_path, monkeypatch, overwrite, links):
    def no_links(*_):
        raise OSError(errno.EPERM, "no hard links here")

    if not links:
        monkeypatch.setattr(module.os, "link", no_links)
    with pytest.raises(FileNotFoundError) as missing, whole_file(tmp_path / "run.png", overwrite=overwrite):
        pass
    assert missing.value.filename == str(tmp_path / "run.png") and _names(tmp_path) == []


def test_links_in_a_circle_are_an_error_that_names_the_file(tmp_path):
    (tmp_path / "run.png").symlink_to("run.png")
    with pytest.raises(OSError) as circle, whole_file(tmp_path / "run.png", overwrite=True):
        pytest.fail("nothing is written")
    assert circle.value.filename == str(tmp_path / "run.png") and _names(tmp_path) == ["run.png"]


@pytest.mark.parametrize("name", ["a" * 255, "ü" * 127])
def test_the_longest_names(tmp_path, name):
    with whole_file(tmp_path / name) as draft:
        draft.write_text("x")
    assert _names(tmp_path) == [name]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EINTR])
def test_errors_of_an_open_file_name_it(tmp_path, code):
    path = tmp_path / "run.png"
    with pytest.raises(OSError) as raised, whole_file(path):
        raise OSError(code, os.strerror(code))  # as of write and close
    assert raised.value.filename == str(path) and not _names(tmp_path)


@pytest.mark.parametrize("name", ["unlink", "rmdir"])
def test_an_error_that_does_not_last_leaves_no_folder(tmp_path, monkeypatch, name):
    real, calls = getattr(os, name), []

    def fails_once(*args, **kwargs):
        calls.append(args)
        if len(calls) == 1:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return real(*args, **kwargs)

    monkeypatch.setattr(module.os, name, fails_once)
    with whole_file(tmp_path / "run.png") as draft:
        draft.write_text("new")
    assert _names(tmp_path) == ["run.png"] and len(calls) > 1
