# SPDX-License-Identifier: Apache-2.0
"""Random changes to recordings: doctor never calls a file sound that contradicts itself, and replay never verifies a
result that does not follow from the file."""

import corruption
import pytest


@pytest.fixture(scope="module")
def bases(tmp_path_factory):
    return corruption.Bases(tmp_path_factory.mktemp("bases"))


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("first", "count"), [(0, 300), *(pytest.param(k, 1000, marks=pytest.mark.long) for k in range(0, 10_000, 1000))]
)
def test_no_false_verdict(bases, tmp_path, first, count):
    results = [corruption.run_case(bases, number, tmp_path) for number in range(first, first + count)]
    assert not [result for result in results if result["problems"]]
    # Each outcome must be reached, or nothing was tried.
    for result, at_least in (("VERIFIED", 0.1), ("unusable", 0.3)):
        assert sum(r["result"] == result for r in results) > at_least * count
    assert any(r["sound"] and r["changed"] for r in results)


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("times of a chunk", "the index is wrong about the chunk at byte"),
        ("position of a message index", "the index is wrong about the message indexes of the chunk at byte"),
        ("entry of a message index", "the index of messages at byte"),
        ("missing message index", "an index of messages is missing before byte"),
        ("name of a metadata record", "the index is wrong about the metadata record at byte"),
        ("missing schema", "the index does not describe schema"),
        ("time of the statistics", "the index is wrong about the time of the first or last message"),
        ("chunks of the statistics", "the index lists 0 chunks"),
        ("parameter", "the metadata record hpccd does not match its checksum"),
        ("name of the checksum", "the metadata record hpccd does not match its checksum"),
        ("statistics twice", "in the index, the statistics are there twice"),
        ("length of message indexes", "the index is wrong about the message indexes of the chunk at byte"),
        ("schema behind its channel", "is not described before its channels"),
    ],
)
def test_an_index_or_parameters_that_are_wrong(bases, tmp_path, kind, says):
    bag, repairs = corruption.Bag(bases.files[0]), ("footer",)
    _CHANGES[kind](bag)
    if kind == "schema behind its channel":
        repairs = corruption.REPAIRS
    path = tmp_path / "x.mcap"
    path.write_bytes(bag.bytes(repairs))
    examined = corruption.hpccd("doctor", path)
    assert examined.status == 1 and says in examined.out, examined
    assert corruption.hpccd("doctor", path, "--recover", tmp_path / "saved.mcap").status == 0
    assert corruption.hpccd("doctor", tmp_path / "saved.mcap").status == 0


def _record(records, opcode):
    return next(record for record in records if record[0] == opcode)


def _chunk_index(number, change):
    def apply(bag):
        record = _record(bag.index, corruption.CHUNK_INDEX)
        fields = list(corruption._chunk_index(record[1]))
        fields[number] = change(fields[number])
        record[1] = corruption._written(corruption.CHUNK_INDEX, fields)

    return apply


def _replaced(part, opcode, change):
    def apply(bag):
        record = _record(getattr(bag, part), opcode)
        record[1] = change(record[1])

    return apply


def _removed(part, opcode):
    def apply(bag):
        getattr(bag, part).remove(_record(getattr(bag, part), opcode))

    return apply


def _chunk_of_descriptions(bag):
    records = bag.chunks[0].records
    records.sort(key=lambda record: record[0] == corruption.SCHEMA)


def _without_a_message_index(bag):
    kinds = [op for op, _ in bag.data]
    of_two_channels = next(k for k in range(len(kinds)) if kinds[k : k + 2] == [corruption.MESSAGE_INDEX] * 2)
    del bag.data[of_two_channels]
    bag.index = [record for record in bag.index if record[0] in (corruption.SCHEMA, corruption.CHANNEL)]


def _statistics(at):
    return lambda body: body[:at] + bytes(1) + body[at + 1 :] if body[at] else body[:at] + b"\1" + body[at + 1 :]


_CHANGES = {
    "times of a chunk": _chunk_index(0, lambda time: time - 1),
    "position of a message index": _chunk_index(4, lambda pairs: [(n, at + 1) for n, at in pairs]),
    "length of message indexes": _chunk_index(4, lambda pairs: []),
    "statistics twice": lambda bag: bag.index.append(_record(bag.index, corruption.STATISTICS)),
    "entry of a message index": _replaced("data", corruption.MESSAGE_INDEX, lambda body: body[:-1] + b"\1"),
    "missing message index": _without_a_message_index,
    "name of a metadata record": _replaced("index", corruption.METADATA_INDEX, lambda body: body[:-1] + b"x"),
    "missing schema": _removed("index", corruption.SCHEMA),
    "time of the statistics": _replaced("index", corruption.STATISTICS, _statistics(26)),
    "chunks of the statistics": _replaced(
        "index", corruption.STATISTICS, lambda body: body[:22] + bytes(4) + body[26:]
    ),
    "parameter": _replaced(
        "data", corruption.METADATA, lambda body: body.replace(b'"meshes": ["cloth"', b'"meshes": ["clotH"')
    ),
    "name of the checksum": _replaced("data", corruption.METADATA, lambda body: body.replace(b"crc32", b"crc33")),
    "schema behind its channel": _chunk_of_descriptions,
}
