"""Files that are refused, and the promises on the others."""

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import broken_phases
import kinetile as kt
from inside import engine_of
from kinetile.errors import BadOption, BusyError, RecordError
from kinetile.kernel.log import CONTACT_ROW, Fingerprint
from kinetile.kernel.tables import JAMMED, Quantity, declared
from kinetile.run.saving import files
from kinetile.run.saving.files import note
from kinetile.run.simulation import composition_of
from registering import registered


def simulation(name: str = "cells", **more) -> kt.Simulation:
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=1), name, **more)
    sim.run(0.1)
    return sim


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "s.kt"
    simulation().save(path)
    return path


def rewritten(content: bytes, change) -> bytes:
    arrays = arrays_of(content)
    head = json.loads(arrays[files.MAGIC].tobytes())
    change(head)
    return sealed(arrays | {files.MAGIC: np.frombuffer(json.dumps(head).encode(), np.uint8)})


def arrays_of(content: bytes) -> dict:
    return dict(np.load(io.BytesIO(content)))


def sealed(arrays: dict, form: int = zipfile.ZIP_STORED, times: int = 1) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", form) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), compress_type=form)
        archive.filelist += [archive.filelist[-1]] * (times - 1)
        archive._didModify = True
        archive.comment = bytes(64)
    content = file.getvalue()
    return content[:-64] + hashlib.sha256(content).hexdigest().encode()


def damaged(content: bytes) -> Iterator[bytes]:
    for at in {*range(0, len(content), 97), *range(100), len(content) - 1}:
        yield content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]
    for length in {*range(0, len(content), 211), len(content) - 1}:
        yield content[:length]


def test_damage_is_noticed(path):
    for content in damaged(path.read_bytes()):
        path.write_bytes(content)
        with pytest.raises(RecordError, match=r"is damaged|is no saved simulation"):
            kt.resume(path)


def test_a_file_that_is_laid_out_in_another_way_is_refused(path, monkeypatch):
    for name in files.CARRIED_ROWS:
        with monkeypatch.context() as other:
            other.setitem(files.CARRIED_ROWS, name, np.dtype([("one", "f8"), ("two", "i4")]))
            files.layout.cache_clear()
            with pytest.raises(RecordError, match="files are laid out in another way"):
                kt.resume(path)
    files.layout.cache_clear()
    assert kt.resume(path).time == 0.1


def test_another_answer_is_refused(path):
    path.write_bytes(rewritten(path.read_bytes(), lambda text: text.update(answer=0)))
    with pytest.raises(RecordError, match="other rules would make other contacts"):
        kt.resume(path, "sap-1d")


def table(text, name):
    return next(pair for pair in text["content"]["table"] if pair[0] == name)


def test_what_a_file_says_cannot_be_carried_out(path):
    """A class that is not on the list, a wrong one in the right place, a number that is none."""
    for said in ({"Path": ["x"]}, {"eval": ["1"]}, {"Turn": [1]}, {"array": "nowhere"}, "x", None):
        for name in ("scene", "phases", "later", "entries", "bounds"):

            def other(text, name=name, said=said):
                table(text, name)[1] = [said, said, said] if name in ("later", "bounds") else said

            content = rewritten(path.read_bytes(), other)
            path.with_suffix(".bad").write_bytes(content)
            with pytest.raises((RecordError, BadOption)):
                kt.resume(path.with_suffix(".bad"))


@pytest.mark.parametrize(("name", "value"), [("audit", "x"), ("start_energy", None), ("squares", [1.0])])
def test_a_number_that_is_none_was_found_out_in_a_run(path, name, value):
    def other(text):
        if name == "squares":
            table(text, "bounds")[1][2] = value
        else:
            table(text, name)[1] = value

    path.write_bytes(rewritten(path.read_bytes(), other))
    with pytest.raises(RecordError, match=rf"{name} is "):
        kt.resume(path)


FAR = 1 << 30
UNCHECKED = Quantity.TICK, Quantity.PAST, Quantity.DUE, Quantity.VALUE
WRONG = {
    "plans": [("radius", -FAR), ("mass", -FAR), ("x", np.inf), ("vy", np.inf)],
    "commands": [("code", FAR), ("code", -FAR)],
    "clock": [("now", -FAR)],
}


def test_an_index_of_a_saved_run_that_is_out_of_its_table_ended_the_process(tmp_path):
    """In a run with passings, insertions and removals, and commands to come."""
    kinds = ["one", "two", "one"] * 3
    made = kt.make_scene("grid", bodies=9, seed=1)
    coming = [kt.Turn(1, 0.6, (1.0, 0.0)), kt.Remove(2, 0.7)]
    scene = made.replace(kind=kinds, responses={("one", "two"): kt.Response("pass")}, commands=coming)
    sim = kt.Simulation(scene, "naive", live=True)
    sim.run(0.2)
    sim.remove(3)
    sim.run(0.5)
    path = tmp_path / "s.kt"
    sim.save(path)
    arrays = arrays_of(path.read_bytes())
    path.write_bytes(sealed(arrays))
    assert kt.resume(path).snapshot() == sim.snapshot()
    for name, dtype in files.CARRIED_ROWS.items():
        checked = [each for each in declared(dtype) if each.quantity not in UNCHECKED]
        far = [(each.name, FAR) for each in checked if each.quantity is not Quantity.COUNT]
        for column, value in [*((each.name, -FAR) for each in checked), *far, *WRONG.get(name, [])]:
            rows = arrays[name].copy()
            assert len(rows), name
            rows[column] = value
            path.write_bytes(sealed(arrays | {name: rows}))
            with pytest.raises(RecordError, match="is no simulation that can be resumed"):
                kt.resume(path)


def test_members_that_are_compressed_or_overlap_took_a_thousand_times_the_memory(path):
    arrays = arrays_of(path.read_bytes())
    for content in (sealed(arrays, zipfile.ZIP_DEFLATED), sealed(arrays, times=1000)):
        path.write_bytes(content)
        with pytest.raises(RecordError, match="its members are compressed, or overlap"):
            kt.resume(path)


def test_contacts_that_are_not_kept_go_on_with_their_fingerprint(tmp_path, monkeypatch):
    monkeypatch.setattr("kinetile.kernel.log.IN_BLOCK", 7)
    sim = simulation(keep_contacts=False)
    sim.save(tmp_path / "s.kt")
    again = kt.resume(tmp_path / "s.kt")
    assert not again.keeps_contacts
    for each in (sim, again):
        each.run(1.5)
    whole = simulation()
    whole.run(1.5)
    assert sim.fingerprint == again.fingerprint == whole.fingerprint
    again.save(tmp_path / "s.kt")  # a run that has gone on is saved again
    assert kt.resume(tmp_path / "s.kt", "sap-1d").fingerprint == whole.fingerprint


def chained(rows: bytes) -> str:
    digest, entries = b"", [rows[at : at + 24] for at in range(0, len(rows), 24)]
    while len(entries) > 4096:
        digest, entries = hashlib.sha256(digest + b"".join(entries[:4096])).digest(), entries[4096:]
    return hashlib.sha256(digest + b"".join(entries)).hexdigest()


@pytest.mark.parametrize("length", [0, 1, 4095, 4096, 4097, 8192, 8193, 20_000])
def test_a_fingerprint_is_a_chain_of_blocks_in_whatever_pieces_the_rows_come(length):
    random = np.random.default_rng(length)
    rows = random.integers(0, 256, 24 * length, dtype=np.uint8).view(CONTACT_ROW)
    for _ in range(6):
        made = Fingerprint()
        for piece in np.split(rows, np.sort(random.integers(0, length + 1, 5))):
            made.update(piece.tobytes())
            made = Fingerprint(made.chain, bytes(made.copy().rows))
        assert made.hexdigest() == chained(rows.tobytes())


def test_numpy_reads_a_file_and_a_pickle_in_one_is_refused(path):
    arrays = arrays_of(path.read_bytes())
    assert len(arrays["plans"]) == 9
    assert sealed(arrays) != path.read_bytes()
    path.write_bytes(sealed(arrays))
    assert kt.resume(path).time == 0.1  # whoever has written the archive
    path.write_bytes(sealed(arrays | {"stray": np.array([{}], object)}))
    with pytest.raises(RecordError, match="is no saved simulation: Object arrays cannot be loaded"):
        kt.resume(path)


@pytest.mark.interpreted
def test_what_has_ended_with_a_fault_is_not_saved(tmp_path):
    scene = kt.Scene([[1.0, 1.0], [2.0, 1.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25, arena=(4.0, 4.0))
    with registered(*broken_phases.SPECS):
        sim = kt.Simulation(scene, "adds-too-late")
        before = sim.snapshot()
        with pytest.raises(kt.errors.MissedContactError):
            sim.run(4.0)
        with pytest.raises(RecordError, match="ended with a fault"):
            sim.save(tmp_path / "s.kt")
        sim.restore(before)
    assert sim.snapshot() == before


def test_what_is_jammed_is_saved(tmp_path):
    """A command can end it."""
    sim = simulation()
    engine_of(sim).fields.fault.code[0] = JAMMED
    sim.save(tmp_path / "s.kt")
    assert kt.resume(tmp_path / "s.kt").snapshot() == sim.snapshot()


def test_a_snapshot_of_something_else_changes_nothing():
    sim = simulation()
    before = sim.snapshot()
    with pytest.raises(RecordError, match="of another scene"):
        sim.restore(kt.Simulation(kt.make_scene("grid", bodies=4)).snapshot())
    with pytest.raises(RecordError, match="the narrow phases wall, and"):
        sim.restore(kt.Simulation(sim.scene, narrow_phases=["wall"]).snapshot())
    other = kt.Simulation(sim.scene).snapshot()
    options = {name: {"odd": 1} for name in other.phases.narrow_phases}
    with pytest.raises(RecordError, match="or other options of them"):
        sim.restore(replace(other, phases=replace(other.phases, narrow_phases=options)))
    assert sim.snapshot() == before


def test_a_phase_that_refuses_changes_nothing(monkeypatch):
    sim, other = simulation("sap-1d"), simulation("cells")
    before = sim.snapshot()

    def refuse(self, scene):
        raise kt.errors.Refused("not this")

    monkeypatch.setattr(type(composition_of(sim)), "prepared_for", refuse)
    with pytest.raises(kt.errors.Refused, match="not this"):
        sim.restore(other.snapshot())
    assert sim.snapshot() == before


def test_it_is_saved_from_progress_and_not_from_a_recorder(tmp_path):
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=1))
    snapshots = []

    def progress(_):
        snapshots.append(sim.snapshot())
        with pytest.raises(BusyError):
            sim.restore(snapshots[0])

    def recorder(_):
        with pytest.raises(BusyError):
            sim.snapshot()

    sim.run(0.2, progress=progress, recorder=recorder)
    fingerprint = sim.fingerprint
    sim.restore(snapshots[0])
    sim.run(0.2)
    assert sim.fingerprint == fingerprint


def test_a_note_comes_along(tmp_path):
    sim = simulation()
    sim.save(tmp_path / "s.kt", {"level": [1, "two"]})
    assert note((tmp_path / "s.kt").read_bytes()) == {"level": [1, "two"]}
    with pytest.raises(RecordError, match="cannot be saved with its note"):
        sim.save(tmp_path / "s.kt", {"level": object()})
    assert note((tmp_path / "s.kt").read_bytes()) == {"level": [1, "two"]}


@pytest.mark.parametrize("name", ["fsync", "replace", "_ZipWriteFile"])
def test_whatever_ends_it_on_its_way_what_was_there_is_there(path, monkeypatch, name):
    """Ctrl-C as a member of the archive was opened was a ValueError: an archive is not closed within one."""
    before = path.read_bytes()

    def end(*arguments):
        raise KeyboardInterrupt

    places = {"fsync": files.os, "replace": files.Path, "_ZipWriteFile": zipfile}
    monkeypatch.setattr(places[name], name, end)
    with pytest.raises(KeyboardInterrupt):
        simulation("sap-1d").save(path)
    assert path.read_bytes() == before
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_only_a_saved_simulation_is_replaced(tmp_path):
    mine = tmp_path / "mine"
    mine.write_text("x")
    sim = simulation()
    for place in (mine, tmp_path, tmp_path / "no" / "s.kt", "", os.devnull):
        with pytest.raises(RecordError, match=r"no saved simulation|cannot be written|names no file"):
            sim.save(place)
    assert mine.read_text() == "x"
    with pytest.raises(RecordError, match="cannot be read"):
        kt.resume(tmp_path / "nothing")


def test_options_and_settings_come_along(tmp_path):
    made = kt.make_scene("grid", bodies=9, seed=1)
    settings = kt.Settings("sap-1d", ("disc", "wall"), {"sap-1d": {"axis": "y"}}, 2.0)
    scene = kt.Scene(
        made.position, made.velocity, made.radius, made.mass, made.arena, [kt.Turn(1, 0.5, (1.0, -0.0))],
        settings=settings, origin={"recipe": "grid", "parameters": {"bodies": 9}, "odd": object()},
    )  # fmt: skip
    sim = kt.Simulation(scene)
    sim.save(tmp_path / "s.kt")
    again = kt.resume(tmp_path / "s.kt")
    assert again.scene == scene
    assert again.scene.origin == {"recipe": "grid", "parameters": {"bodies": 9}}
    assert (again.broad_phase, again.options) == ("sap-1d", {"axis": "y"})
    assert again.narrow_phases == ("disc", "wall")
    with pytest.raises(BadOption, match="expected broad_phase="):
        kt.resume(tmp_path / "s.kt", options={"axis": "x"})
    assert kt.resume(tmp_path / "s.kt", "sap-1d", options={"axis": "x"}).options == {"axis": "x"}
