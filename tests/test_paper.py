"""The paper cites what is in its bibliography, and says the figures that the pages say."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
HEAD, _, TEXT = PAPER.removeprefix("---\n").partition("\n---\n")


def test_every_citation_has_an_entry_and_every_entry_is_cited():
    entries = re.findall(r"^@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8"), re.M)
    assert len(entries) == len(set(entries))
    assert set(re.findall(r"@(\w+)", TEXT)) == set(entries)


def test_its_pictures_and_its_authors_are_those_of_the_project():
    for target in re.findall(r"\]\(([^)]+)\)", TEXT):
        assert (ROOT / "paper" / target).exists()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert re.findall(r"^  - name: (The .*)$", HEAD, re.M) == [each["name"] for each in project["authors"]]


@pytest.mark.parametrize(
    ("page", "figure"),
    [
        ("docs/conformance.md", "finds 271 of 273"),
        ("README.md", "4.0 million contacts a CPU second"),
        ("README.md", "2.7e-14 of itself"),
        ("docs/sweep-tiling.md", "[Ss]ix (?:of its |)statements"),
    ],
)
def test_a_figure_of_the_paper_is_on_a_page(page, figure):
    for text in (TEXT, (ROOT / page).read_text(encoding="utf-8")):
        assert re.search(figure, text)
