"""The kernel knows certificates and events, not collisions alone: the example, against NumPy's sort."""

from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from installing import install, loaded, run
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


def test_it_stays_sorted_and_swaps_once_an_inversion(example):
    if "sorted-list" not in kt.registry().names("broad phase"):
        kt.registry().add(example.Plugin())
    rng = np.random.default_rng(11)
    n = 60
    x, v = rng.uniform(0, 1, n), rng.normal(size=n)
    scene = kt.Scene(np.column_stack([x, np.arange(n)]), np.column_stack([v, np.zeros(n)]), 0.25)
    sim = kt.Simulation(scene, "sorted-list", narrow_phases=[])
    swaps = 0
    before = np.argsort(x)
    for time in np.linspace(0.05, 3.0, 25):
        sim.run(until=float(time))
        order = sim.state.order
        place = sim.positions()[order, 0]
        assert (np.diff(place) >= -1e-12).all()
        assert (sim.state.rank[order] == np.arange(n)).all()
        rank = np.argsort(before)[order]
        swaps += sum(int((rank[i + 1 :] < rank[i]).sum()) for i in range(n))
        before = order.copy()
    assert sim.readings.structural_events == swaps
    assert len(sim.contacts) == 0


def test_these_tests_run_where_the_example_is_installed(tmp_path):
    paths = install(EXAMPLES / "kinetile-thesis", tmp_path)
    one = f"{__file__}::test_the_example_prints_the_order_and_its_events"
    done = run(one, "-p", "no:cacheprovider", folder=EXAMPLES, paths=paths, module="pytest")
    assert "1 passed" in done.stdout.splitlines()[-1], done.stdout
    assert "error" not in done.stdout.splitlines()[-1]
