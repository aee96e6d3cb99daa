"""What tests of the conformance kit share."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest


@pytest.fixture
def load_mutant(tmp_path: Path) -> Iterator[Callable[[str], object]]:
    """Loads mutants by their names for one test."""
    import mutants

    with ExitStack() as stack:
        yield lambda name: stack.enter_context(mutants.loaded(name, tmp_path))
