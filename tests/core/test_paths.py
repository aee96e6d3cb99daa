"""Every public function that takes a path takes whatever names one: text, a Path, anybody's PathLike."""

import os
import sys
from pathlib import Path

import pytest

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.plugin.new_plugin import new_plugin
from kinetile.records import EventRecorder, Trajectory, positions_at, read_events, recover
from kinetile.records.contacts import write_contacts
from kinetile.show.player.view import view_file, view_scene
from kinetile_conformance.api import replay


class Named:
    """A path that is no Path, and that says nothing of use as text."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __fspath__(self) -> str:
        return str(self.path)


@pytest.fixture(params=[str, Named], ids=lambda kind: kind.__name__)
def named(request, tmp_path):
    return lambda name: request.param(tmp_path / name)


def test_scenes_and_simulations(named):
    scene = kt.make_scene("two-discs")
    kt.save_scene(scene, named("s.toml"))
    assert kt.load_scene(named("s.toml")) == scene
    sim = kt.Simulation(scene, "naive")
    sim.save(named("s.kt"))
    assert kt.resume(named("s.kt")).snapshot() == sim.snapshot()
    write_contacts(named("c.txt"), sim.contacts, sim.fingerprint, (1.0, 0.0))


def test_event_files_and_views(named):
    pytest.importorskip("pyarrow")
    scene = kt.make_scene("two-discs")
    with EventRecorder(named("e.parquet"), scene) as recorder:
        path = os.fspath(named("e.parquet"))
        Path(f"{path}.copy").write_bytes(Path(f"{path}.partial").read_bytes())
    assert recorder.status == "complete"
    assert len(read_events(named("e.parquet")).rows) == 0
    assert Trajectory.read(named("e.parquet")).scene == scene
    for given in (None, scene):
        assert positions_at(named("e.parquet"), given, 0.0).tolist() == scene.position.tolist()
    assert recover(named("e.parquet.copy"), named("r.parquet")).status == "killed"
    assert "e.parquet" in view_file(named("e.parquet")).page.title
    page = view_scene(scene, [("naive", {})], until=0.1, steps=False)
    assert page.save(named("v.html")) == Path(os.fspath(named("v.html")))
    with pytest.raises(RecordError, match=r"nothing\.parquet cannot be read"):
        read_events(named("nothing.parquet"))


def test_the_kit_the_report_and_new_plugins(named):
    with pytest.raises(FileNotFoundError, match=r"nothing\.toml"):
        replay("naive", named("nothing.toml"))
    Path(os.fspath(named("into"))).mkdir()
    assert new_plugin("odd-one", named("into")).name == "kinetile-odd-one"


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="names are Unicode there")
def test_an_event_file_was_written_under_a_name_under_which_it_could_not_be_read(tmp_path):
    pytest.importorskip("pyarrow")
    name = tmp_path / os.fsdecode(b"e\xff.parquet")
    with EventRecorder(name, kt.make_scene("two-discs")):
        pass
    assert read_events(name).metadata["status"] == "complete"
