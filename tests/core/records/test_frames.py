"""Frames for other programs: read again by independent readers, and as scenes."""

from __future__ import annotations

import os

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile, refused
from kinetile.errors import BadOption, RecordError
from kinetile.records.frames import frames_of, write_frames

TIMES = [0.0, 0.25, 0.5]


def scene() -> kt.Scene:
    made = kt.make_scene("grid", bodies=9, density=0.5, seed=3)
    coming = [kt.Insert(0.3, tuple(made.position[8]), (0.3, 0.2), 1e-3, 0.5, kind="late"), kt.Remove(8, 0.2)]
    mass = np.linspace(1.0, 3.0, 9)
    return made.replace(commands=coming, mass=mass, kind=["early"] * 9, kinds=["early", "late"])


def written(path, form: str, of=None) -> tuple:
    """Write frames of a run to a file, and return it with the simulation at the last of them."""
    sim = kt.Simulation(scene() if of is None else of, "naive")
    file = path / f"frames{form}"
    assert write_frames(file, sim.scene, frames_of(sim, TIMES)) == 3
    return file, sim


def test_ase_reads_what_is_written(tmp_path):
    ase = pytest.importorskip("ase.io")
    file, sim = written(tmp_path, ".xyz")
    frames = ase.read(file, ":", format="extxyz")
    assert [each.info["Time"] for each in frames] == TIMES
    assert [len(each) for each in frames] == [9, 8, 9]
    last = frames[-1]
    assert last.positions[:, :2].tobytes() == sim.positions().tobytes()
    assert last.arrays["velo"][:, :2].tobytes() == sim.velocities().tobytes()
    assert last.arrays["radius"].tolist() == sim.radii().tolist()
    assert last.arrays["mass"].tolist() == sim.masses().tolist()
    assert last.arrays["id"].tolist() == sim.bodies.tolist() == [*range(8), 9]
    assert last.arrays["type"].tolist() == [1] * 8 + [2]
    assert last.cell.lengths().tolist() == [*sim.scene.arena, 1.0]
    assert not last.pbc.any()


def test_gsd_reads_what_is_written(tmp_path):
    hoomd = pytest.importorskip("gsd.hoomd")
    file, sim = written(tmp_path, ".gsd")
    with hoomd.open(str(file)) as frames:
        assert [float(each.log["time"][0]) for each in frames] == TIMES
        last = frames[2]
    width, height = sim.scene.arena
    assert last.configuration.dimensions == 2
    assert last.configuration.box[:2].tolist() == np.float32([width, height]).tolist()
    middle = np.array([width, height]) / 2
    expected = (sim.positions() - middle).astype(np.float32)
    assert last.particles.position[:, :2].tobytes() == expected.tobytes()
    assert last.particles.types == ["early", "late"]
    assert last.particles.typeid.tolist() == [0] * 8 + [1]
    assert last.particles.diameter.tolist() == (2.0 * sim.radii()).astype(np.float32).tolist()
    assert last.log["particles/number"].tolist() == sim.bodies.tolist()


def test_a_frame_is_a_scene_again(tmp_path):
    file, sim = written(tmp_path, ".xyz")
    again = kt.make_scene("frame", file=str(file))
    assert again.position.tobytes() == sim.positions().tobytes()
    assert again.velocity.tobytes() == sim.velocities().tobytes()
    assert (again.radius.tolist(), again.mass.tolist()) == (sim.radii().tolist(), sim.masses().tolist())
    assert (again.arena, again.start, again.kind) == (sim.scene.arena, 0.5, ("1",) * 8 + ("2",))
    first = kt.make_scene("frame", file=str(file), frame=0)
    assert first.position.tobytes() == sim.scene.position.tobytes()
    assert len(set(first.kind)) == 1
    assert kt.make_scene("frame", file=str(file), shrink=0.5).radius.tolist() == (again.radius / 2).tolist()


def test_a_frame_of_gsd_is_a_scene_in_single_precision(tmp_path):
    pytest.importorskip("gsd.hoomd")
    file, sim = written(tmp_path, ".gsd")
    again = kt.make_scene("frame", file=str(file), shrink=1e-6)
    assert again.position == pytest.approx(sim.positions(), abs=1e-7)
    assert again.kind == ("early",) * 8 + ("late",)


def test_an_event_file_gives_the_frames_of_its_run(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    made = scene()
    kt.save_scene(made, "scene.toml")
    sim = kt.Simulation(made, "naive")
    with kt.EventRecorder("run.parquet", made) as recorder:
        sim.run(0.5, recorder=recorder)
    for source in ("run.parquet", "scene.toml --broad-phase naive --until 0.5"):
        said = kinetile(f"export {source} --every 0.25 --to out.xyz --overwrite").stdout
        assert said == "out.xyz: 3 frames, from time 0 to 0.5\n"
        assert (tmp_path / "out.xyz").read_bytes() == written(tmp_path, ".xyz")[0].read_bytes()


def test_a_body_inserted_by_hand_has_no_radius_in_an_event_file(tmp_path):
    pytest.importorskip("pyarrow")
    made = kt.make_scene("two-discs")
    sim = kt.Simulation(made, "naive", live=True)
    with kt.EventRecorder(tmp_path / "run.parquet", made) as recorder:
        sim.insert((50.0, 50.0) if made.arena is None else (0.05, 0.05), radius=0.01)
        sim.run(0.1, recorder=recorder)
    with pytest.raises(RecordError, match="the radius of body 2 is not in the event file"):
        list(frames_of(kt.Trajectory.read(tmp_path / "run.parquet"), [0.1]))


XYZ = """2
{head}
1.0 1.5 0.0 0.5
3.0 1.0 0.0 0.5
"""


def frame(tmp_path, head: str, **options) -> kt.Scene:
    (tmp_path / "other.xyz").write_text(XYZ.format(head=head))
    return kt.make_scene("frame", file=str(tmp_path / "other.xyz"), **options)


def test_frames_of_others_need_places_alone(tmp_path):
    found = frame(
        tmp_path, 'Lattice="4 0 0 0 2 0 0 0 9" Origin="0 0.5 0" Properties=pos:R:3:charge:R:1', radius=0.25
    )
    assert found == kt.Scene([(1.0, 1.0), (3.0, 0.5)], np.zeros((2, 2)), 0.25, arena=(4.0, 2.0))
    plane = frame(tmp_path, "Properties=pos:R:3:radius:R:1")
    assert plane == kt.Scene([(1.0, 1.5), (3.0, 1.0)], np.zeros((2, 2)), 0.5)


@pytest.mark.parametrize(
    ("head", "options", "said"),
    [
        ("Properties=pos:R:3:charge:R:1", {}, "has no radii: expected one for all"),
        ("Properties=pos:R:3:radius:R:1", {"frame": 1}, "frame 1 cannot be read"),
        ("a comment", {}, "frame -1 cannot be read: KeyError.'Properties'"),
        ('Lattice="4 1 0 0 2 0 0 0 9" Properties=pos:R:3:radius:R:1', {}, "its Lattice is no rectangle"),
    ],
)
def test_what_is_no_frame_is_refused(tmp_path, head, options, said):
    with pytest.raises(BadOption, match=said):
        frame(tmp_path, head, **options)


def test_the_command_refuses_what_it_cannot_do(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "expected a name that ends in .xyz" in refused("export grid --to frames.txt")
    assert "expected a time greater than 0" in refused("export grid --to a.xyz --every 0")
    assert "it takes no parameters" in refused("export run.parquet --to a.xyz -s bodies=4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["-2\n\n", "0\n\n-2\n\n", "9" * 70_000, "3\nProperties=pos:R:3\n1 2 3\n"])
def test_a_frame_of_minus_two_bodies_never_ended(tmp_path, text):
    (tmp_path / "f.xyz").write_text(text)
    with pytest.raises(BadOption, match="cannot be read"):
        kt.make_scene("frame", file=str(tmp_path / "f.xyz"))


def test_a_pipe_in_place_of_frames_was_waited_for(tmp_path):
    os.mkfifo(tmp_path / "f.xyz")
    with pytest.raises(BadOption, match="it is no regular file"):
        kt.make_scene("frame", file=str(tmp_path / "f.xyz"))


@pytest.mark.parametrize("every", ["1e-9", "1e-320", "nan", "inf", "0"])
def test_frames_without_number_took_all_memory(tmp_path, every):
    said = refused(f"export grid -s bodies=4 --until 100 --every {every} --to", tmp_path / "f.xyz")
    assert "--every" in said
    assert not (tmp_path / "f.xyz").exists()
