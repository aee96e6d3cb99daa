"""Saved runs that somebody has changed, with the right checksum: an index that is wrong is refused."""

from __future__ import annotations

import hashlib
import io
import os
import zipfile
from collections.abc import Iterator

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.kernel.tables import column, fields_in
from kinetile_plugins import sweep_and_prune
from saved_runs import PHASES

FAR = 1 << 30


def archive_of(content: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(content)) as archive:
        return {name: archive[name] for name in archive.files}


def sealed(arrays: dict[str, np.ndarray], form: int = zipfile.ZIP_STORED, times: int = 1) -> bytes:
    """An archive with the right checksum."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", form) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), compress_type=form)
        for _ in range(times - 1):
            archive.filelist.append(archive.filelist[-1])
        archive._didModify = True
        archive.comment = bytes(64)
    content = file.getvalue()
    return content[:-64] + hashlib.sha256(content).hexdigest().encode()


def lively(phase: str) -> kt.Simulation:
    """A run with bodies that pass, come and go."""
    made = kt.make_scene("grid", bodies=9, seed=1)
    kinds = ["one", "two", "one"] * 3
    scene = made.replace(kind=kinds, responses={("one", "two"): kt.Response("pass")})
    sim = kt.Simulation(scene, phase, live=True)
    sim.run(0.2)
    sim.remove(3)
    sim.run(0.3)
    return sim


INDICES = [
    *(
        "bodies.last",
        "queue.partner",
        "queue.kind",
        "queue.exact",
        "queue.number",
        "links.next",
        "links.prev",
    ),
    *("slots", "traits.kind", "passings.a", "passings.b", "passings.next_a", "passings.prev_b", "passers"),
    *("clock.bodies", "clock.present", "clock.lists.vacant", "clock.lists.offered", "clock.lists.command"),
    *("clock.lists.commands", "clock.lists.logged", "clock.lists.passable", "clock.calendar.shift"),
    *("clock.torus.number", "clock.kinds", "clock.fault.code", "rules.response", "marks", "counts.queued"),
]


def test_an_index_of_a_saved_run_that_is_out_of_its_table_ended_the_process(tmp_path):
    path = tmp_path / "s.kt"
    lively("cells").save(path)
    arrays = archive_of(path.read_bytes())
    path.write_bytes(sealed(arrays))
    assert kt.resume(path).snapshot() == lively("cells").snapshot()
    for name in INDICES:
        table, _, field = name.partition(".")
        changed = arrays[f"tables.{table}"].copy()
        values = column(changed, field) if field else changed
        assert len(values), name
        for value in (FAR, -FAR):
            values[:] = value
            path.write_bytes(sealed(arrays | {f"tables.{table}": changed}))
            for phase in (None, "cells"):
                with pytest.raises(RecordError, match=r"no engine has|is no simulation that can be gone on"):
                    kt.resume(path, phase)


def changes(array: np.ndarray) -> Iterator[np.ndarray]:
    """An array with each of its columns of whole numbers changed."""
    for field in fields_in(array.dtype) or [""]:
        for end in ("max", "min"):
            changed = array.copy()
            values = column(changed, field) if field else changed
            if values.dtype.kind == "i":
                values[:] = getattr(np.iinfo(values.dtype), end)
                yield changed


@pytest.mark.parametrize("phase", [phase for phase in PHASES if phase != "naive"])
def test_a_state_of_a_saved_run_that_cannot_be_ended_the_process(phase, tmp_path):
    path = tmp_path / "s.kt"
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=1), phase)
    sim.run(0.3)
    sim.save(path)
    arrays = archive_of(path.read_bytes())
    said: set[str] = set()
    for name in [each for each in arrays if each.startswith("state.")]:
        for changed in changes(arrays[name]):
            path.write_bytes(sealed(arrays | {name: changed}))
            try:
                again = kt.resume(path)
            except RecordError as error:
                said.add(str(error))
                again = kt.resume(path, phase)  # or nothing reads what was changed
            again.run(0.6)
            sim.run(0.6)
            assert again.fingerprint == sim.fingerprint
    assert said
    assert all("goes on from it with a structure that is built anew" in each for each in said)


def test_a_state_without_an_audit_is_built_anew(tmp_path, monkeypatch):
    parts = sweep_and_prune.BroadPhaseParts
    without = {"audit": None, "sound": None}
    monkeypatch.setattr(sweep_and_prune, "BroadPhaseParts", lambda **given: parts(**given | without))
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=1), "sap-1d")
    sim.run(0.3)
    sim.save(tmp_path / "s.kt")
    arrays = archive_of((tmp_path / "s.kt").read_bytes())
    arrays["state.order"][:] = FAR
    (tmp_path / "s.kt").write_bytes(sealed(arrays))
    again = kt.resume(tmp_path / "s.kt")
    again.run(0.6)
    sim.run(0.6)
    assert again.fingerprint == sim.fingerprint


def test_members_that_are_compressed_or_overlap_took_a_thousand_times_the_memory(tmp_path):
    path = tmp_path / "s.kt"
    kt.Simulation(kt.make_scene("grid", bodies=9, seed=1), "cells").save(path)
    arrays = archive_of(path.read_bytes())
    for content in (sealed(arrays, zipfile.ZIP_DEFLATED), sealed(arrays, times=1000)):
        path.write_bytes(content)
        with pytest.raises(RecordError, match="its members are compressed, or overlap"):
            kt.resume(path)


def test_a_pipe_in_place_of_a_saved_run_was_waited_for(tmp_path):
    os.mkfifo(tmp_path / "s.kt")
    for path in (tmp_path / "s.kt", "/dev/zero"):
        with pytest.raises(RecordError, match="cannot be read: it is no regular file"):
            kt.resume(path)
