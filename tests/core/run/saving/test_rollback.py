"""A game that goes back for orders that come late has the contacts of a run with all orders in time."""

from pathlib import Path

import pytest

from installing import loaded

EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "rollback.py"


@pytest.fixture(scope="module")
def rollback():
    with loaded(EXAMPLE) as module:
        module.microseconds.__defaults__ = (3,)  # nothing is judged by how long it takes
        yield module


@pytest.mark.parametrize(
    ("frames", "bodies"), [(16, 9), pytest.param(10_000, 60, marks=(pytest.mark.slow, pytest.mark.compiled))]
)
def test_late_orders_end_in_the_same_bits(rollback, frames, bodies, capsys):
    assert rollback.main(["--frames", str(frames), "--bodies", str(bodies)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["cells", "sap-1d", "sweep-tiling", "one"]
    assert int(lines[0].split()[3]) > frames // 4
