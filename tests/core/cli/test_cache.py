"""``kinetile cache``: what it shows, removes and finds damaged, and what it leaves alone."""

from __future__ import annotations

import hashlib
import os
import time

import llvmlite
import numba
import pytest

import kinetile as kt
from command_line import kinetile, printed
from kinetile.kernel.compiled import INTERPRETED

HERE = f"numba-{numba.__version__}-llvmlite-{llvmlite.__version__}"
OTHER = "numba-0.1.0-llvmlite-0.2.0"


def write(path, days=0.0, content=b"machine code", whole=True):
    path.parent.mkdir(exist_ok=True)
    content += bytes(32)  # the digest of a key
    digest = hashlib.sha256(path.name.encode() + b"\0" + content).digest()
    path.write_bytes(content + (digest if whole else b"x" * 32))
    moment = time.time() - days * 86400.0
    os.utime(path, (moment, moment))
    return path


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A cache with an entry in use, an old one of other versions, and files that are not the cache's."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    write(tmp_path / HERE / "loop.advance_a-95.py311.nbi")
    write(tmp_path / HERE / "loop.advance_a-95.py311.1.nbc", content=b"y" * 1000)
    write(tmp_path / OTHER / "loop.advance_b-95.py311.nbi", days=40)
    write(tmp_path / OTHER / "loop.advance_b-95.py311.1.nbc", days=40)
    (tmp_path / "mine.nbi").write_text("somebody else's")
    (tmp_path / HERE / "notes.txt").write_text("somebody else's")
    return tmp_path


def left(place):
    return sorted(path.name for path in place.rglob("*") if path.is_file())


def test_show_lists_versions_entries_bytes_and_last_use(place):
    result = printed("cache show")
    assert result["folder"] == str(place)
    other, here = result["versions"]
    assert (other["numba"], other["llvmlite"], other["used_here"]) == ("0.1.0", "0.2.0", False)
    found = [here[name] for name in ("numba", "used_here", "entries", "files")]
    assert found == [numba.__version__, True, 1, 2]
    assert here["bytes"] == 1000 + 64 + 12 + 64
    assert result["bytes"] == here["bytes"] + other["bytes"]
    assert other["last_used"] < here["last_used"]
    text = kinetile("cache show").stdout
    assert str(place) in text
    assert "in use by this installation" in text
    assert kinetile("cache show --csv").stdout.startswith(
        "numba,llvmlite,entries,files,bytes,last_used,used_here\n"
    )


def test_an_empty_cache_is_no_error(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "nothing"))
    assert "nothing is kept" in kinetile("cache show").stdout
    assert printed("cache show")["versions"] == []
    assert "removed from" in kinetile("cache clean").stdout
    assert not (tmp_path / "nothing").exists()


def test_clean_removes_what_is_unused_or_damaged_and_nothing_else(place):
    write(place / HERE / "loop.advance_c-95.py311.nbi", whole=False)
    write(place / HERE / "loop.advance_d-95.py311.nbi.tmp.0123abcd", days=1)
    fresh = write(place / HERE / "loop.advance_e-95.py311.nbi.tmp.4567abcd")
    before = left(place)
    dry = printed("cache clean --dry-run")
    assert left(place) == before
    result = printed("cache clean")
    assert result["removed"] == dry["removed"]
    assert {each["file"]: each["why"] for each in result["removed"]} == {
        f"{OTHER}/loop.advance_b-95.py311.1.nbc": "not used for 30 days",
        f"{OTHER}/loop.advance_b-95.py311.nbi": "not used for 30 days",
        f"{HERE}/loop.advance_c-95.py311.nbi": "damaged",
        f"{HERE}/loop.advance_d-95.py311.nbi.tmp.0123abcd": "left by a write that was cut off",
    }
    assert not (place / OTHER).exists()
    assert left(place) == sorted(
        ["loop.advance_a-95.py311.nbi", "loop.advance_a-95.py311.1.nbc", "mine.nbi", "notes.txt", fresh.name]
    )


def test_clean_by_days_and_clean_all(place):
    assert "removed from" in kinetile("cache clean --unused 50").stdout
    assert len(left(place)) == 6
    text = kinetile("cache clean --all").stdout
    assert "--all: 4 files" in text
    assert left(place) == ["mine.nbi", "notes.txt"]


def test_a_file_that_a_power_cut_left_empty_is_damaged(place):
    (place / HERE / "loop.advance_c-95.py311.nbi").write_bytes(b"")
    (found,) = [each for each in printed("cache clean --dry-run")["removed"] if each["why"] == "damaged"]
    assert found["file"] == f"{HERE}/loop.advance_c-95.py311.nbi"


@pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")
def test_what_a_run_loads_is_in_the_cache_that_is_shown(tmp_path):
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    sim.compile()
    assert sim.cached
    (here,) = [each for each in printed("cache show")["versions"] if each["used_here"]]
    assert here["entries"] >= 1
