"""The documents name the checks that there are, and every sentence of the contract says what enforces it."""

import re
import tomllib
from pathlib import Path

import kinetile_conformance
from kinetile_conformance import CHECKS
from kinetile_conformance.checks import OTHERWISE

DOCS = Path(__file__).parents[3] / "docs"
NAMES = [check.name for check in CHECKS]
ENFORCED = tomllib.loads(
    (Path(str(kinetile_conformance.__file__)).with_name("contract.toml")).read_text(encoding="utf-8")
)


def section(page: str, heading: str) -> str:
    """Returns the text under a heading of a page, up to the next."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.split(r"^## ", text.partition(f"\n## {heading}\n")[2], flags=re.MULTILINE)[0]


def test_every_sentence_of_the_contract_says_what_enforces_it():
    numbers = re.findall(r"^(\d+)\. ", section("writing-a-broad-phase.md", "The contract"), re.MULTILINE)
    assert [*ENFORCED["broad-phases"]] == numbers == [str(n) for n in range(1, len(numbers) + 1)]
    without = [number for number, checks in ENFORCED["broad-phases"].items() if not checks]
    said = re.findall(
        r"\d+", section("writing-a-broad-phase.md", "What enforces it").partition("None enforces")[2]
    )
    assert [each for each in said if each != "18"] == without


def test_the_table_names_every_observation_and_no_check_that_there_is_not():
    found = {check for rows in ENFORCED.values() for checks in rows.values() for check in checks}
    assert {check.name for check in CHECKS if check.at_home} <= found <= {*NAMES}


def test_each_cell_of_the_table_has_scenes_or_a_reason():
    drawn = [check for check in CHECKS if check.strategy is not None]
    everywhere = {check.strategy.name for check in drawn}
    for observation in {check.observation for check in drawn}:
        on = {check.strategy.name for check in drawn if check.observation == observation}
        assert on == everywhere or observation in OTHERWISE or observation.name == "same-contacts"
    assert set(OTHERWISE) <= {check.observation for check in drawn}
