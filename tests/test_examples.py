"""Programs of docs/examples: they play to the end, and their own comparisons hold."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def play(words: str, capsys) -> str:
    main = runpy.run_path(str(ROOT / "docs/examples/game.py"))["main"]
    assert main(words.split()) == 0
    return str(capsys.readouterr().out)


@pytest.mark.small
def test_a_game_of_few_bodies_is_rewound_and_played_again(capsys):
    said = play("--frames 26 --bodies 20 --phases cells", capsys)
    assert "one fingerprint" in said
    for counted in ("bullets", "frames: 26"):
        assert counted in said


@pytest.mark.slow
def test_the_game_is_one_under_two_phases(capsys):
    said = play("", capsys)
    assert "one fingerprint" in said
    for counted in ("bullets", "coins", "pieces", "frames: 600", "in the polygon", "seconds in sensors"):
        assert counted in said


GRAVITY = runpy.run_path(str(ROOT / "docs/cookbook/gravity.py"))["SYSTEMS"]
EXACT = ("traffic", "robots", "pinball")


@pytest.mark.small
@pytest.mark.parametrize("system", EXACT)
def test_scenes_with_accelerations_obey_exact_laws(system):
    GRAVITY[system]()


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("system", sorted({*GRAVITY} - {*EXACT}))
def test_scenes_with_accelerations_obey_statistical_laws(system):
    GRAVITY[system]()


MATTER = runpy.run_path(str(ROOT / "docs/cookbook/matter.py"))["SYSTEMS"]


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("system", MATTER)
def test_matter_is_as_published(system):
    MATTER[system]()
