"""Files that were tampered with or never were event files: a RecordError, or exactly the written rows."""

import json
import math
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.records import Trajectory, read_events
from kinetile.records.finishing import KEYS
from kinetile.records.log import Seal
from kinetile.scene.files import loads_scene
from messages import table

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

MANY = settings(max_examples=60)

UNREADABLE = r"cannot be read as an event file|is what a run writes while it goes on"


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    path = tmp_path_factory.mktemp("good") / "good.parquet"
    made = kt.make_scene("grid", bodies=9, density=0.5, seed=3)
    scene = kt.Scene(
        made.position,
        made.velocity,
        made.radius,
        arena=made.arena,
        turns=[(4, 0.125, (0.5, -0.25))],
        start=0.0,
    )
    sim = kt.Simulation(scene, "naive")
    with kt.EventRecorder(path, scene, {"note": "as it was"}) as recorder:
        sim.run(1.0, recorder=recorder)
    assert 50 < len(read_events(path).rows) < 500
    return path


@pytest.fixture(scope="module")
def truth(good):
    return read_events(good)


def is_refused_or_right(path, truth) -> bool:
    """Whether a file is refused; AssertionError where it is read and gives anything but what was written."""
    said = ""
    try:
        found = read_events(path)
    except RecordError as error:
        said = str(error)
    if said:
        assert said.replace("\n", " ").isprintable()
        with pytest.raises(RecordError):
            Trajectory.read(path)
        return True
    assert found.rows.tobytes() == truth.rows.tobytes()
    assert found.metadata == truth.metadata
    return False


@MANY
@given(data=st.data())
def test_flipped_bits(good, truth, tmp_path, data):
    content = bytearray(good.read_bytes())
    in_the_footer = data.draw(st.booleans())
    first = len(content) - int.from_bytes(content[-8:-4], "little") - 8 if in_the_footer else 0
    places = data.draw(st.lists(st.integers(first, len(content) - 1), min_size=1, max_size=4))
    for place in places:
        content[place] ^= 1 << data.draw(st.integers(0, 7))
    path = tmp_path / "flipped.parquet"
    path.write_bytes(content)
    is_refused_or_right(path, truth)


@given(st.binary(max_size=300))
def test_anything_else(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "anything"
    for whole in (content, b"PAR1" + content + b"PAR1"):
        path.write_bytes(whole)
        with pytest.raises(RecordError, match=UNREADABLE):
            read_events(path)


def test_what_is_no_file_at_all(tmp_path):
    pipe = tmp_path / "pipe"
    paths = [tmp_path, tmp_path / "nothing"]
    if hasattr(os, "mkfifo"):
        os.mkfifo(pipe)
        paths.append(pipe)
    for path in paths:
        with pytest.raises(RecordError, match=UNREADABLE):
            read_events(path)


def test_what_pyarrow_quotes_of_a_damaged_footer_reached_the_terminal_as_it_is(good, truth, tmp_path):
    """It names a type that there is not by its byte, a control character."""
    content, path = good.read_bytes(), tmp_path / "types.parquet"
    length = int.from_bytes(content[-8:-4], "little")
    for place in range(len(content) - 8 - length, len(content) - 8, 57):
        path.write_bytes(content[:place] + bytes([content[place] & 0xF0 | 0x0E]) + content[place + 1 :])
        is_refused_or_right(path, truth)


def rewrite(good, path, *, table=None, texts=None, **changes):
    old = pq.read_metadata(good).metadata
    metadata = json.loads(old[b"kinetile"]) | changes
    table = pq.read_table(good) if table is None else table
    found = {key: old[key.encode()].decode() for key in ("kinetile", "kinetile.scene", "kinetile.digest")}
    found["kinetile"] = json.dumps(metadata)
    found = {key: text for key, text in (found | (texts or {})).items() if text is not ...}
    pq.write_table(table.replace_schema_metadata(found), path)


def test_a_file_that_is_written_anew_as_it_was_is_read(good, truth, tmp_path):
    path = tmp_path / "anew.parquet"
    rewrite(good, path)
    assert not is_refused_or_right(path, truth)


def rewritten(good, **changes):
    rewrite(good, "e.parquet", **changes)
    return read_events("e.parquet")


@pytest.fixture
def whole(good):
    return pq.read_table(good)


def resealed(good, *changes):
    sealed(good, "e.parquet", *changes)
    return read_events("e.parquet")


test_message = table(globals())


def sealed(good, path, rows, metadata, scene=None):
    seal = Seal()
    scene = scene or pq.read_metadata(good).metadata[b"kinetile.scene"].decode()
    seal.add(rows)
    texts = (metadata, scene, seal.digest(metadata, scene))
    table = pa.table({name: rows[name] for name in kt.LOG.names})
    rewrite(good, path, table=table, texts=dict(zip(KEYS, texts, strict=True)))


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("a", 2**31 - 1, "a row is of body 2147483647, and there are 9 with"),
        ("b", 9, "a row is of body 9"),
        *(("ay", value, "is not where the scene and the rows before have") for value in (math.nan, math.inf)),
        ("avx", -math.inf, "or has no such velocity"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_row_of_a_body_that_there_is_not_took_all_memory(good, truth, tmp_path, column, value, said):
    """Positions were computed for each number up to that."""
    rows = truth.rows.copy()
    rows[column][-1] = value
    sealed(good, tmp_path / "e.parquet", rows, json.dumps(truth.metadata))
    assert len(read_events(tmp_path / "e.parquet").rows) == len(rows)
    with pytest.raises(RecordError, match=said):
        Trajectory.read(tmp_path / "e.parquet")


def test_a_small_file_of_many_rows_took_all_memory_before_its_digest_was_read(good, truth, tmp_path):
    rows = np.zeros(200_000, kt.LOG)
    rewrite(good, tmp_path / "e.parquet", table=pa.table({name: rows[name] for name in rows.dtype.names}))
    with pytest.raises(RecordError, match=r"is damaged: 200,000 rows cannot be in [\d,]+ bytes"):
        read_events(tmp_path / "e.parquet")


def test_texts_that_are_not_utf_8(good, tmp_path):
    old = pq.read_metadata(good).metadata
    path = tmp_path / "bytes.parquet"
    found = {key: old[key] for key in (b"kinetile", b"kinetile.scene", b"kinetile.digest")}
    pq.write_table(pq.read_table(good).replace_schema_metadata(found | {b"kinetile": b"\xff"}), path)
    with pytest.raises(RecordError, match=UNREADABLE):
        read_events(path)


def test_a_file_of_phases_that_are_not_installed_is_read(tmp_path):
    scene = kt.Scene([[0.0, 0.0]], [[1.0, 0.0]], 0.5, settings=kt.Settings("nobody-has-this", None, {}, None))
    with kt.EventRecorder(tmp_path / "e.parquet", scene):
        pass
    assert Trajectory.read(tmp_path / "e.parquet").positions(1.0).tolist() == [[1.0, 0.0]]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("a", 2**30, "a row is of body 1073741824"),
        ("bvx", math.inf, "or has no such velocity"),
        ("ax", 1e300, "is not where the scene and the rows before"),
        ("ax", 1e40, r"a body has flown 2\*\*31 periods"),
    ],
)
def test_damaged_rows_ended_in_warnings_of_numpy_and_an_error_of_ase(truth, column, value, said):
    pytest.importorskip("ase")
    scene, rows = loads_scene(truth.metadata["scene"]).replace(periodic="xy"), truth.rows.copy()
    rows[column][rows["b"] >= 0] = value
    with pytest.raises(RecordError, match=said):
        list(kt.frames(Trajectory(rows, scene), [1.0]))
