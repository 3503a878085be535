# SPDX-License-Identifier: Apache-2.0
"""Flushed data survives, and `hpccd doctor` makes it a recording again."""

import random

import pytest
from bag_tools import STRING, read_by_rosbags, text_message, write_texts
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.bag.recover import recover
from hpccd_ros.bag.writer import BagWriter, Topic

STEP = 1_000_000  # ns between messages
TEXTS = [f"{k:05}" + "y" * 300 for k in range(300)]


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_all_that_was_flushed_survives(tmp_path, compression):
    """Copies of the growing file, as a kill at that moment would leave it."""
    path = tmp_path / "growing.mcap"
    writer = BagWriter(path, compression=compression, chunk_size=4000, flush_interval=1e9)
    writer.add_topic(Topic("/text", STRING, []))
    generator = random.Random(3)
    copies = []
    for number, text in enumerate(TEXTS):
        writer.write("/text", text_message(text), 10**18 + number, 10**18 + number)
        if generator.random() < 0.1:
            writer.flush()
            copies.append((number + 1, path.read_bytes()))
        elif generator.random() < 0.1:
            copies.append((0, path.read_bytes()))  # not flushed: whole chunks only
    writer.close()
    assert len(copies) > 30
    saved = tmp_path / "saved.mcap"
    for flushed, content in copies:
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(content)
        assert not examine(cut).finished
        if flushed == 0 and examine(cut).message_count == 0:
            continue
        found = recover(cut, saved)
        texts = [m.data for *_, m in read_by_rosbags(saved)]
        assert texts == TEXTS[: found.message_count]
        assert found.message_count >= flushed
        saved.unlink()


def test_cut_at_any_byte_keeps_every_whole_chunk(tmp_path):
    path, cut, saved = (tmp_path / name for name in ("bag.mcap", "cut.mcap", "saved.mcap"))
    write_texts(path, TEXTS, STEP, chunk_size=4000, info={"kept": True})
    data = path.read_bytes()
    with open(path, "rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    for length in sorted(random.Random(4).sample(range(20, len(data)), 80)):
        cut.write_bytes(data[:length])
        found = examine(cut)
        whole = [c for c in chunks if c.chunk_start_offset + c.chunk_length <= length]
        last = sum((c.message_end_time - c.message_start_time) // STEP + 1 for c in whole)
        assert found.message_count == last and found.readable <= length
        if last:
            recover(cut, saved)
            with Recording(saved) as recording:
                assert [m.data for m in recording.messages()] == [text_message(t) for t in TEXTS[:last]]
                assert recording.info == {"kept": True}
            saved.unlink()


def test_a_damaged_chunk_costs_only_itself(tmp_path):
    path, saved = tmp_path / "bag.mcap", tmp_path / "saved.mcap"
    write_texts(path, TEXTS, chunk_size=4000)
    data = bytearray(path.read_bytes())
    for text in (TEXTS[0], TEXTS[150]):  # the chunk with the channel's description, and one in the middle
        at = data.index(text.encode())
        data[at] ^= 1
    path.write_bytes(data)
    found = examine(path)
    assert (found.damaged_chunks, found.sound, found.finished) == (2, False, True)
    assert found.orphans == 0
    recover(path, saved)
    texts = [m.data for *_, m in read_by_rosbags(saved)]
    assert set(texts) < set(TEXTS) and texts == sorted(texts)
    assert len(texts) >= len(TEXTS) - 2 * 13


def test_sound_files_are_called_sound(tmp_path):
    path = tmp_path / "bag.mcap"
    write_texts(path, TEXTS)
    found = examine(path)
    assert found.sound and found.message_count == len(TEXTS) and found.types == {"/text": STRING}


def test_nothing_to_recover(tmp_path):
    path = tmp_path / "bag.mcap"
    write_texts(path, [])
    with pytest.raises(RecordingError, match="no complete message"):
        recover(path, tmp_path / "saved.mcap")
    assert not (tmp_path / "saved.mcap").exists()


def test_doctor_command(hpccd, tmp_path):
    path = tmp_path / "bag.mcap"
    write_texts(path, TEXTS, chunk_size=4000)
    sound = hpccd("doctor", path)
    assert sound.returncode == 0 and "bag.mcap: sound" in sound.stdout
    path.write_bytes(path.read_bytes()[:50_000])
    cut = hpccd("doctor", path)
    assert cut.returncode == 1 and "CUT OFF" in cut.stdout and "--recover" in cut.stdout
    saved = hpccd("doctor", path, "--recover", "saved.mcap", "--compression", "zstd")
    assert saved.returncode == 0, saved.stderr
    assert examine(tmp_path / "saved.mcap").compression == "zstd"
    again = hpccd("doctor", path, "--recover", "saved.mcap")
    assert again.returncode == 2 and "not overwritten" in again.stderr


@pytest.mark.parametrize("content", [b"", b"no recording", MCAP0_MAGIC], ids=["empty", "text", "magic"])
def test_what_holds_nothing_to_save_is_unusable(hpccd, tmp_path, content):
    (tmp_path / "x.mcap").write_bytes(content)
    for options in ((), ("--recover", "saved.mcap")):
        done = hpccd("doctor", "x.mcap", *options)
        assert done.returncode == 2 and done.stderr.startswith("hpccd doctor: x.mcap has no complete message"), done
