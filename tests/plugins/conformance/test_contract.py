"""The documents name the checks that there are, and every sentence of the contract says what enforces it."""

from __future__ import annotations

import re
from pathlib import Path

from kinetile_conformance import CHECKS
from kinetile_conformance.checks import OTHERWISE

DOCS = Path(__file__).parents[3] / "docs"
NAMES = [check.name for check in CHECKS]


def section(page: str, heading: str) -> str:
    """Return what stands under a heading of a page, up to the next."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.split(r"^## ", text.partition(f"\n## {heading}\n")[2], flags=re.MULTILINE)[0]


def rows(text: str) -> list[list[str]]:
    """Return the cells of a table, without its head."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_every_sentence_of_the_contract_says_what_enforces_it():
    numbers = re.findall(r"^(\d+)\. ", section("writing-a-broad-phase.md", "The contract"), re.MULTILINE)
    table = rows(section("writing-a-broad-phase.md", "What enforces it"))
    assert [row[0] for row in table] == numbers == [str(n) for n in range(1, len(numbers) + 1)]
    for number, enforced in table:
        assert "`" in enforced or enforced.startswith("none"), f"sentence {number}"


def test_the_table_names_every_observation_and_no_check_that_there_is_not():
    found = set(re.findall(r"`([^`]+)`", section("writing-a-broad-phase.md", "What enforces it")))
    assert {check.name for check in CHECKS if check.at_home} <= found <= {*NAMES, "boxes"}


def test_each_cell_of_the_table_has_scenes_or_a_reason():
    drawn = [check for check in CHECKS if check.strategy is not None]
    everywhere = {check.strategy.name for check in drawn}
    for observation in {check.observation for check in drawn}:
        on = {check.strategy.name for check in drawn if check.observation == observation}
        assert on == everywhere or observation in OTHERWISE or observation.name == "same-contacts"
    assert set(OTHERWISE) <= {check.observation for check in drawn}
