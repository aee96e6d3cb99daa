"""Every capability with all that is done with a run, and with every other one: each cell of ``matrix`` works,
is refused by the sentence that stands there, or means nothing."""

import re
from pathlib import Path

import pytest

import lanes
import matrix
from capabilities import BY_NAME, FOREIGN, Game
from kinetile.errors import KinetileError
from observations import COLUMNS, together, truth
from registering import fixture

pytestmark = pytest.mark.small

DOCS = Path(__file__).parents[1] / "docs"


_with_plugins = fixture(*FOREIGN, scope="module")


NUMBER = {name: number for number, name in enumerate([*BY_NAME, *COLUMNS])}
ONE_IN = 16
"""Of how many cells of a row, or of a column, one is in the default lane: the others are slow."""


def _cells(cells, meaningless):
    """Returns the cells that are tested, as parameters; a column may need a program."""
    chosen, others = [], []
    for one, other in cells:
        if (one, other) not in meaningless:
            needs = COLUMNS[other].needs if other in COLUMNS else ""
            marks = [pytest.mark.needs(needs)] if needs else []
            of_default = (NUMBER[one] + NUMBER[other]) % ONE_IN == 0
            cell = pytest.param(one, other, id=f"{one} with {other}", marks=marks)
            (chosen if of_default else others).append(cell)
    return lanes.first(len(chosen), chosen + others, many=len(others))


def _holds(refused, cell, observe) -> None:
    """Asserts that a cell works, or is refused by its sentence."""
    if cell not in refused:
        observe()
        return
    with pytest.raises((KinetileError, ValueError), match=re.escape(refused[cell])):
        observe()


@pytest.mark.parametrize(("row", "column"), _cells(matrix.CELLS, matrix.MEANINGLESS))
def test_a_capability_with_what_is_done_with_a_run(row, column, tmp_path):
    _holds(matrix.REFUSED, (row, column), lambda: COLUMNS[column].observe(Game(row), tmp_path))


@pytest.mark.parametrize(("one", "other"), _cells(matrix.PAIRS, matrix.MEANINGLESS_TOGETHER))
def test_a_capability_with_another_one(one, other, tmp_path):
    _holds(matrix.REFUSED_TOGETHER, (one, other), lambda: together(Game(one, other), tmp_path))


@pytest.mark.parametrize("name", BY_NAME)
def test_a_capability_comes_into_play(name):
    game = Game(name)
    assert BY_NAME[name].seen(game, truth(game.names))


def test_listed_cells_are_cells():
    listed = {*matrix.REFUSED, *matrix.MEANINGLESS}, {*matrix.REFUSED_TOGETHER, *matrix.MEANINGLESS_TOGETHER}
    assert listed[0] <= {*matrix.CELLS}
    assert listed[1] <= {*matrix.PAIRS}


def test_the_page_is_the_table():
    assert (DOCS / "what-works-with-what.md").read_text(encoding="utf-8") == matrix.page()


WITH = {"shapes": "pass", "gravity": "no arena"}
BOTH = [
    cell
    for cell in matrix.CELLS
    if cell[0] in WITH and not {cell, (WITH[cell[0]], cell[1])} & {*matrix.REFUSED}
]


@pytest.mark.parametrize(("row", "column"), _cells(BOTH, matrix.MEANINGLESS))
def test_two_capabilities_with_what_is_done_with_a_run(row, column, tmp_path):
    """Two that meet in more than contacts: a passing of shapes has an exact end of its own, and without walls
    accelerated bodies become ever faster."""
    game = Game(row, WITH[row])
    assert BY_NAME[WITH[row]].seen(game, truth(game.names))
    COLUMNS[column].observe(game, tmp_path)
