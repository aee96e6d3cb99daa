"""The refusals of the instruments of accuracy: the rows of ``messages.toml``."""

from pathlib import Path

import pytest

import kinetile as kt
from messages import table

pytest.importorskip("flint")
pytestmark = pytest.mark.small
GRID = kt.make_scene("grid", bodies=9, seed=3).replace(start=4.0)


def simulation(**more) -> kt.Simulation:
    sim = kt.Simulation(GRID, "naive", **more)
    sim.run(4.125)
    return sim


def turned_by_hand() -> kt.Simulation:
    sim = simulation(turning=True)
    sim.set_velocity(0, (0.0, 1.0))
    return sim


def not_run(certify, sim, **end) -> None:
    """Certifies what cannot be certified: nothing is run in vain."""
    before = sim.exact_time
    try:
        certify(sim, **end)
    finally:
        assert sim.exact_time == before


def written(text: str) -> str:
    Path("log").write_text(text, encoding="utf-8")
    return "log"


def there(line: str) -> str:
    Path("there").write_text("mine", encoding="utf-8")
    return line


test_message = table(globals())
