"""Scenes as files: every bit comes back, and every mistake is sentence at once."""

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinetile import Scene, Settings, Turn, load_scene, make_scene, save_scene
from kinetile.scene import reader
from kinetile.scene.files import loads_scene


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


BODY = "[[bodies]]\nposition = [0.5, 0.5]\nradius = 0.1\n"


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + BODY.encode())
    assert load_scene(path) == loads_scene(BODY) == loads_scene("\ufeff" + BODY)


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
