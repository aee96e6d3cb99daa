"""Scenes as files: every bit comes back, and every mistake is sentence at once."""

from __future__ import annotations

import errno
import os
import stat
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinetile import Scene, Settings, Turn, load_scene, make_scene, save_scene
from kinetile.errors import BadOption, SceneError
from kinetile.scene import reader
from kinetile.scene.files import dumps_scene, loads_scene

EIGHT_MISTAKES = """
arena = [1.0, 1.0]
broad-phase = "sap1d"

[[bodies]]
position = [0.2, nan]
radius = 0.1

[[bodies]]
position = [0.2, 0.2]
radius = -0.1

[[bodies]]
position = [0.5, 0.5]
radius = 0.1
mass = 0

[[bodies]]
position = [0.95, 0.1]
radius = 0.1

[[bodies]]
position = [0.45, 0.5]
radius = 0.1

[[bodies]]
position = [0.1, 0.8]
raduis = 0.1
velocity = [1.0, 0.0]

[[bodies]]
position = [0.8, 0.8]
velocity = "fast"
radius = 0.1
"""


def mistakes_in(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads_scene(text, "scene.toml")
    assert caught.value.source == "scene.toml"
    return [str(mistake) for mistake in caught.value.mistakes]


def test_a_full_file_is_read() -> None:
    scene = loads_scene(
        """
        arena = [2, 1.5]
        start = 1
        until = 3.5
        broad-phase = "sap-1d"
        narrow-phases = ["disc", "wall"]
        [options.sap-1d]
        axis = "y"
        [[bodies]]
        position = [0.25, 0.5]
        velocity = [1.0, 0.0]
        radius = 0.125
        mass = 2
        [[bodies.turns]]
        time = 2
        velocity = [0.0, -1]
        [[bodies]]
        position = [1, 1]
        radius = 0.25
        """
    )
    assert scene == Scene(
        position=[[0.25, 0.5], [1.0, 1.0]],
        velocity=[[1.0, 0.0], [0.0, 0.0]],
        radius=[0.125, 0.25],
        mass=[2.0, 1.0],
        arena=(2.0, 1.5),
        turns=[Turn(0, 2.0, (0.0, -1.0))],
        start=1.0,
        settings=Settings("sap-1d", ("disc", "wall"), {"sap-1d": {"axis": "y"}}, 3.5),
    )


def test_eight_mistakes_give_eight_messages() -> None:
    assert sorted(mistakes_in(EIGHT_MISTAKES)) == [
        "bodies[0].position: found [0.2, nan]; expected [x, y], two finite numbers",
        "bodies[1].radius: found -0.1; expected a finite number greater than 0",
        "bodies[2] and bodies[4]: found an overlap of 0.15 (distance 0.05, sum of the radii 0.2); "
        "expected discs that touch at most",
        "bodies[2].mass: found 0.0; expected a number greater than 0, or inf",
        "bodies[3].position: found [0.95, 0.1] with radius 0.1, which reaches 0.05 beyond the right wall; "
        "expected the whole disc inside the arena, [0, 1.0] x [0, 1.0]",
        "bodies[5].raduis: found a key that is not known here; "
        "expected one of position, velocity, radius, mass, kind, shape, turns; did you mean 'radius'?",
        "bodies[6].velocity: found 'fast'; expected [vx, vy], two finite numbers",
        "broad-phase: found 'sap1d', which is the name of no broad phase; "
        "expected one of naive, cells, sap-1d, sap-2d, sap-k, sweep-tiling, power; did you mean 'sap-1d'?",
    ]


BODY = "[[bodies]]\nposition = [0.5, 0.5]\nradius = 0.1\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "bodies: found nothing; expected [[bodies]] tables, or a recipe by name"),
        ("[[body]]", "body: found a key that is not known here; expected one of arena"),
        ("bodies = 3", "bodies: found 3; expected [[bodies]] tables"),
        ("bodies = [3]", "bodies[0]: found 3; expected a table"),
        ("[[bodies]]\nradius = 1.0", "bodies[0].position: found nothing; expected [x, y], two finite"),
        ("[[bodies]]\nposition = [0, 0]", "bodies[0].radius: found nothing; expected a finite number"),
        ("[[bodies]]\nposition = [0]\nradius = 1", "bodies[0].position: found [0]; expected [x, y], two"),
        ("[[bodies]]\nposition = [0, 0]\nradius = true", "bodies[0].radius: found True; expected a finite"),
        ("[[bodies]]\nposition = [0, 0]\nradius = '1'", "bodies[0].radius: found '1'; expected a finite"),
        ("[[bodies]]\nposition = [0, 0]\nradius = 1" + "0" * 400, "bodies[0].radius: found 1"),
        (f"arena = [1, true]\n{BODY}", "arena: found [1, True]; expected [width, height], two finite"),
        (f"arena = [1, 0]\n{BODY}", "arena: found [1, 0]; expected [width, height], two finite numbers"),
        (f"arena = [1, 1, 1]\n{BODY}", "arena: found [1, 1, 1]; expected [width, height], two finite"),
        (f"start = inf\n{BODY}", "start: found inf; expected a finite number"),
        (f"start = 2\nuntil = 1\n{BODY}", "until: found 1; expected a time not before the start, 2"),
        (f"until = 2024-01-01\n{BODY}", "until: found datetime.date(2024, 1, 1); expected a finite number"),
        (f"broad_phase = 'naive'\n{BODY}", "did you mean 'broad-phase'?"),
        (f"broad-phase = 1\n{BODY}", "broad-phase: found 1; expected the name of a broad phase"),
        (f"narrow-phases = ['disc', 'wal']\n{BODY}", "narrow-phases[1]: found 'wal', which is the name of"),
        (f"narrow-phases = ['disc', 1]\n{BODY}", "narrow-phases: found ['disc', 1]; expected a list of"),
        (f"[options.sap-3d]\naxis = 'y'\n{BODY}", "options.sap-3d: found 'sap-3d', which is the name of no"),
        (f"options.sap-1d = 3\n{BODY}", "options.sap-1d: found 3; expected a table"),
        (f"{BODY}[[bodies.turns]]\ntime = -1\nvelocity = [0, 0]", "bodies[0].turns[0].time: found -1"),
        (f"{BODY}[[bodies.turns]]\ntime = 1", "bodies[0].turns[0].velocity: found nothing; expected [vx,"),
        (f"{BODY}turns = 3", "bodies[0].turns: found 3; expected [[bodies.turns]] tables"),
        (f"{BODY}turns = [3]", "bodies[0].turns[0]: found 3; expected a table"),
        (f"parameters.bodies = 3\n{BODY}", "parameters: found parameters without a recipe; expected a"),
        ("recipe = 'grit'", "recipe: found 'grit', which is the name of no scene; expected one of grid,"),
        ("recipe = 'grid'\narena = [1, 1]", "arena: found arena beside a recipe; expected one of the two"),
        ("recipe = 'grid'\nbodies = 100", "bodies: found bodies beside a recipe; expected it in the table"),
        ("recipe = 'grid'\ndensity = 0.5", "density: found density beside a recipe; expected it in the"),
        (
            f"{BODY}[[responses]]\nbetween = ['*', '*']\nresponse = 'restitution'\noptions = {{ E = 0.5 }}",
            "responses[0].options.E: found no option of this name; expected one of e, contact_time",
        ),
        (
            f"{BODY}[[responses]]\nbetween = ['*', 'wall']\nresponse = 'restitution'\noptions = {{ e = 7 }}",
            "responses[0].options: found {'e': 7}; expected what the response can use: restitution: e is 7",
        ),
        (
            "[[shapes]]\nkind = 'box'\nwidth = 1\nheight = 1\nsize = 1\n"
            "[[bodies]]\nposition = [0, 0]\nshape = 0",
            "shapes[0].size: found a key that is not known here; expected one of kind, radius",
        ),
        ("recipe = 'grid'\n[parameters]\nbodys = 4", "parameters.bodys: found no parameter of this name"),
        ("recipe = 'grid'\n[parameters]\nbodies = 4.5", "parameters.bodies: found 4.5; expected a whole"),
        ("recipe = 'grid'\n[parameters]\nbodies = 5", "where 5 discs would touch"),
        ("recipe = 'grid'\nuntil = -1", "until: found -1; expected a time not before the start, 0.0"),
        ("recipe = 3", "recipe: found 3; expected the name of a recipe"),
        ("arena = [1, 1]\nstart = = 2", "line 2, column 9: found 'start = = 2'; expected TOML (Invalid"),
        ("arena = ", "line 1: found 'arena = '; expected TOML (Invalid value)"),
        ("a = 1\na = 2", "found 'a = 2'; expected TOML (Cannot overwrite a value)"),
        ("a = " + "[" * 100_000, "tables or lists in each other, more than 32 deep"),
    ],
)
def test_each_mistake_says_where_what_and_what_would_be_right(text: str, sentence: str) -> None:
    found = mistakes_in(text)
    assert len(found) == 1
    assert sentence in found[0]


def test_what_is_wrong_in_one_body_does_not_hide_what_is_wrong_in_others() -> None:
    text = "".join(
        f"[[bodies]]\nposition = [{x}, 0.0]\nradius = {r}\n" for x, r in ((0, "'a'"), (5, 1), (6, 1))
    )
    assert [found.partition(":")[0] for found in mistakes_in(text)] == [
        "bodies[0].radius",
        "bodies[1] and bodies[2]",
    ]


def test_a_bad_time_of_a_turn_is_reported_beside_its_bad_velocity_and_the_other_way_round() -> None:
    turn = "[[bodies.turns]]\n"
    assert mistakes_in(f"{BODY}{turn}time = -1\nvelocity = 'x'\n{turn}time = 'x'\nvelocity = [nan, 0]") == [
        "bodies[0].turns[0].velocity: found 'x'; expected [vx, vy], two finite numbers",
        "bodies[0].turns[1].time: found 'x'; expected a finite number",
        "bodies[0].turns[0].time: found -1; expected a time not before the start, 0.0",
        "bodies[0].turns[1].velocity: found [nan, 0]; expected [vx, vy], two finite numbers",
    ]


def test_options_of_all_phases_are_checked_beside_the_bodies_and_not_the_chosen_ones_alone() -> None:
    text = """
        broad-phase = "naive"
        [options.sap-1d]
        axis = "z"
        [options.sap-2d]
        axis = "x"
        skin = 2
        [[bodies]]
        position = [0, 0]
        radius = -1
    """
    one, two, three, four = mistakes_in(text)
    assert one.startswith(
        "options.sap-1d: found {'axis': 'z'}; expected what the phase can use: sap-1d sorts"
    )
    assert two == "options.sap-2d.axis: found no option of this name; expected nothing here"
    assert three == "options.sap-2d.skin: found no option of this name; expected nothing here"
    assert four.startswith("bodies[0].radius")
    sentence = "options.sap-1d.axs: found no option of this name; expected axis; did you mean 'axis'?"
    assert mistakes_in(f"options.sap-1d.axs = 'y'\n{BODY}") == [sentence]


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + BODY.encode())
    assert load_scene(path) == loads_scene(BODY) == loads_scene("\ufeff" + BODY)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_saving_replaces_no_special_file(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        with pytest.raises(OSError, match="no regular file"):
            save_scene(make_scene("two-discs"), path)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert sorted(tmp_path.iterdir()) == [link, pipe]


def test_a_recipe_may_have_parameters_settings_and_an_end() -> None:
    scene = loads_scene(
        "recipe = 'grid'\nuntil = 2\nbroad-phase = 'naive'\n[parameters]\nbodies = 16\ndensity = 0.25"
    )
    made = make_scene("grid", bodies=16, density=0.25)
    assert np.array_equal(scene.position, made.position)
    assert np.array_equal(scene.velocity, made.velocity)
    assert scene.settings == Settings("naive", until=2.0)
    assert scene.origin == made.origin


@pytest.mark.parametrize("name", ["grid", "random", "lattice", "figure-11", "cradle", "break", "two-discs"])
def test_recipes_come_back_from_a_file(name: str, tmp_path: Path) -> None:
    scene = make_scene(name)
    save_scene(scene, tmp_path / "scene.toml")
    again = load_scene(tmp_path / "scene.toml")
    assert again == scene
    assert again.origin == {"file": str(tmp_path / "scene.toml")}


def test_an_option_that_toml_has_no_form_for_is_refused() -> None:
    scene = Scene([], [], [], settings=Settings(options={"naive": {"bad": None}}))
    with pytest.raises(BadOption, match=r"options\.naive\.bad is None; expected a number, text, a list or a"):
        dumps_scene(scene)


def test_a_failed_save_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "scene.toml"
    save_scene(make_scene("two-discs"), path)
    before = path.read_bytes()

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        save_scene(make_scene("grid"), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_saving_keeps_the_mode_and_follows_a_link(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    path, link = tmp_path / "deep" / "scene.toml", tmp_path / "link.toml"
    save_scene(make_scene("two-discs"), path)
    path.chmod(0o640)
    link.symlink_to(path)
    save_scene(make_scene("cradle"), link)
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640
    assert load_scene(path) == make_scene("cradle")


def test_files_that_are_not_there_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        load_scene(tmp_path / "missing.toml")
    (tmp_path / "latin.toml").write_bytes(b"arena = [1, 1]\n# caf\xe9\n")
    with pytest.raises(SceneError, match="line 2: found bytes that are not UTF-8"):
        load_scene(tmp_path / "latin.toml")


@pytest.mark.parametrize(
    ("text", "scenes"),
    [
        (BODY, 1),
        (f"{BODY}[[obstacles]]\npoints = [[0, 0], [0.1, 0]]", 1),
        (f"{BODY}kind = 'a'\n[[responses]]\nbetween = ['a', 'a']\nresponse = 'stop'", 1),
        ("recipe = 'grid'\nuntil = 1.0\nbroad-phase = 'naive'", 1),
        ("recipe = 'cradle'\n[[commands]]\ntime = 1\nturn = 0\nvelocity = [1, 0]", 2),  # the recipe's own too
    ],
)
def test_each_check_ran_twice_a_file_and_three_times_with_obstacles(text, scenes, monkeypatch) -> None:
    counts: Counter[str] = Counter()

    def counted(name: str, check: Any, *given: Any) -> Any:
        counts[name] += 1
        return check(*given)

    for name in ("check_bodies", "read_rules", "check_settings", "check_presence"):
        monkeypatch.setattr(reader, name, partial(counted, name, getattr(reader, name)))
    loads_scene(text)
    assert counts == dict.fromkeys(counts, scenes)
    assert len(counts) == 4


def test_mistakes_of_commands_and_responses_were_reported_after_those_of_bodies_and_at_other_places() -> None:
    command = "[[commands]]\ntime = 2\n"
    text = (
        f"unit = 0.3\n{BODY}mass = -1\n{command}\n"
        f"{command}insert = {{ position = [3, 3], radius = -1 }}\n"
        "[[responses]]\nbetween = ['*', 'wall']\nresponse = 'pass'\n"
        "[[responses]]\nbetween = [0, 'nobody']\nresponse = 'stop'\n"
        "[[obstacles]]\npoints = [[0, 0]]\n"
    )
    assert [found.partition(":")[0] for found in mistakes_in(text)] == [
        "obstacles[0].points",
        "commands[0]",
        "responses[0].between",
        "bodies[0].mass",
        "commands[1].radius",
        "unit",
    ]
    later = f"{command}remove = 0\n{command}turn = 0\nvelocity = [0, 0]\n"
    assert mistakes_in(f"{BODY}[[bodies.turns]]\ntime = 1\nvelocity = [0, 0]\n{later}") == [
        "commands[1].body: found 0, which has gone by then; expected the number of a body that is there"
    ]
    assert [found.partition(":")[0] for found in mistakes_in(f"recipe = 'cradle'\n{later}")] == [
        "commands[1].body"
    ]
