"""What belongs to a change is there: a name is in a page, an option and a reading in a docstring, and
CONTRIBUTING.md names files and tests that exist."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from pathlib import Path
from pkgutil import resolve_name

import pytest

from kinetile.plugin.registry import registry
from kinetile.run.readings import Readings

ROOT = Path(__file__).parents[1]
PAGES = "\n".join(page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").rglob("*.md")))
BUILT_IN = [
    (said["kind"], said["name"])
    for said in registry().as_dicts()["provided"]
    if said["distribution"] == "kinetile" and not said["name"].startswith("_")
]
OF_ALL = {"scene", "self", "rng"}
"""Arguments that are no options."""


@pytest.mark.parametrize(("kind", "name"), BUILT_IN)
def test_a_name_is_in_a_page_and_its_options_are_said(kind: str, name: str) -> None:
    assert f"`{name}`" in PAGES, f"CONTRIBUTING.md says to which page the {kind} {name!r} belongs"
    target = registry().spec(kind, name).target
    target = resolve_name(target) if isinstance(target, str) else target
    told = f"{inspect.getdoc(target)}\n{inspect.getdoc(inspect.getmodule(target))}"
    for option in set(inspect.signature(target).parameters) - OF_ALL:
        said = re.search(rf"\b{option}\b", told) or f"`{option}`" in PAGES
        assert said, f"the option {option!r} of the {kind} {name!r} is in no docstring and in no page"


def test_a_reading_is_said_with_its_unit() -> None:
    told = inspect.getdoc(Readings) or ""
    for field in fields(Readings):
        assert re.search(rf"^\s*{field.name}: \S", told, re.MULTILINE), (
            f"the reading {field.name!r} is not explained"
        )


def test_the_table_of_laws_names_tests_that_exist() -> None:
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:tests|core|plugins|docs)/[\w./-]+)(?:::(\w+))?`", page)
    assert len(named) > 60
    for path, test in named:
        found = ROOT / path
        assert found.exists(), f"CONTRIBUTING.md names {path}"
        assert not test or f"def {test}(" in found.read_text(encoding="utf-8"), (
            f"CONTRIBUTING.md names {test}"
        )
