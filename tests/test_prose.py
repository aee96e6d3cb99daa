"""Habits of language that make prose hard to read, counted in comments, docstrings and messages.

The finder knows only the habits that a pattern shows; people judge the lines that it names. If a count is
above its ceiling, print the lines by ``python tests/test_prose.py`` and rewrite them (CONTRIBUTING.md).
"""

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

HABITS = {
    "has none": r"\b(?:is|are|was|were|has|have|had|with|of|there be) none\b",
    "those of": r"\b(?:those|that) of\b",
    "Of ..., at the start": r"(?:\A|[.:;]\s+)Of\b",
    "of which": r"\b(?:of|by) (?:which|whom|whose|what)\b",
    "in which": r"\b(?:from|to|in|for|at|on|with|after|before) (?:which|whom|whose)\b",
    "anew, aside": r"\b(?:anew|aside|apart|thereby|amiss|thereof|therein|thereafter)\b",
    "Returns what": r"\b(?:Returns?|Yields?|Tells|Says|Finds) (?:what|how|whether|where|when|who|which)\b",
}

CEILINGS = {
    "core plugins": dict(zip(HABITS, (10, 15, 5, 10, 95, 33, 2), strict=True)),
    "tests": dict(zip(HABITS, (13, 14, 7, 13, 20, 48, 4), strict=True)),
}


def prose_of(path: Path) -> Iterator[tuple[int, str]]:
    """Yields the comments, docstrings and messages of a file, each with its line."""
    source = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        for found in re.finditer(r"/\*.*?\*/|//[^\n]*", source, re.DOTALL):
            yield source.count("\n", 0, found.start()) + 1, found.group()
        return
    block: list[tuple[int, str]] = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            block.append((token.start[0], token.string.lstrip("# ")))
        elif token.type == tokenize.STRING:
            yield token.start[0], token.string.lstrip("rfbRFB").strip("\"'")
        elif block and token.type not in (tokenize.NL, tokenize.NEWLINE):
            yield block[0][0], " ".join(text for _, text in block)
            block = []


def habits_in(folders: str) -> dict[str, list[str]]:
    """Returns the places of each habit below some folders, FILE:LINE: text."""
    found: dict[str, list[str]] = {habit: [] for habit in HABITS}
    files = [each for folder in folders.split() for each in sorted((ROOT / folder).rglob("*.*"))]
    for path in (each for each in files if each.suffix in (".py", ".mjs", ".js")):
        for line, text in prose_of(path):
            for habit, pattern in HABITS.items():
                for match in re.finditer(pattern, text):
                    at = line + text.count("\n", 0, match.start())
                    around = " ".join(text[max(match.start() - 40, 0) : match.end() + 40].split())
                    found[habit].append(f"{path.relative_to(ROOT)}:{at}: {around}")
    return found


@pytest.mark.parametrize("folders", CEILINGS)
def test_habits_of_language_stay_below_their_ceilings(folders):
    counts = {habit: len(places) for habit, places in habits_in(folders).items()}
    above = {habit: count for habit, count in counts.items() if count > CEILINGS[folders][habit]}
    assert not above, f"{above}: rewrite the lines that `python tests/test_prose.py` names"


if __name__ == "__main__":
    for each in CEILINGS:
        for habit, places in habits_in(each).items():
            print(f"{habit}: {len(places)} in {each}", *places, sep="\n  ")
