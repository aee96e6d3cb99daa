"""Scenes, their rows, and node, if installed, for the tests of the player."""

import base64
import json
import math
import subprocess
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel.clock import Clock
from kinetile.plugin.drawing import At, Box, Entry, Item, Link, Segment
from kinetile.records import Trajectory
from kinetile.show.player import view_scene
from kinetile.show.player.page import Page
from programs import program

needs_node = pytest.mark.needs("node")

SCRIPT = Path(kt.__file__).parent / "show" / "player" / "script"

SCENES = {
    "grid": kt.make_scene("grid", bodies=16, density=0.5, seed=3),
    "late start and turns": kt.Scene(
        [[1.0, 1.0], [3.0, 1.0], [2.0, 3.0]],
        [[0.7, 0.2], [-0.3, 0.3], [-0.2, -0.9]],
        0.25,
        arena=(4, 4),
        start=2.0**40,
        turns=[(1, 2.0**40 + 0.5, (0.1, -0.8)), (2, 2.0**40 + 0.5, (0.0, 0.0))],
    ),
    "odd start": kt.Scene([[0.3, 0.3], [0.7, 0.7]], [[0.7, 0.2], [-0.3, 0.9]], 0.1, arena=(1, 1), start=0.1),
    "fast": kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[70.0, 20.0], [-30.0, 10.0]], 0.25, arena=(4, 4)),
    "no walls": kt.Scene([[0.0, 0.0], [3.0, 0.0], [9.0, 9.0]], [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]], 0.5),
    "masses": kt.Scene(
        [[0.2, 0.2], [0.5, 0.5], [0.8, 0.3]],
        [[0.9, 0.4], [0.0, 0.0], [-0.7, 0.8]],
        [0.05, 0.1, 0.07],
        [1.0, np.inf, 3.0],
        arena=(1, 1),
    ),
    "come and go": kt.Scene(
        [[0.2, 0.2], [0.8, 0.8]],
        [[0.9, 0.4], [-0.5, -0.7]],
        0.1,
        arena=(1, 1),
        commands=[
            kt.Insert(0.4, (0.9, 0.1), (-0.6, 0.3), 0.05),
            kt.Remove(0, 0.9),
            kt.Turn(1, 1.1, (0.2, -0.9)),
        ],
    ),
    "sensors": kt.Scene(
        [[0.2, 0.2], [0.5, 0.5], [0.8, 0.3]],
        [[0.9, 0.4], [0.1, 0.0], [-0.7, 0.8]],
        [0.05, 0.2, 0.07],
        arena=(1, 1),
        kind=["ball", "sensor", "ball"],
        responses={("ball", "sensor"): "pass"},
    ),
    "changes": kt.Scene(
        [[0.1, 0.5], [0.5, 0.55], [0.9, 0.5]],
        [[0.9, 0.1], [0.0, 0.0], [-0.4, 0.3]],
        [0.05, 0.1, 0.07],
        arena=(1, 1),
        kind=["ball", "sensor", "ball"],
        responses={("ball", "sensor"): "pass", ("ball", "ball"): "stop"},
        commands=[kt.SetKind(0, 0.8, "sensor"), kt.SetKind(1, 1.1, "ball")],
    ),
    "rests": kt.Scene(
        [[1.0, 1.0], [1.0, 1.5], [3.0, 3.0]],
        [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]],
        mass=[np.inf, 1.0, 3.0],
        shapes=[kt.box(1.5, 0.5), kt.box(0.5, 0.5), kt.disc(0.25)],
        shape=[0, 1, 2],
        arena=(4, 4),
        gravity=(0.0, -8.0),
        responses=dict.fromkeys(
            [("*", "*"), ("*", "wall")], kt.Response("restitution", e=0.5, contact_time=1e-6, settle=0.75)
        ),
        commands=[kt.Turn(2, 1.9, (-1.0, 0.0))],
    ),
    "accelerated": kt.Scene(
        [[0.2, 0.2], [0.5, 0.5], [0.8, 0.3], [0.3, 0.8]],
        [[0.9, 0.4], [0.0, 0.0], [-0.7, 0.8], [0.0, 0.0]],
        [0.05, 0.1, 0.07, 0.05],
        [1.0, 1.0, 3.0, np.inf],
        arena=(1, 1),
        gravity=(0.3, -2.0),
        acceleration=[[math.nan, math.nan], [math.nan, math.nan], [0.0, 1.5], [math.nan, math.nan]],
        commands=[
            kt.Insert(0.4, (0.9, 0.9), (-0.6, 0.3), 0.05, acceleration=(-1.0, 0.5)),
            kt.Accelerate(1, 0.8, (0.0, 1.0)),
            kt.Turn(1, 1.1, (0.2, -0.9)),
        ],
    ),
    "slow": kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[0.001, 0.0], [0.0, 0.0]], 0.25, arena=(4, 4)),
}
UNTIL = {"slow": 3000.0, "rests": 3.0}
HARD = ("H07", "H11", "H12", "H14", "H15", "H16", "H19", "H21", "H23", "H28", "H32", "H33")
"""Names of scene files with many events at once, or at odd times."""


FILES = Path(__file__).parent / "scenes"


def torus(periodic: str, shaped: bool = False) -> kt.Scene:
    """Returns nine discs, or boxes, discs and triangles; several cross each periodic border soon."""
    if not shaped:
        return kt.make_scene("grid", bodies=9, density=0.4, seed=3, periodic=periodic)
    places = [(0.8 + right, 0.8 + up) for up in (0.0, 2.0, 4.0) for right in (0.0, 2.0, 4.0)]
    velocities = np.random.default_rng(2).uniform(-2.0, 2.0, (9, 2))
    shapes = [kt.box(1.2, 0.6), kt.disc(0.4), kt.polygon([(-0.5, -0.3), (0.6, -0.3), (0.0, 0.6)])]
    return kt.Scene(places, velocities, shape=[0, 1, 2] * 3, shapes=shapes, arena=(6, 6), periodic=periodic)


def case_of(name: str) -> tuple[kt.Scene, Trajectory, Page, list[float]]:
    """Returns one of ``SCENES`` or ``HARD``: the scene, its run for up to 200 contacts, the page of that, and
    a thousand moments."""
    scene = SCENES[name] if name in SCENES else kt.load_scene(FILES / f"{name}.toml")
    until = scene.settings.until or scene.start + UNTIL.get(name, 1.5)
    sim, parts = kt.Simulation(scene, "naive"), [np.zeros(0, kt.LOG)]
    sim.run(until, max_contacts=200, recorder=parts.append)
    trajectory = Trajectory(np.concatenate(parts), scene)
    page = view_scene(scene, [("naive", {})], until=until, steps=False, max_contacts=200).page
    times = moments(scene, trajectory.rows, scene.start, sim.time, MOMENTS)
    assert len(times) > 0.9 * MOMENTS
    return scene, trajectory, page, times


MOMENTS = 1000


def moments(scene: kt.Scene, rows: np.ndarray, begin: float, until: float, count: int) -> list[float]:
    """Returns times of events, their neighbours in float, and others between."""
    at = np.unique(rows["time"])[: count // 5].tolist()
    near = [math.nextafter(time, way) for time in at for way in (-math.inf, math.inf)]
    rng = np.random.default_rng(5)
    drawn = rng.uniform(begin, until, count - len(at) - len(near)).tolist()
    clock = Clock(scene.start, scene.time_unit)
    first, last = clock.ticks(begin), clock.ticks(until)
    return [time for time in [*at, *near, *drawn] if first < clock.ticks(time) <= last]


def record(sim: kt.Simulation, until: float) -> np.ndarray:
    parts = [np.zeros(0, kt.LOG)]
    sim.run(until, recorder=parts.append)
    return np.concatenate(parts)


def in_order(shapes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns shapes in a fixed order, shapes at one place by all their fields: bodies may have one home."""
    names = ("role", "coordinates", "shape", "label")
    return sorted(shapes, key=lambda shape: [*(shape[name] for name in names), shape["fails"] or []])


def plain(item: Item) -> dict[str, object]:
    """Returns a shape in the form of the page's script."""
    if isinstance(item, Link | Entry):
        points = [(At(item.a), At(item.a)), (At(item.b), At(item.b))]
    elif isinstance(item, Segment):
        points = [item.a, item.b]
    else:
        points = [item.low, item.high] if isinstance(item, Box) else list(item.corners)
    flat = [each for point in points for each in point]
    return {
        "shape": type(item).__name__.lower(),
        "role": item.role,
        "label": item.label,
        "fails": None if item.fails is None else list(divmod(item.fails, 2**52)),
        "coordinates": [list(each) if isinstance(each, At) else [-1, each, 0] for each in flat],
    }


PLACES_OF = """(motion, moment) => {
    const those = [...motion.plans.there.keys()].filter((body) => motion.plans.there[body]);
    return those.map((body) => motion.place(body, moment));
}"""
"""A function of JavaScript: the places of the present bodies, by number."""


def ask_node(tmp_path: Path, page: Page, body: str, **given: Any) -> Any:
    """Runs a script with the page's playback and the given values, and returns its JSON output.

    The script is the body of a function of ``playback``, ``held``, ``bodies``, ``given`` and the modules by
    name.
    """
    asked = tmp_path / "asked.json"
    asked.write_text(json.dumps({"held": page.held, "given": given}))
    names = ("clock", "events", "live", "playback", "proof", "sentences")
    names = ("page/camera", "page/tables", "page/trial", *(f"run/{name}" for name in names))
    imports = "\n".join(
        f"import * as {name.split('/')[1]} from {json.dumps((SCRIPT / f'{name}.mjs').as_uri())};"
        for name in names
    )
    node, asking = program("node"), tmp_path / "ask.mjs"
    asking.write_text(
        f"{imports}\nimport {{ readFileSync }} from 'node:fs';\n"
        f"const {{ held, given }} = JSON.parse(readFileSync({json.dumps(str(asked))}, 'utf8'));\n"
        "const { bodies, runs } = await playback.load(held);\n"
        "const play = new playback.Playback(bodies, runs, held);\n"
        f"const placesOf = {PLACES_OF};\n"
        f"const answer = (() => {{ {body} }})();\n"
        "console.log(JSON.stringify(answer));\n"
    )
    done = subprocess.run([node, str(asking)], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


PLAYED = """
const [run] = play.runs;
play.seek(given.moment);
const { plans, done } = run.motion;
const rows = { count: done };
const take = (name, sides) => { rows[name] = [...run.motion.rows[name].slice(0, sides * done)]; };
["kind", "a", "b", "epoch", "tick"].forEach((name) => take(name, 1));
["x", "y", "vx", "vy", "before"].forEach((name) => take(name, 2));
const own = new live.Live(bodies, plans, rows, play.moment, held);
for (const [body, velocity] of given.turns) own.turn(body, velocity);
for (const [place, velocity, radius, mass] of given.inserts) own.insert(place, velocity, radius, mass);
own.until(clock.ticksOf(held.end));
const found = [];
for (let row = 0; row < rows.count; row += 1) {
    const isContact = rows.kind[row] === 1 || rows.kind[row] === 2;
    if (isContact) found.push([rows.epoch[row], rows.tick[row], rows.a[row], rows.b[row]]);
}
return found;
"""
"""The contacts of a run that a page computes from a moment on, after turns and insertions."""


def decode(coded: dict[str, Any]) -> dict[str, np.ndarray]:
    """Returns the columns of a text of ``encode``."""
    content = zlib.decompress(base64.b64decode(coded["text"]))
    columns, at = {}, 0
    for name, kind, length in coded["columns"]:
        size = int(kind[1:])
        planes = np.frombuffer(content, np.uint8, size * length, at).reshape(size, length)
        columns[name] = np.ascontiguousarray(planes.T).reshape(-1).view(f"<{kind}")
        at += size * length
    return columns
