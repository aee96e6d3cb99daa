"""``kinetile cache``: its output, its removals, and the files that it keeps."""

import os
import time

import llvmlite
import numba
import pytest

import kinetile as kt
from command_line import kinetile, printed, refused

HERE = f"numba-{numba.__version__}-llvmlite-{llvmlite.__version__}"
OTHER = "numba-0.1.0-llvmlite-0.2.0"
ENTRY = ("loop.advance_a-95.py311.nbi", "loop.advance_a-95.py311.1.nbc", "watch_0a1b.nbh", "near_2c3d.nbh")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A cache with an entry in use, an old one of other versions, and files that are not the cache's."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    for folder, days in ((HERE, 0.0), (OTHER, 40.0)):
        (tmp_path / folder).mkdir()
        for name in (*ENTRY, "notes.txt"):
            path = tmp_path / folder / name
            path.write_bytes(bytes(1000))
            os.utime(path, (time.time() - days * 86400.0,) * 2)
    (tmp_path / OTHER / "notes.txt").unlink()
    (tmp_path / HERE / "loop.advance_d-95.py311.nbi.tmp.0123abcd").write_bytes(b"")
    (tmp_path / "mine.nbi").write_text("somebody else's")
    return tmp_path


def test_it_lists_versions_entries_bytes_and_last_use(place):
    result = printed("cache")
    other, here = result["versions"]
    assert (result["folder"], result["bytes"]) == (str(place), 8000)
    assert (other["numba"], other["llvmlite"], other["used_here"]) == ("0.1.0", "0.2.0", False)
    names = ("numba", "used_here", "entries", "hooks", "files", "bytes")
    assert [here[name] for name in names] == [numba.__version__, True, 2, 2, 5, 4000]
    assert other["last_used"] < here["last_used"]
    text = kinetile("cache").stdout
    assert f"folder: {place}" in text
    assert "in use by this installation" in text


def test_clear_removes_what_is_of_the_cache_and_nothing_else(place):
    assert f"removed from: {place}" in kinetile("cache --clear").stdout
    assert sorted(path.name for path in place.rglob("*")) == ["mine.nbi", "notes.txt", HERE]
    assert printed("cache")["bytes"] == 0


def test_an_empty_cache_is_no_error(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "nothing"))
    assert "nothing is kept" in kinetile("cache --clear").stdout
    assert printed("cache")["versions"] == []
    assert not (tmp_path / "nothing").exists()


def test_a_folder_that_cannot_be_made_was_no_loop_compiled_yet(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "file" / "folder"))
    (tmp_path / "file").touch()
    text = kinetile("cache").stdout
    assert "machine code cannot be kept in " in text
    assert "set NUMBA_CACHE_DIR to a folder that can be written" in text
    assert "no loop has been compiled yet" not in text
    assert printed("cache")["problem"] in text


@pytest.mark.compiled
def test_loops_are_compiled_in_advance_once(monkeypatch):
    line = "cache warm grid -s bodies=4 --broad-phase naive"
    printed(line)
    (row,) = printed(line)
    assert (row["scene"], row["was_there"], row["kept"]) == ("grid", True, True)
    assert "grid: naive, disc, wall: was there already" in kinetile(line).stdout
    monkeypatch.setattr(kt.Simulation, "cached", False)  # as where nothing can be written
    assert "CPU s" in kinetile(line, code=1).stdout
    monkeypatch.setattr(kt.Simulation, "cached", None)
    assert "NUMBA_DISABLE_JIT is set" in refused(line)


@pytest.mark.compiled
def test_what_a_run_loads_is_in_the_cache_that_is_shown():
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    sim.compile()
    assert sim.cached
    (here,) = [each for each in printed("cache")["versions"] if each["used_here"]]
    assert here["entries"] >= 1
    assert here["hooks"] >= 1
