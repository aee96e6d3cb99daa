"""The kernel knows certificates and events, not collisions alone: the example, which sorts."""

from pathlib import Path

import pytest

from installing import loaded
from registering import remove

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
EXAMPLE = EXAMPLES / "kinetile-thesis" / "kinetile_thesis" / "sorted_list.py"


@pytest.fixture(scope="module")
def example():
    with loaded(EXAMPLE) as module, remove("sorted-list"):  # kinetile-thesis may be installed, and brings it
        yield module


def test_the_example_prints_the_order_and_its_events(example, capsys):
    example.main()
    assert capsys.readouterr().out.splitlines() == [
        "at  0.5: [1, 0, 2, 3, 4, 5] after 1 events",
        "at  1.0: [1, 0, 4, 2, 3, 5] after 3 events",
        "at  2.0: [1, 4, 3, 2, 0, 5] after 7 events",
        "at  4.0: [1, 4, 3, 5, 2, 0] after 9 events",
        "at  8.0: [0, 4, 1, 5, 3, 2] after 16 events",
    ]
