"""The vectors have the certifier's answers to their questions."""

import pytest

from vectors.make import HERE, KEPT, made, names

LARGE = (
    "rules/rest.json",
    "runs/falling.json",
    "runs/gases.json",
    "runs/lattices.json",
    "runs/turns.json",
    "shapes.json",
)
NAMES = [pytest.param(name, marks=pytest.mark.slow) if name in LARGE else name for name in names()]


@pytest.mark.parametrize("name", NAMES)
def test_a_file_has_the_answers_of_the_rules(name: str) -> None:
    text = (HERE / name).read_text(encoding="ascii")
    assert made(name, text) == text


@pytest.mark.parametrize(
    ("name", "there", "wrong"),
    [
        ("rules/ends.json", '"count": 2', '"count": 3'),
        ("walls.json", ",null]", ',["7",-1]]'),
        ("discs.txt", " - ", " 7 "),
    ],
)
def test_an_answer_that_is_written_there_is_not_read(name: str, there: str, wrong: str) -> None:
    text = (HERE / name).read_text(encoding="ascii")
    assert made(name, text.replace(there, wrong)) == text != text.replace(there, wrong)


def test_all_files_are_made_but_two() -> None:
    assert {path.name for path in HERE.glob("*.json")} - set(names()) == set(KEPT)
