"""The thesis's benchmark: its counts, its rounds, its figures and its command; no clock is judged here."""

import json
import os
import signal
import sys
from itertools import product

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile_accuracy.drawing import LOOKS
from kinetile_bench import thesis as bench_thesis_module
from kinetile_bench.event_rates import DENSITIES
from kinetile_bench.thesis import ThesisBench, ThesisScene, bench_thesis
from kinetile_bench.thesis.figures import draw
from lanes import SHARED, first
from made_up_benchmarks import as_the_thesis_says, bench_of

NUMBERS = (25, 100, 400)
BOUND_EVENTS = {
    0.5: (694, 5772, 47837),
    0.25: (546, 5114, 44640),
    0.125: (594, 6398, 56192),
    0.01: (765, 10938, 116171),
}
"""Bound events of sweep-tiling in a unit of time, means over six seeds of another implementation, which drew
other directions."""

ERROR_BARS = {(0.5, 25): 51, (0.5, 100): 311, (0.5, 400): 991}


def rates(phase: str, density: float, bodies: int, until: float) -> tuple[float, float]:
    """Returns bound events and collisions in a unit of time, means over six seeds."""
    bound = collisions = 0
    for seed in range(1, 7):
        scene = kt.make_scene("grid", bodies=bodies, density=density, seed=seed)
        sim = kt.Simulation(scene, phase, narrow_phases=SHARED, keep_contacts=False)
        sim.run(until)
        bound += sim.readings.structural_events
        collisions += sim.readings.contacts_disc
    return bound / 6 / until, collisions / 6 / until


def assert_near(found: float, density: float, bodies: int) -> None:
    expected = BOUND_EVENTS[density][NUMBERS.index(bodies)]
    allowed = max(0.05 * expected, ERROR_BARS.get((density, bodies), 0))
    assert abs(found - expected) <= allowed, f"{found:.0f} bound events, expected {expected} ± {allowed:.0f}"


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("density", "bodies"), first(4, [*product(DENSITIES, (25, 100)), (0.25, 400), (0.125, 400)]), ids=str
)
def test_bound_events_are_those_of_another_implementation(density, bodies):
    assert_near(rates("sweep-tiling", density, bodies, 1.0)[0], density, bodies)


# Small runs, with plain hooks but for those that are not run here

PHASES = ["naive", ("sap-1d", {"axis": "y"}), "sweep-tiling"]
PART = {"seeds": 2, "until": 0.2, "seconds": 1e-6, "repeats": 3}


@pytest.fixture(scope="module")
def small() -> ThesisBench:
    *_, found = bench_thesis(PHASES, [4, 9], [0.5, 0.25], **PART)
    return found


@pytest.mark.small
def test_every_cell_is_measured(small):
    assert len(small.rows) == 3 * 2 * 2 * 2
    assert small.phases == ("naive", "sap-1d:axis=y", "sweep-tiling")
    assert small.scenes() == [(0.5, 4), (0.5, 9), (0.25, 4), (0.25, 9)]
    assert [*small.of(ThesisScene(0.25, 9), "sweep-tiling")] == [1, 2]
    for cell in small.rows:
        assert len(cell.cpu_seconds) == 3
        assert cell.cost == sorted(cell.cpu_seconds)[1] / PART["until"]
    assert small.identical


@pytest.mark.small
def test_the_counts_are_those_of_the_simulation(small):
    for cell in small.rows:
        name, _, option = cell.phase.partition(":")
        scene = kt.make_scene("grid", bodies=cell.bodies, density=cell.density, seed=cell.seed)
        sim = kt.Simulation(scene, name, options={"axis": "y"} if option else None)
        sim.build()
        built = sim.readings
        sim.run(PART["until"])
        found, counts = sim.readings, cell.counts
        assert cell.fingerprint == found.fingerprint
        assert (counts["structural_events"], counts["events"]) == (found.structural_events, found.events)
        assert counts["partners_asked"] == found.partners_asked - built.partners_asked
        assert 0 < counts["queue_max"] == found.queue_max <= cell.bodies
        if name == "naive":
            assert counts["certificates_updated"] == counts["structural_events"] == 0
            assert counts["candidate_pairs"] == cell.bodies * (cell.bodies - 1) / 2


@pytest.mark.small
def test_the_phases_take_turns_in_every_round(monkeypatch):
    ran = []
    monkeypatch.setattr(bench_thesis_module, "_time", lambda scene, choice, *_: ran.append(choice[0]) or 1.0)
    list(bench_thesis(["naive", "sap-1d"], [4], [0.5], **PART | {"seeds": 1}))
    assert ran == ["naive", "sap-1d", "sap-1d", "naive", "naive", "sap-1d"]


@pytest.fixture
def no_run(small, monkeypatch):
    """The command measures nothing: the results are there."""
    monkeypatch.setattr(bench_thesis_module, "bench_thesis", lambda *_, **__: iter([small]))


@pytest.mark.small
def test_thesis_prints_its_table_and_its_verdicts(no_run, small):
    result = kinetile("bench", "thesis", code=0)
    for expected in ("CPU milliseconds", "sap-1d:axis=y", "updates", "B11", "not measured"):
        assert expected in result.stdout
    found = json.loads(kinetile("bench", "thesis", "--json").stdout)
    assert [row["cpu_seconds"] for row in found["rows"]] == [list(cell.cpu_seconds) for cell in small.rows]
    assert [each["name"] for each in found["statements"]] == [f"B{k}" for k in range(1, 12)]
    assert {*found["statements"][-1]["parts"][-1]} == {"text", "answer", "numbers"}
    assert (found["files"], found["identical"]) == ([], True)


@pytest.mark.small
def test_thesis_with_one_round_printed_an_infinite_unrest(monkeypatch):
    found = bench_of(as_the_thesis_says, rounds=1)
    monkeypatch.setattr(bench_thesis_module, "bench_thesis", lambda *_, **__: iter([found]))
    printed = kinetile("bench", "thesis").stdout
    assert " inf " not in printed
    assert "1 round of about" in printed


@pytest.mark.slow
def test_both_figures_are_drawn(small, tmp_path, no_run):
    pytest.importorskip("matplotlib")
    drawn = ("figure-23", "figure-24", "events-a-contact")
    names = [f"{name}.{suffix}" for name in drawn for suffix in ("svg", "png")]
    assert [path.name for path in draw(bench_of(as_the_thesis_says), tmp_path)] == names
    assert all((tmp_path / name).stat().st_size > 10_000 for name in names)
    found = json.loads(kinetile("bench", "thesis", "--out", tmp_path / "new", "--json").stdout)
    assert found["files"] == [str(tmp_path / "new" / name) for name in names]


def test_every_phase_has_a_look_of_its_own():
    """The fifth and the sixth of six phases had the looks of the first and the second."""
    assert len({marker for _, marker, _ in LOOKS}) == len(LOOKS) >= len(bench_thesis_module.PHASES)


def test_thesis_needs_matplotlib_for_its_figures_before_it_measures(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = kinetile("bench", "thesis", "--out", tmp_path, code=2)
    assert "pip install 'kinetile[figures]'" in result.stderr


@pytest.mark.small
@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal")
def test_thesis_prints_what_there_is_when_interrupted(small, monkeypatch):
    def interrupted(*_, **__):
        yield small
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(bench_thesis_module, "bench_thesis", interrupted)
    result = kinetile("bench", "thesis", code=130)
    assert "sweep-tiling" in result.stdout
    assert "interrupted" in result.stderr
