"""The second implementation, in JavaScript: the vectors hold in it, and it prints kinetile's list."""

import json
import math
import random
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import box_scenes
import by_the_rules
import convex_scenes
import games
import kinetile as kt
import messages
from judged_games import game_tables, node, second_agrees, second_list, with_end
from kinetile.errors import Refused
from kinetile_accuracy import certify_log
from lanes import BUILT_IN, GENERAL, first

HERE = Path(__file__).parent
VECTORS = HERE.parent / "vectors"

pytestmark = pytest.mark.needs("node")

MANY = 50
"""Rows of a family of vectors: the default lane checks one in a hundred."""

FEW_RUNS = 10
"""The default lane follows one in four runs of larger files of rules."""

FEW = 100
"""Contacts of a game with accelerations: plain Python hooks take a while for its chords."""

Tables = dict[str, Any]

HALF_BACK = {
    "between": ["*", "wall"],
    "response": "restitution",
    "options": {"e": 0.5, "contact_time": 0.125},
}


@pytest.mark.skipif(not VECTORS.is_dir(), reason="there are no vectors beside this folder")
@pytest.mark.parametrize("one_in", first(1, [100, 1]))
def test_the_vectors_hold(one_in: int, tmp_path: Path) -> None:
    folder = shutil.copytree(VECTORS, tmp_path / "vectors")
    for file in folder.rglob("*.json"):
        vectors = json.loads(file.read_text())
        for name, rows in vectors.get("families", {}).items():
            vectors["families"][name] = rows[::one_in] if len(rows) > MANY else rows
        if file.parent.name == "runs":
            vectors["runs"] = vectors["runs"][::one_in]
        elif one_in > 1 and len(vectors.get("runs", ())) > FEW_RUNS:
            vectors["runs"] = vectors["runs"][::4]
        file.write_text(json.dumps(vectors))
    done = node("check.js", str(folder))
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.skipif(not VECTORS.is_dir(), reason="there are no vectors beside this folder")
def test_a_wrong_answer_is_found(tmp_path: Path) -> None:
    times = json.loads((VECTORS / "times.json").read_text())
    family = next(iter(times["families"]))
    times["families"][family][0][-1] += "0"
    (tmp_path / "times.json").write_text(json.dumps(times))
    done = node("check.js", str(tmp_path))
    count = len(times["families"][family])
    assert done.returncode == 1
    assert f"{count - 1} of {count} hold: times, {family}\n" in done.stdout


def test_what_computes_runs_in_a_browser_too() -> None:
    for file in HERE.glob("*.js"):
        ours = re.findall(r'from "([^"]+)"', file.read_text())
        thin = file.name in ("run.js", "check.js", "pipe.js")
        assert thin or (all(name.startswith("./") for name in ours) and "process." not in file.read_text())


def shaped(seed: int, axes: tuple[str, ...] = ("",)) -> kt.Scene:
    """Returns boxes and discs, with or without periodic axes; every third has bodies of infinite mass."""
    scene = (convex_scenes if seed % 2 else box_scenes).drawn(seed, axes=axes)
    some = random.Random(f"immovable {seed}")
    mass = [math.inf if seed % 3 == 0 and some.random() < 0.4 else each for each in scene.mass.tolist()]
    return scene.replace(mass=mass)


@pytest.mark.small
@pytest.mark.parametrize("axes", [("",), ("x", "y", "xy")], ids=["walls", "periodic"])
@pytest.mark.parametrize("seed", first(1, range(16)))
def test_it_prints_the_list_of_a_scene_with_shapes(seed: int, axes: tuple[str, ...], tmp_path: Path) -> None:
    assert_prints_the_list_of_shapes(shaped(seed, axes), tmp_path)


@pytest.mark.small
def test_of_faces_without_a_margin_one_that_approaches_counts(tmp_path: Path) -> None:
    """A box flies against another's side, lower than its top by less than a rounding. At their third meeting
    it is, anchored, a rounding behind the side and on the line of the top, which it does not approach."""
    scene = kt.Scene(
        position=[(0.64, 1.03), (2.56, 1.47)],
        velocity=[(0.0, 0.0), (-0.42, 0.0)],
        shapes=[kt.box(0.55, 0.58), kt.box(0.77, 0.3)],
        shape=[0, 1],
        arena=(4.0, 4.0),
    )
    assert_prints_the_list_of_shapes(scene, tmp_path)


def test_it_prints_the_list_up_to_a_time(tmp_path: Path) -> None:
    """Whose contacts belong to it."""
    ball = {"position": [1.0, 1.0], "velocity": [1.0, 0.0], "radius": 0.5}
    (tmp_path / "scene.json").write_text(json.dumps({"arena": [4.0, 4.0], "unit": 1.0, "bodies": [ball]}))
    *lines, last = node("run.js", str(tmp_path / "scene.json"), "--until", "5.5").stdout.splitlines()
    assert lines == [f"2 {2**51} 0 -2", f"5 {2**51} 0 -1"]
    assert last.startswith("fingerprint ")


def test_a_unit_may_be_longer_than_1(tmp_path: Path) -> None:
    ball = kt.Scene([(0.5, 0.5)], [(2.0**-41, 2.0**-42)], 0.25, arena=(1.0, 1.0), unit=2.0**40)
    assert second_agrees(ball.replace(settings=kt.Settings(until=2.0**50)), tmp_path, 700)


def test_the_fingerprint_goes_on_over_blocks(tmp_path: Path) -> None:
    ball = kt.Scene(position=[(0.5, 0.5)], velocity=[(0.5, 0.0)], radius=0.25, arena=(1.0, 1.0))
    assert second_agrees(ball.replace(settings=kt.Settings(until=20_000.0)), tmp_path, 8_200)


def assert_prints_the_list_of_shapes(scene: kt.Scene, tmp_path: Path, most: int = 60) -> None:
    """Asserts that both find the same contacts of a scene, at most ``most``."""
    game = scene.replace(settings=kt.Settings(until=20.0 * scene.time_unit))
    assert second_agrees(game, tmp_path, most)


@pytest.mark.small
@pytest.mark.parametrize("draw", [games.draw_game, games.draw_game_of_shapes])
@pytest.mark.parametrize("seed", first(1, range(30)))
def test_it_plays_a_game_as_kinetile_does(draw: Callable[[int], kt.Scene], seed: int, tmp_path: Path) -> None:
    assert second_agrees(draw(seed), tmp_path)


@pytest.mark.small
@pytest.mark.parametrize(
    "draw", [games.draw_accelerated_game, games.draw_changing_game, games.draw_moving_game]
)
@pytest.mark.parametrize("seed", first(1, range(200)))
def test_a_game_is_one_in_both_and_under_another_phase_and_is_certified(
    draw: Callable[[int], kt.Scene], seed: int, tmp_path: Path
) -> None:
    game = draw(seed)
    assert second_agrees(game, tmp_path, FEW)
    sim, end = with_end(game, most=FEW)
    assert certify_log(game, sim.contacts, **end, fingerprint=sim.fingerprint).right
    phase = BUILT_IN[seed % len(BUILT_IN)]
    with suppress(Refused):  # phases that refuse passing or periodic axes
        kt.Simulation(game, phase).build()
        assert games.play(game, phase, FEW).contacts == sim.contacts[["epoch", "tick", "a", "b"]].tolist()


@pytest.mark.small
@pytest.mark.parametrize(
    ("seed", "most"), first(1, [*((seed, 20) for seed in (1, 3, 4, 8)), *((seed, FEW) for seed in range(40))])
)
def test_a_game_of_accelerated_shapes_is_one_in_both_and_by_the_rules(
    seed: int, most: int, tmp_path: Path
) -> None:
    game = games.draw_accelerated_game_of_shapes(seed)
    rows, _, fingerprint = second_list(game_tables(game, tmp_path), tmp_path, most)
    ticks = [((epoch << 52) + tick, a, b) for epoch, tick, a, b in rows]
    assert ticks == by_the_rules.answer_of_game(game, most)
    played = games.play(game, most=most)
    assert (rows, fingerprint) == (played.contacts, played.fingerprint)


@pytest.mark.small
@pytest.mark.parametrize("axes", [("",), ("x", "y", "xy")], ids=["walls", "periodic"])
@pytest.mark.parametrize("seed", first(1, range(30)))
def test_shapes_that_pass_are_certified(seed: int, axes: tuple[str, ...], tmp_path: Path) -> None:
    """By the certifier, and kinetile has the same contacts."""
    rng = random.Random(seed)
    scene = box_scenes.drawn(seed, (3, 4, 6, 8), axes)
    kinds = ["wisp", *(rng.choice(("ball", "wisp")) for _ in range(len(scene) - 1))]
    rules = {(kind, "wisp"): kt.Response("pass") for kind in sorted({*kinds})}
    until = kt.Settings(until=scene.start + 8.0)
    scene = scene.replace(kind=kinds, responses=rules, settings=until)
    if rng.random() < 0.7:  # two overlap from the beginning, by much or by a hair
        place = scene.position.copy()
        aside = rng.choice((0.0, 0.125, 0.5))
        place[0] = place[1] + np.where(place[1] > 2.0, -aside, aside) - scene.periods
        scene = scene.replace(position=place.tolist())
    rows, _, fingerprint = second_list(game_tables(scene, tmp_path), tmp_path, 150)
    assert any(a > b >= 0 for _, _, a, b in rows)
    lines = np.array(rows, [("epoch", "i8"), ("tick", "i8"), ("a", "i4"), ("b", "i4")])
    assert certify_log(scene, lines, fingerprint=fingerprint).right
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase)
        sim.run(max_contacts=len(rows))
        assert sim.contacts[["epoch", "tick", "a", "b"]].tolist() == rows
        assert sim.fingerprint == fingerprint


@pytest.mark.small
def test_passings_that_end_together_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    """Three come at one place, the one in the middle first, and the two others leave it at one tick."""
    comings = [(3.0, (1.0, 0.0)), (1.0, (0.0, 0.0)), (2.5, (-0.5, 0.0))]
    scene = kt.Scene(
        [(0.5, 0.5)],
        [(0.0, 0.0)],
        0.25,
        responses="pass",
        commands=[kt.Insert(time, (2.0, 2.0), velocity, 0.25) for time, velocity in comings],
        settings=kt.Settings(until=3.5),
    )
    assert [row[2:] for row in games.play(scene).contacts[-2:]] == [(2, 1), (3, 2)]
    assert second_agrees(scene, tmp_path)


@pytest.mark.small
def test_who_comes_without_a_kind_is_of_the_first_that_the_scene_lists(tmp_path: Path) -> None:
    scene = kt.Scene(
        [(0.5, 0.5), (3.5, 3.5)],
        [(0.0, 0.0), (0.0, 0.0)],
        0.25,
        arena=(4.0, 4.0),
        kind=["wisp", "ball"],
        kinds=["ball", "wisp"],
        responses={("ball", "ball"): "pass"},
        commands=[kt.Insert(1.0, (2.0, 2.0), (1.0, 1.0), 0.25)],
        settings=kt.Settings(until=6.0),
    )
    tables = game_tables(scene, tmp_path)
    del tables["commands"][0]["insert"]["kind"], tables["commands"][0]["insert"]["body"]
    assert second_list(tables, tmp_path)[0] == games.play(scene).contacts


@pytest.mark.small
@pytest.mark.parametrize(
    ("comers", "rules"),
    first(
        4,
        [
            ([None, "ball", "wisp", None], ["ball", "wisp"]),
            ([None, None], ["ball", 10, 9]),
            ([None, None], ["\U00010000", "\uffff"]),
            ([None, None], []),
            ([None, None], [0, "ball"]),
            ([None, "wisp", "ball", None], ["ball", "wisp"]),
            ([None, None], ["wisp", "ball"]),
            ([None, None], ["balls", "ball"]),
        ],
    ),
)
def test_who_comes_without_a_kind_where_nobody_was_is_of_one_kind_in_both(
    comers: list[str | None], rules: list[str | int], tmp_path: Path
) -> None:
    """Of that of body 0, the rule said, and there was none. Those of that one kind stop; times are not in the
    order of writing."""
    lowest = min(rules, key=lambda kind: (1, kind) if isinstance(kind, str) else (0, kind), default=0)
    wanted = next((kind for kind in comers if kind), lowest)
    commands = [
        kt.Insert(float(time), (1.0 + 2.0 * place, 1.0), (0.5 - place, 0.0), 0.25, kind=kind)
        for place, (time, kind) in enumerate(zip([3, 1, 0, 2], comers, strict=False))
    ]
    scene = kt.Scene(
        np.zeros((0, 2)),
        np.zeros((0, 2)),
        np.zeros(0),
        arena=(8.0, 2.0),
        responses={(kind, kind): "stop" if kind == wanted else "elastic" for kind in rules},
        commands=commands,
        settings=kt.Settings(until=12.0),
    )
    assert {each.kind or 0 for each in scene.commands} - set(comers) <= {wanted}
    tables = game_tables(scene, tmp_path)
    tables["commands"] = sorted(tables["commands"], key=lambda each: each["insert"]["position"])
    for table, kind in zip(tables["commands"], comers, strict=True):
        del table["insert"]["body"]
        if kind is None:
            table["insert"].pop("kind", None)
    tables.pop("kinds", None)
    found = second_list(tables, tmp_path)[0]
    assert found == games.play(scene).contacts
    assert found


@pytest.mark.parametrize(
    ("gravity", "place", "more", "rows"),
    [
        # from half a unit above the floor: it falls for one unit of time, and is back after two
        ([0.0, -1.0], [0.5, 0.75], {}, [(tick, 0, 0, -3) for tick in (1, 3, 5, 7)]),
        # along the other axis, upwards, and the ceiling is the floor
        ([1.0, 0.0], [1.25, 1.5], {}, [(tick, 0, 0, -2) for tick in (1, 3, 5, 7)]),
        ([0.0, 1.0], [0.5, 1.25], {}, [(tick, 0, 0, -4) for tick in (1, 3, 5, 7)]),
        # two walls at once, in a corner
        ([-1.0, -1.0], [0.75, 0.75], {}, [(1, 0, 0, -1), (1, 0, 0, -3), (3, 0, 0, -1), (3, 0, 0, -3)]),
        # a flight half as long after each bounce, until none is longer than the contact time
        (
            [0.0, -1.0],
            [0.5, 0.75],
            {"responses": [HALF_BACK]},
            [(int(time), int(time % 1 * 2**52), 0, -3) for time in (1, 2, 2.5, 2.75, 2.875, 3, 3.125)],
        ),
        # at rest again, half way down, at 3/8 above the floor
        (
            [0.0, -1.0],
            [0.5, 0.75],
            {"commands": [{"time": 0.5, "turn": 0, "velocity": [0.0, 0.0]}]},
            [(1, int((math.sqrt(0.75) - 0.5) * 2**52), 0, -3)],
        ),
    ],
)
def test_a_body_falls(
    gravity: list[float], place: list[float], more: Tables, rows: list[tuple[int, ...]], tmp_path: Path
) -> None:
    """The answers are worked out by hand; the unit is 1."""
    tables = {"arena": [2.0, 2.0], "gravity": gravity, "bodies": [{"position": place, "radius": 0.25}]}
    found = second_list({**tables, "unit": 1.0, "until": 8.0, **more}, tmp_path, len(rows))[0]
    assert found == rows


def mistake(text: str) -> str:
    """Returns the whole answer to a scene of this text, between two arrows."""
    Path("scene.json").write_text(text)
    done = node("run.js", str(Path("scene.json").absolute()))
    assert (done.returncode, done.stdout) == (1, "")
    return f"=> {done.stderr.strip()} <="


test_message = messages.table(globals())
