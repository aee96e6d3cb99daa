"""The log of a run: whatever happens to its bytes, its rows are a true prefix of the written ones."""

import json
import zlib

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.records import log as row_log
from kinetile.records.log import SIGNATURE, LogFile, LogReader, LogWriter, holds_nothing

MANY = settings(max_examples=150)
SIZES = (0, 3, 1, 40, 2)


def rows(count: int, seed: int) -> np.ndarray:
    return np.frombuffer(np.random.default_rng(seed).bytes(count * kt.LOG.itemsize), kt.LOG)


class Log:
    """A log: its bytes, where each batch ends, and the rows up to there."""

    def __init__(self, path, sizes=SIZES) -> None:
        with path.open("xb") as made:
            file = LogFile(made.fileno())
            log = LogWriter.begin(file, "the scene")
            self.ends, self.rows = [file.position], [b""]
            for number, size in enumerate(sizes):
                batch = rows(size, number)
                log.write(json.dumps({"number": number}), batch)
                self.ends.append(file.position)
                self.rows.append(self.rows[-1] + batch.tobytes())
        self.content = path.read_bytes()

    def up_to(self, place: int) -> bytes:
        return self.rows[sum(end <= place for end in self.ends) - 1]


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return Log(tmp_path_factory.mktemp("log") / "log")


@pytest.fixture
def read(tmp_path):
    def read(content: bytes) -> tuple[bytes, int]:
        path = tmp_path / "read"
        path.write_bytes(content)
        with path.open("rb") as file:
            found = LogReader(file, "the log")
            return b"".join(each.tobytes() for each in found), found.rest

    return read


def test_what_was_written_is_read(log, read, tmp_path):
    assert read(log.content) == (log.rows[-1], 0)
    (tmp_path / "again").write_bytes(log.content)
    with (tmp_path / "again").open("rb") as file:
        found = LogReader(file, "the log")
        assert (found.scene, found.text) == ("the scene", "")
        for number, (size, batch) in enumerate(zip(SIZES, found, strict=True)):
            assert (json.loads(found.text), len(batch), batch.dtype) == ({"number": number}, size, kt.LOG)


@MANY
@given(data=st.data())
def test_a_log_cut_off_anywhere_with_anything_behind_it(log, read, data):
    cut = data.draw(st.integers(log.ends[0], len(log.content)))
    more = data.draw(st.sampled_from([b"", bytes(40), log.content[log.ends[1] :]]) | st.binary(max_size=60))
    content = log.content[:cut] + more
    both = zip(content, log.content, strict=False)
    same = next(
        (at for at, (one, other) in enumerate(both) if one != other), min(len(content), len(log.content))
    )
    assert read(content)[0] == log.up_to(same)


@MANY
@given(data=st.data())
def test_flipped_bits_end_a_log_before_them(log, read, data):
    content = bytearray(log.content)
    places = data.draw(
        st.lists(st.integers(log.ends[0], len(content) - 1), min_size=1, max_size=4, unique=True)
    )
    for place in places:
        content[place] ^= 1 << data.draw(st.integers(0, 7))
    found, rest = read(bytes(content))
    assert found == log.up_to(min(places))
    assert rest > 0


@MANY
@given(data=st.data())
def test_batches_left_out_doubled_or_of_another_log(log, read, tmp_path_factory, data):
    parts = [log.content[one:other] for one, other in zip(log.ends, log.ends[1:], strict=False)]
    other = Log(tmp_path_factory.mktemp("other") / "log", (2, 3))
    parts += [other.content[one:end] for one, end in zip(other.ends, other.ends[1:], strict=False)]
    order = data.draw(st.lists(st.integers(0, len(parts) - 1), max_size=7))
    right = 0
    while right < len(order) and order[right] == right < len(SIZES):
        right += 1
    content = log.content[: log.ends[0]] + b"".join(parts[each] for each in order)
    assert read(content)[0] == log.rows[right]


@given(st.binary(max_size=200))
@example(SIGNATURE)
@example(SIGNATURE + bytes(100))
@example(SIGNATURE + b"\xff" * 100)
def test_anything_else_is_refused(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "anything"
    path.write_bytes(content)
    said = "before its first event" if content.startswith(SIGNATURE) else "nothing that kinetile can make"
    with path.open("rb") as file, pytest.raises(RecordError, match=f"the log is .*{said}"):
        LogReader(file, "the log")


def test_a_damaged_head_is_refused(log, read):
    for place in range(len(SIGNATURE), log.ends[0]):
        content = bytearray(log.content)
        content[place] ^= 1
        with pytest.raises(RecordError, match="before its first event"):
            read(bytes(content))


def test_a_log_with_other_columns_is_refused(tmp_path, monkeypatch, read):
    monkeypatch.setattr(row_log, "_COLUMNS", [["time", "<f8"], ["who", "<i4"]])
    content = Log(tmp_path / "older").content
    monkeypatch.undo()
    with pytest.raises(RecordError, match="of another version of kinetile, with the columns 'time, who'"):
        read(content)


def test_the_checksum_is_that_of_the_whole_file_up_to_it(log):
    """What docs and module head say of the format, so that it can be read without kinetile."""
    for end in log.ends:
        assert log.content[end - 4 : end] == zlib.crc32(_without_checksums(log, end)).to_bytes(4, "little")


def _without_checksums(log, end: int) -> bytes:
    content = bytearray(log.content[: end - 4])
    for each in reversed([each for each in log.ends if each < end]):
        del content[each - 4 : each]
    return bytes(content)


def test_what_can_be_written_over_with_no_loss(log, tmp_path):
    empty = Log(tmp_path / "empty", (0, 0)).content
    for content, nothing in (
        (b"", True),
        (empty, True),
        (bytes(3000), False),
        (empty + b"torn", False),
        (empty[:-1], False),
        (SIGNATURE, False),
        (log.content, False),
        (bytes(3000) + b"precious", False),
        (b"precious", False),
    ):
        path = tmp_path / "some"
        path.write_bytes(content)
        with path.open("rb") as file:
            assert holds_nothing(file) is nothing
