"""What works with what: the two tables from which ``test_matrix.py`` makes its tests.

The first crosses capabilities (``capabilities``) with all that is done with a run (``observations``), the
second each two capabilities in one scene. A cell works, unless it is listed here: as refused, with words of
the sentence, or as meaningless, with the reason. There is no fourth.

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
            "pass": "is right only while bodies cannot pass through each other",
            "periodic y | periodic xy": "tiles an arena from its floor to its ceiling",
            "shapes | obstacles": "this scene has other shapes",
        },
    ),
    **_of(
        "under power",
        {
            "pass": "is right only while bodies cannot pass through each other",
            "periodic x | periodic y | periodic xy": "far points outside of it, and this scene is periodic",
            "shapes | obstacles": "is for discs, and this scene has other shapes",
            "no arena": "between far points outside of it, and this scene has no arena",
        },
    ),
    **_of(
        "player, computed",
        {
            "restitution | stop | pass | foreign response": "contacts are not all elastic",
            "commands, planned | commands, by hand": "the scene has commands",
            "periodic x | periodic y | periodic xy": "an axis is periodic",
            "no arena": "the scene has no walls",
            "gravity": "bodies are accelerated",
            "shapes | obstacles": "the bodies are not all discs",
        },
    ),
    ("gravity", "space-time"): "has straight bands, and along y bodies are accelerated",
    ("foreign response", "certify-log"): "the specification has elastic, pass, restitution, stop",
    ("foreign response", "second implementation"): "not elastic, restitution, stop, pass",
    ("foreign narrow phase", "second implementation"): "in the specification bodies meet each other",
}
"""Cells of the first table that are refused."""

MEANINGLESS: dict[Cell, str] = {}
"""Cells of the first table that mean nothing."""

REFUSED_TOGETHER: dict[Cell, str] = {
    **_of(
        "no arena",
        {"periodic x | periodic y | periodic xy": "expected an arena: its sides are the periods"},
    ),
    ("periodic y", "gravity"): "none along y, which is periodic: nothing stops a fall there",
    ("periodic xy", "gravity"): "none along y, which is periodic: nothing stops a fall there",
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

Everything works with everything, except what is listed here. Crossed are all capabilities of a scene with all
that is done with a run, and each two capabilities in one scene. Each crossing has a test, made from the same
tables (`python -m pytest tests/test_matrix.py`); `python tests/matrix.py` prints this page."""
TOGETHER = (
    "Such a scene has the same contacts under every broad phase that takes it, by the certifier, in a run "
    "that was saved and resumed under another phase, and when its recorded commands are played again."
)


def counts(cells: Iterable[Cell], refused: Mapping[Cell, str], meaningless: Mapping[Cell, str]) -> str:
    """Returns how many cells work, are refused, and mean nothing."""
    found = Counter(
        "refused" if cell in refused else "meaningless" if cell in meaningless else "works" for cell in cells
    )
    return f"{found['works']} work, {found['refused']} are refused, {found['meaningless']} mean nothing"


def exceptions(refused: Mapping[Cell, str], meaningless: Mapping[Cell, str]) -> list[str]:
    """Returns the table of cells that are refused or mean nothing, those of one sentence in a row."""
    rows: dict[tuple[str, str], list[str]] = {}
    for (row, column), said in refused.items():
        rows.setdefault((column, f"... {said} ..."), []).append(row)
    for (row, column), said in meaningless.items():
        rows.setdefault((column, f"means nothing: {said}"), []).append(row)
    return [
        "| with | does not work | because |",
        "|---|---|---|",
        *(f"| {column} | {'; '.join(names)} | {said} |" for (column, said), names in rows.items()),
    ]


def page() -> str:
    """Returns the page of both tables, in Markdown."""
    return "\n".join(
        [
            HEAD,
            "",
            "## A capability and what is done with a run",
            "",
            f"Capabilities: {'; '.join(BY_NAME)}.",
            "",
            f"What is done: {'; '.join(COLUMNS)}.",
            "",
            *exceptions(REFUSED, MEANINGLESS),
            "",
            f"{len(CELLS)} cells: {counts(CELLS, REFUSED, MEANINGLESS)}.",
            "",
            "## Two capabilities in one scene",
            "",
            TOGETHER,
            "",
            *exceptions(REFUSED_TOGETHER, MEANINGLESS_TOGETHER),
            "",
            f"{len(PAIRS)} pairs: {counts(PAIRS, REFUSED_TOGETHER, MEANINGLESS_TOGETHER)}.",
            "",
        ]
    )


if __name__ == "__main__":
    print(page(), end="")
