"""Frames for other programs: read again by independent readers, and as scenes."""

import json
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import BadOption, RecordError
from kinetile.records.frames import frames_of, write_frames
from messages import table

pytest.importorskip("pyarrow")

TIMES = [0.0, 0.25, 0.5]


def scene() -> kt.Scene:
    made = kt.make_scene("grid", bodies=9, density=0.5, seed=3)
    coming = [kt.Insert(0.3, tuple(made.position[8]), (0.3, 0.2), 1e-3, 0.5, kind="late"), kt.Remove(8, 0.2)]
    mass = np.linspace(1.0, 3.0, 9)
    return made.replace(commands=coming, mass=mass, kind=["early"] * 9, kinds=["early", "late"])


def written(path, form: str, of=None) -> tuple:
    sim = kt.Simulation(scene() if of is None else of, "naive")
    file = path / f"frames{form}"
    assert write_frames(file, sim.scene, frames_of(sim, TIMES)) == 3
    return file, sim


def torus() -> kt.Scene:
    """Discs of two sizes, fast ones, in a box that is periodic along x; one begins in another box."""
    made = kt.make_scene("mixture", bodies=16, density=0.3, seed=5, periodic="x")
    place = made.position + np.array([3.0 * made.arena[0], 0.0]) * (np.arange(16) == 7)[:, None]
    return made.replace(position=place, velocity=8.0 * made.velocity)


def shaped() -> kt.Scene:
    hexagon = kt.polygon([(1, 0), (0.5, 1), (-0.5, 1), (-1, 0), (-0.5, -1), (0.5, -1)], 0.25)
    return kt.Scene(
        [(1.0, 1.0), (1.0, 3.0), (4.0, 1.0), (4.0, 4.0), (1.0, 5.0)],
        [(1.0, 0.5), (0.0, 0.0), (-1.0, 0.0), (0.0, 0.0), (0.5, 0.0)],
        mass=[1.0, 2.0, 0.5, np.inf, 1.0],
        arena=(6.0, 6.0),
        shapes=[kt.box(1.0, 0.5), kt.capsule((-0.5, 0.0), (0.5, 0.0), 0.25), kt.disc(0.5), hexagon],
        shape=[0, 1, 2, 3, 0],
        kind=["a", "a", "b", "b", "b"],
        commands=[
            kt.Remove(4, 0.3),
            kt.Insert(0.3, (1.0, 5.0), (0.0, 0.5), shape=kt.box(0.25, 0.5), kind="a"),
        ],
    )


SCENES = {"kinds, one comes and one goes": scene, "a torus": torus, "shapes": shaped}


@pytest.mark.parametrize("name", SCENES)
def test_frames_in_memory_are_those_of_files(name, tmp_path):
    ase = pytest.importorskip("ase.io")
    file, _ = written(tmp_path, ".xyz", SCENES[name]())
    made = [*kt.frames(kt.Simulation(SCENES[name]()), TIMES)]
    assert made == ase.read(file, ":", format="extxyz")
    assert [each.info["Time"] for each in made] == TIMES
    if find_spec("gsd"):
        of_gsd = [*kt.frames(kt.Simulation(SCENES[name]()), TIMES, "gsd")]
        assert [each.particles.N for each in of_gsd] == [len(each) for each in made]
    with pytest.raises(BadOption, match="expected one of ase, gsd"):
        next(kt.frames(kt.Simulation(SCENES[name]()), TIMES, "vtk"))


@pytest.mark.parametrize("name", SCENES)
def test_ase_reads_what_is_written(name, tmp_path):
    ase = pytest.importorskip("ase.io")
    file, sim = written(tmp_path, ".xyz", SCENES[name]())
    frames = ase.read(file, ":", format="extxyz")
    assert [each.info["Time"] for each in frames] == TIMES
    last, mass, velocity = frames[-1], sim.masses(), sim.velocities()
    assert last.positions[:, :2].tobytes() == sim.positions().tobytes()
    assert last.arrays["velo"][:, :2].tobytes() == velocity.tobytes()
    moves = (velocity != 0.0).any(axis=1)
    assert last.get_momenta()[moves, :2].tobytes() == (mass[moves, None] * velocity[moves]).tobytes()
    assert not last.get_momenta()[~moves].any()
    assert last.arrays["radius"].tolist() == sim.radii().tolist()
    assert last.get_masses().tolist() == last.arrays["mass"].tolist() == mass.tolist()
    assert last.arrays["id"].tolist() == sim.bodies.tolist()
    assert [sim.scene.kinds[each] for each in last.arrays["kind"]] == sim.kinds.tolist()
    assert last.cell.lengths().tolist() == [*sim.scene.arena, 1.0]
    assert last.pbc.tolist() == [axis in sim.scene.periodic for axis in "xyz"]
    away = last.arrays["map_shift"] * last.cell.lengths()
    assert (last.positions + away)[:, :2] == pytest.approx(sim.unwrapped(), rel=1e-14)
    together = [*zip(sim.kinds, sim.shapes() if sim.scene.shapes else sim.radii(), strict=True)]
    assert len({*zip(last.symbols, together, strict=True)}) == len({*last.symbols}) == len({*together})


@pytest.mark.parametrize("name", SCENES)
def test_gsd_reads_what_is_written(name, tmp_path):
    hoomd = pytest.importorskip("gsd.hoomd")
    file, sim = written(tmp_path, ".gsd", SCENES[name]())
    with hoomd.open(str(file)) as frames:
        assert [float(each.log["time"][0]) for each in frames] == TIMES
        last = frames[2]
    found, sides = last.particles, np.array(sim.scene.arena)
    assert last.configuration.dimensions == 2
    assert last.configuration.box[:2].tolist() == np.float32(sides).tolist()
    expected = (sim.positions() - sides / 2).astype(np.float32)
    assert found.position[:, :2].tobytes() == expected.tobytes()
    unwrapped = expected + sides / 2 + found.image[:, :2] * sides
    assert unwrapped == pytest.approx(sim.unwrapped(), rel=1e-6)
    assert not found.image[:, ["x" not in sim.scene.periodic, True, True]].any()
    assert [found.types[each].split()[0] for each in found.typeid] == [*map(str, sim.kinds)]
    assert found.diameter.tolist() == (2.0 * sim.radii()).astype(np.float32).tolist()
    assert found.mass.tolist() == sim.masses().astype(np.float32).tolist()
    assert last.log["particles/number"].tolist() == sim.bodies.tolist()
    for number, shape in zip(found.typeid, sim.shapes(), strict=True):
        described = [*found.type_shapes, {}, {}][number]
        if shape is not None and not shape.is_disc:
            corners = dict.fromkeys(map(tuple, described["vertices"]))
            assert (*corners,) == shape.core
            assert len(described["vertices"]) >= 3
            assert described["rounding_radius"] == shape.radius
        elif described:
            assert described["type"] == "Sphere"


def test_shapes_are_beside_xyz(tmp_path):
    file, sim = written(tmp_path, ".xyz", shaped())
    beside = json.loads((tmp_path / "frames.xyz.shapes.json").read_text())
    assert [each["type"][0] for each in beside["shapes"]] == [*"PPSPP"]  # polygons and a sphere
    assert beside["bodies"] == {"0": 0, "1": 1, "2": 2, "3": 3, "4": 0, "5": 4}
    again = kt.make_scene("frame", file=str(file))
    assert again.shapes == sim.scene.shapes
    assert again.shape.tolist() == [0, 1, 2, 3, 4]
    assert again.position.tobytes() == sim.positions().tobytes()
    assert again.kind == (0, 0, 1, 1, 0)


def test_a_shape_that_was_inserted_by_hand_is_in_the_table(tmp_path):
    sim, new = kt.Simulation(shaped(), "naive", live=True), kt.capsule((0.0, 0.0), (0.25, 0.0), 0.125)
    sim.insert((2.5, 5.0), shape=new)
    for form in (".xyz", ".gsd") if find_spec("gsd") else (".xyz",):
        write_frames(tmp_path / f"frames{form}", sim.scene, frames_of(sim, [sim.time]))
        again = kt.make_scene("frame", file=str(tmp_path / f"frames{form}"))
        assert new in again.shapes
        assert [again.shapes[each] for each in again.shape] == sim.shapes().tolist()


def test_a_frame_is_a_scene_again(tmp_path):
    file, sim = written(tmp_path, ".xyz")
    again = kt.make_scene("frame", file=str(file))
    assert again.position.tobytes() == sim.positions().tobytes()
    assert again.velocity.tobytes() == sim.velocities().tobytes()
    assert (again.radius.tolist(), again.mass.tolist()) == (sim.radii().tolist(), sim.masses().tolist())
    assert (again.arena, again.start, again.kind) == (sim.scene.arena, 0.5, (0,) * 8 + (1,))
    first = kt.make_scene("frame", file=str(file), frame=0)
    assert first.position.tobytes() == sim.scene.position.tobytes()
    assert len(set(first.kind)) == 1
    assert kt.make_scene("frame", file=str(file), shrink=0.5).radius.tolist() == (again.radius / 2).tolist()


def test_a_frame_of_gsd_is_a_scene_in_single_precision(tmp_path):
    pytest.importorskip("gsd.hoomd")
    file, sim = written(tmp_path, ".gsd")
    again = kt.make_scene("frame", file=str(file), shrink=1e-6)
    assert again.position == pytest.approx(sim.positions(), abs=1e-7)
    assert again.kind == (0,) * 8 + (1,)


def test_an_event_file_gives_the_frames_of_its_run(tmp_path, monkeypatch):
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


def head(text: str) -> str:
    return XYZ.format(head=text)


def frame(text: str, **options) -> kt.Scene:
    Path("other.xyz").write_text(text)
    return kt.make_scene("frame", file="other.xyz", **options)


test_message = table(globals())


def test_frames_of_others_need_places_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lattice = 'Lattice="4 0 0 0 2 0 0 0 9" Origin="0 0.5 0" Properties=pos:R:3:charge:R:1'
    found = frame(head(lattice), radius=0.25)
    assert found == kt.Scene([(1.0, 1.0), (3.0, 0.5)], np.zeros((2, 2)), 0.25, arena=(4.0, 2.0))
    plane = frame(head("Properties=pos:R:3:radius:R:1"))
    assert plane == kt.Scene([(1.0, 1.5), (3.0, 1.0)], np.zeros((2, 2)), 0.5)
