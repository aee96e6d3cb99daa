"""What tests of the conformance kit share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import kinetile as kt

if TYPE_CHECKING:
    from phase_mutants import Mutant


@pytest.fixture
def load_mutant(tmp_path: Path) -> Iterator[Callable[[str], Mutant]]:
    """Load mutants by their labels for one test."""
    from mutant_table import ALL

    had = {id(each.plugin) for each in kt.registry()}

    def load(label: str) -> Mutant:
        (mutant,) = (each for each in ALL if each.label == label)
        mutant.load(tmp_path)
        return mutant

    yield load
    for plugin in {id(each.plugin): each.plugin for each in kt.registry()}.values():
        if id(plugin) not in had:
            kt.registry().remove(plugin)
