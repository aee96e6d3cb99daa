"""What works with what: the two tables from which ``test_matrix.py`` makes its tests.

The first crosses capabilities (``capabilities``) with all uses of a run (``observations``), the second each
two capabilities in one scene. A cell works, unless it is listed here: as refused, with words of the sentence,
or as meaningless, with the reason. There is no fourth case.

``python tests/matrix.py`` prints docs/what-works-with-what.md.
"""

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping

from capabilities import BY_NAME
from observations import COLUMNS

Cell = tuple[str, str]


def _of(column: str, rows: Mapping[str, str]) -> dict[Cell, str]:
    return {(row, column): said for names, said in rows.items() for row in names.split(" | ")}


REFUSED: dict[Cell, str] = {
    **_of("under sap-k", {"periodic x | periodic y | periodic xy": "make no circle on such a line"}),
    **_of(
        "under sweep-tiling",
        {
            "pass | one way": "is right only while bodies cannot pass through each other",
            "periodic y | periodic xy": "tiles an arena from its floor to its ceiling",
            "shapes | obstacles | lifts": "this scene has other shapes",
        },
    ),
    **_of(
        "under power",
        {
            "pass | one way": "is right only while bodies cannot pass through each other",
            "periodic x | periodic y | periodic xy": "far points outside of it, and this scene is periodic",
            "shapes | obstacles | lifts": "is for discs, and this scene has other shapes",
            "no arena": "between far points outside of it, and this scene has no arena",
        },
    ),
    **_of(
        "player, computed",
        {
            "restitution | grip | stop | pass | one way | foreign response": "contacts are not all elastic",
            "commands, planned | commands, by hand | kinds that change | moves": "the scene has commands",
            "periodic x | periodic y | periodic xy": "an axis is periodic",
            "no arena": "the scene has no walls",
            "gravity | rest | lifts": "bodies are accelerated",
            "shapes | obstacles": "the bodies are not all discs",
        },
    ),
    ("foreign response", "certify-log"): "the specification has elastic, pass, restitution, stop",
    ("foreign response", "second implementation"): "not elastic, restitution, stop, pass",
    ("foreign narrow phase", "second implementation"): "in the specification bodies meet each other",
}
"""Cells of the first table that are refused."""

MEANINGLESS: dict[Cell, str] = {}
"""Cells of the first table that mean nothing."""

REFUSED_TOGETHER: dict[Cell, str] = {
    **_of(
        "no arena", {"periodic x | periodic y | periodic xy": "expected an arena: its sides are the periods"}
    ),
    **{
        (axes, each): "none along y, which is periodic: nothing stops a fall there"
        for axes in ("periodic y", "periodic xy")
        for each in ("gravity", "rest", "lifts")
    },
    ("rest", "no arena"): "bodies settle by accelerations in an arena; the scene has no arena",
    ("lifts", "no arena"): "bodies settle by accelerations in an arena; the scene has no arena",
}
"""Pairs of capabilities that are refused."""

MEANINGLESS_TOGETHER: dict[Cell, str] = dict.fromkeys(
    itertools.combinations(("periodic x", "periodic y", "periodic xy"), 2),
    "one scene has its periodic axes once",
)
"""Pairs of capabilities that mean nothing."""

CELLS: tuple[Cell, ...] = tuple(itertools.product(BY_NAME, COLUMNS))
PAIRS: tuple[Cell, ...] = tuple(itertools.combinations([name for name in BY_NAME if name != "discs"], 2))

HEAD = """# What works with what

Each capability of a scene works with everything that is done with a run, and with each other capability in
one scene, except where a grid says ✗, with the number of the reason. Each cell is a test
(`tests/test_matrix.py`); `python tests/matrix.py` prints this page."""
TOGETHER = (
    "Such a scene has the same contacts under every broad phase that takes it, by the certifier, in a run "
    "that was saved and resumed under another phase, and when its recorded commands are played again."
)


def counts(cells: Iterable[Cell], refused: Mapping[Cell, str], meaningless: Mapping[Cell, str]) -> str:
    """Returns a text with the numbers of cells that work, are refused, and mean nothing."""
    found = Counter(
        "refused" if cell in refused else "meaningless" if cell in meaningless else "works" for cell in cells
    )
    return f"{found['works']} work, {found['refused']} are refused, {found['meaningless']} mean nothing"


def grid(refused: Mapping[Cell, str], meaningless: Mapping[Cell, str]) -> list[str]:
    """Returns a grid with a row for each capability and a column for each partner with which one of them does
    not work, and the reasons, numbered."""
    said = {cell: f"... {text} ..." for cell, text in refused.items()}
    said |= {cell: f"means nothing: {text}" for cell, text in meaningless.items()}
    number = {text: place for place, text in enumerate(dict.fromkeys(said.values()), 1)}
    columns = [*dict.fromkeys(column for _, column in said)]
    marks = {cell: f"✗<sup>{number[text]}</sup>" for cell, text in said.items()}
    return [
        f"|with|{'|'.join(columns)}|",
        f"|---|{'|'.join(':-:' for _ in columns)}|",
        *(
            f"|{row}|{'|'.join(' ' if row == each else marks.get((row, each), '✓') for each in columns)}|"
            for row in BY_NAME
            if row != "discs"
        ),
        "",
        *(f"{place}. {text}" for text, place in number.items()),
    ]


def both(pairs: Mapping[Cell, str]) -> dict[Cell, str]:
    """Returns pairs of capabilities in both orders."""
    return {cell: text for (one, other), text in pairs.items() for cell in ((one, other), (other, one))}


def page() -> str:
    """Returns the page of both tables, in Markdown."""
    without = [each for each in COLUMNS if each not in {column for _, column in REFUSED}]
    return "\n".join(
        [
            HEAD,
            "",
            "## A capability and what is done with a run",
            "",
            f"Every capability works with these: {'; '.join(without)}. Discs work with all; the others:",
            "",
            *grid(REFUSED, MEANINGLESS),
            "",
            f"{len(CELLS)} cells: {counts(CELLS, REFUSED, MEANINGLESS)}.",
            "",
            "## Two capabilities in one scene",
            "",
            TOGETHER,
            "",
            *grid(both(REFUSED_TOGETHER), both(MEANINGLESS_TOGETHER)),
            "",
            f"{len(PAIRS)} pairs: {counts(PAIRS, REFUSED_TOGETHER, MEANINGLESS_TOGETHER)}.",
            "",
        ]
    )


if __name__ == "__main__":
    print(page(), end="")
