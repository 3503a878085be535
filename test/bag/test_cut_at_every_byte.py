# SPDX-License-Identifier: Apache-2.0
"""A file cut at each byte of its last chunk, its index and its footer: all messages before that chunk are recovered."""

import random

import pytest
from bag_tools import STRING, text_message
from corruption import CHUNK, DATA_END, MAGIC, MESSAGE, Chunk, frames

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.recover import recover
from hpccd_ros.bag.writer import BagWriter, Topic

SAMPLE = 25


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.parametrize("tail", [b"", bytes(600)], ids=["cut", "zeros"])
def test_cut_at_every_byte(tmp_path, compression, every, tail):
    """tail: as some file systems leave a file after a power failure."""
    path, cut, saved = (tmp_path / name for name in ("bag.mcap", "cut.mcap", "saved.mcap"))
    bag = BagWriter(path, compression=compression, chunk_size=600, flush_interval=1e9, info={"kept": True})
    bag.add_topic(Topic("/text", STRING, []))
    texts = [f"{k:03}" + random.Random(k).randbytes(40).hex() for k in range(25)]
    for number, text in enumerate(texts):
        bag.write("/text", text_message(text), 10**18 + number, 10**18 + number, number)
    bag.close()
    data = path.read_bytes()
    # (where a chunk begins, where it ends, messages up to its end)
    chunks, count = [], 0
    for at, op, body in frames(data, len(MAGIC), len(data)):
        if op == CHUNK:
            count += sum(kind == MESSAGE for kind, _ in Chunk.read(body).records)
            chunks.append((at, at + 9 + len(body), count))
        if op == DATA_END:
            break
    assert len(chunks) > 3 and count == len(texts)
    lengths = range(chunks[-1][0], len(data))
    if not every:
        lengths = sorted({*random.Random(2).sample(lengths, SAMPLE), chunks[-1][0], chunks[-1][1], len(data) - 1})
    for length in lengths:
        content = data[:length] + tail  # zeros may replace zeros
        cut.write_bytes(content)
        kept = max(count for _, end, count in chunks if content[:end] == data[:end])
        found = examine(cut)
        assert not found.sound and found.message_count == kept, length
        recover(cut, saved)
        with Recording(saved) as recording:
            assert [m.data for m in recording.messages()] == [text_message(text) for text in texts[:kept]], length
            assert recording.info == {"kept": True}
        saved.unlink()
