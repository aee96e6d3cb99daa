"""The pictures of the documents are what the commands beside them draw, byte by byte."""

import re
import shlex
import struct
from functools import cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest

from installing import install, run

ROOT = Path(__file__).parents[1]
FOLDERS = ("figures", "thesis")
SVG = "{http://www.w3.org/2000/svg}"
PHOTOGRAPHS = ROOT / "docs" / "figures"
MOST = 30_000
"""Bytes of a picture of one moment."""

MOVING = {"moving": 90_000, "bullet": 12_000}
"""Pictures that move, by their scripts, with the most bytes of each."""

PREVIEW = ROOT / "docs" / "_static" / "preview.png"
"""The picture that other programs show beside a link to the site."""


def commands(folder: str) -> list[list[str]]:
    script = (ROOT / "docs" / folder / "draw.sh").read_text(encoding="utf-8")
    return [shlex.split(line)[1:] for line in script.splitlines() if line.startswith("kinetile ")]


def name_of(command: list[str]) -> str:
    return command[command.index("--out") + 1]


def diagrams() -> list[str]:
    script = (PHOTOGRAPHS / "diagrams.py").read_text(encoding="utf-8")
    return re.findall(r'^    "([\w-]+\.svg)": \w+,$', script, re.MULTILINE)


PICTURES = [
    pytest.param(folder, name_of(command), marks=[pytest.mark.slow] if folder == "thesis" else [])
    for folder in FOLDERS
    for command in commands(folder)
]


@cache
def drawn(folder: str, here: Path) -> Path:
    """Returns a folder in which a script has drawn: all in one process, interpreted."""
    examples = ("docs/examples/kinetile-thesis", "tests/foreign/kinetile-stripes")
    paths = [path for each in examples for path in install(ROOT / each, here / "site")]
    place = here / folder
    place.mkdir()
    for scene in (ROOT / "docs" / folder).glob("*.toml"):
        (place / scene.name).write_bytes(scene.read_bytes())
    script = ROOT / "docs" / folder / "draw.sh"
    paths = [*paths, str(ROOT / "tests")]
    done = run("commands", script, folder=place, paths=paths, module="thesis_runs")
    assert done.returncode == 0, done.stderr
    return place


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return tmp_path_factory.mktemp("drawn")


@pytest.mark.parametrize(("folder", "name"), PICTURES)
def test_a_picture_is_what_its_command_draws(folder, name, here):
    committed = (ROOT / "docs" / folder / name).read_bytes()
    found = (drawn(folder, here) / name).read_bytes()
    assert found == committed, f"{name} is not what its command draws: cd docs/{folder}; sh draw.sh"
    assert len(committed) < MOST


def test_diagrams_are_what_their_script_draws(tmp_path):
    done = run(tmp_path, folder=tmp_path, paths=[str(PHOTOGRAPHS)], module="diagrams")
    assert done.returncode == 0, done.stderr
    drawn = {path.name: path.read_bytes() for path in tmp_path.glob("*.svg")}
    assert drawn == {name: (PHOTOGRAPHS / name).read_bytes() for name in diagrams()}
    assert max(map(len, drawn.values())) < MOST


def test_names_of_curves_stand_at_their_curves_in_their_colours_and_apart():
    # The name of sap-1d stood beside the curve of naive.
    root = ElementTree.fromstring((PHOTOGRAPHS / "densities.svg").read_text(encoding="utf-8"))
    found = {}
    for series in root.iter(f"{SVG}g"):
        curve, name = series.find(f"{SVG}polyline"), series.find(f"{SVG}text")
        assert series.get("class") == f"series {name.text}"
        end = float(curve.get("points").split(",")[-1])
        found[name.text] = end, float(name.get("y")) - 5.0, curve.get("stroke-dasharray")
    places = sorted(found.values())
    assert len(found) == len({dashes for *_, dashes in places}) == 7
    assert all(abs(end - at) < 18.0 for end, at, _ in places)
    assert all(after - before >= 17.9 for (_, before, _), (_, after, _) in pairwise(places))


def test_pictures_before_and_after_share_a_scale():
    befores = sorted((ROOT / "docs" / "thesis").glob("*-before.svg"))
    for before in befores:
        pair = before, before.with_name(before.name.replace("before", "after"))
        scale = re.compile(r'viewBox="[^"]+"|h[\d.]+".*speed .*<')
        one, other = (scale.findall(path.read_text("utf-8")) for path in pair)
        assert one == other, before.name
    assert len(befores) == 11


@pytest.mark.parametrize("name", MOVING)
def test_a_moving_picture_is_what_its_script_writes(name, tmp_path):
    done = run(tmp_path / "again.svg", folder=tmp_path, paths=[str(PHOTOGRAPHS)], module=name)
    assert done.returncode == 0, done.stderr
    committed = (PHOTOGRAPHS / f"{name}.svg").read_bytes()
    assert (tmp_path / "again.svg").read_bytes() == committed, f"in docs/figures: python {name}.py {name}.svg"
    assert len(committed) < MOVING[name]


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_picture_has_its_command(folder):
    there = [path.name for path in (ROOT / "docs" / folder).glob("*.svg") if path.stem not in MOVING]
    made = [*map(name_of, commands(folder)), *(diagrams() if folder == "figures" else ())]
    assert sorted(made) == sorted(there)


def test_photographs_of_the_player_are_small_and_have_their_script():
    said = {*re.findall(r'"(player[\w-]*\.png)"', (PHOTOGRAPHS / "photograph.py").read_text("utf-8"))}
    assert {path.name for path in PHOTOGRAPHS.glob("player*.png")} == said
    assert {path.name for path in PHOTOGRAPHS.glob("*.png") if path.stat().st_size > 200_000} == set()


def test_the_preview_has_the_size_that_programs_expect_and_is_small():
    picture = PREVIEW.read_bytes()
    assert struct.unpack(">II", picture[16:24]) == (1200, 630)
    assert len(picture) < 150_000
