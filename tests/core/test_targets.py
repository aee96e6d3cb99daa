"""Files that are replaced: complete or as they were, with the mode that they had."""

import os
import stat
import sys
from collections.abc import Callable
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.records.contacts import write_contacts
from kinetile.records.frames import frames_of, write_frames
from kinetile.targets import write_file
from kinetile_accuracy.report import write_report
from kinetile_conformance.cases import Subject, save_case
from lanes import first

pytestmark = [
    pytest.mark.small,
    pytest.mark.skipif(sys.platform == "win32", reason="needs modes, and a limit on the size of files"),
]
FOUR = kt.make_scene("grid", bodies=4)


@contextmanager
def full_disk():
    import resource

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def run() -> kt.Simulation:
    sim = kt.Simulation(FOUR, "cells")
    sim.run(1.0)
    return sim


def record(path: Path) -> None:
    pytest.importorskip("pyarrow")
    with kt.EventRecorder(path, FOUR, overwrite=True) as recorder:
        kt.Simulation(FOUR, "cells").run(1.0, recorder=recorder)


def report(path: Path) -> None:
    pytest.importorskip("matplotlib")
    machine = {"versions": {}, "processor": "", "processors": 1, "system": ""}
    write_report([], path.parent, budget="quick", conditions=machine)


WRITERS: dict[str, Callable[[Path], object]] = {
    "s.toml": lambda path: kt.save_scene(FOUR, path),
    "c.kt": lambda path: run().save(path),
    "e.parquet": record,
    "a.svg": lambda path: kinetile("draw grid -s bodies=4 --overwrite --out", path),
    "m.csv": lambda path: kinetile(
        "run grid -s bodies=4 --until 1 --broad-phase cells --observe pressure --overwrite --observe-to", path
    ),
    "case.toml": lambda path: save_case(FOUR, path, "wrong", Subject("cells", {})),
    "c.txt": lambda path: write_contacts(path, run().contacts, "0" * 64, (1.0, 0.0)),
    "f.xyz": lambda path: write_frames(path, FOUR, frames_of(run(), [1.0])),
    "v.html": lambda path: kt.view(run()).save(path, overwrite=True),
    "accuracy.json": report,
    "st.svg": lambda path: kinetile("draw cradle --space-time x --overwrite --out", path),
    "a.png": lambda path: kinetile("draw grid -s bodies=4 --overwrite --out", path),
}


@pytest.mark.parametrize("name", first(4, [*WRITERS]))
def test_overwrite_on_a_full_disk_destroyed_the_old_file(tmp_path, name):
    """And a file of mode 600 that was replaced became one that all can read."""
    path = tmp_path / name
    if name.endswith(".png"):
        pytest.importorskip("matplotlib")
    WRITERS[name](path)
    before = path.read_bytes()
    path.chmod(0o600)
    names = sorted(os.listdir(tmp_path))
    with full_disk(), suppress(OSError, kt.errors.KinetileError):
        WRITERS[name](path)
    assert path.read_bytes() == before
    assert [each for each in sorted(os.listdir(tmp_path)) if not each.endswith(".partial")] == names
    WRITERS[name](path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_new_file_has_the_mode_of_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write_file(tmp_path / "new", "text")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640
