"""The thesis's statements: verdicts follow the numbers, and no verdict comes of the load of the machine."""

import math

import pytest

from kinetile_bench.thesis import ThesisBench
from kinetile_bench.thesis.statements import (
    FAILS,
    HOLDS,
    NOT_KNOWN,
    NOT_MEASURED,
    STATEMENTS,
    Ratio,
    statements,
)
from made_up_benchmarks import as_the_thesis_says, bench_of, changed, restless, times


def verdicts(bench: ThesisBench) -> dict[str, str]:
    return {statement.name: statement.verdict for statement in statements(bench)}


COUNTED = {"B7", "B8", "B9"}
"""The statements that are about numbers of events alone."""


def test_where_all_is_as_the_thesis_says_all_holds():
    *found, last = statements(bench_of(as_the_thesis_says))
    assert [statement.name for statement in found] == [f"B{k}" for k in range(1, 11)]
    assert [part for statement in found for part in statement.parts if part.answer != HOLDS] == []
    assert {statement.verdict for statement in found} == {HOLDS}
    assert [part.answer for part in last.parts] == [HOLDS, HOLDS, HOLDS, NOT_MEASURED]
    assert last.verdict == NOT_MEASURED  # the queue has one entry a body, under every method


@pytest.mark.parametrize(
    ("name", "world"),
    [
        ("B1", changed(cost=times(100.0, (0.25, 400, "sweep-tiling")))),
        ("B2", changed(cost=times(1000.0, (0.125, 25, "naive")))),
        ("B3", changed(cost=times(1e6, (0.01, 100, "naive")))),
        ("B4", changed(cost=lambda d, n, p, f: n**3.0 if p == "sweep-tiling" else f["cost"])),
        ("B5", changed(cost=times(0.001, (0.01, 400, "sweep-tiling")))),
        ("B6", changed(bound=lambda d, n, p, f: 10**9 if p == "naive" else f["bound"])),
        ("B6", changed(cost=lambda d, n, p, f: 1.0 if p == "naive" else f["cost"])),
        ("B7", changed(bound=lambda d, n, p, f: 3 if (d, n, p) == (0.5, 25, "sap-1d") else f["bound"])),
        ("B8", changed(bound=lambda d, n, p, f: 10**9 if (d, n, p) == (0.01, 25, "sap-1d") else f["bound"])),
        ("B9", changed(contacts=lambda d, n, p, f: f["contacts"] * (2 if p == "sap-1d" else 1))),
        ("B10", changed(cost=times(0.1, (0.01, 400, "sap-2d")))),
        ("B11", changed(cost=times(0.001, (0.25, 100, "naive")))),
    ],
)
def test_a_verdict_follows_the_numbers(name, world):
    assert verdicts(bench_of(world))[name] == FAILS


@pytest.mark.parametrize(("machine", "rounds"), [(restless, 5), (restless, 1), (lambda *_: 1.0, 1)])
def test_one_round_or_a_machine_that_is_not_quiet_gives_no_verdict_on_time(machine, rounds):
    """With one round the same run has one time, its unrest was 1, and every machine counted as quiet."""
    found = verdicts(bench_of(as_the_thesis_says, machine=machine, rounds=rounds))
    assert {name for name, verdict in found.items() if verdict == HOLDS} == COUNTED
    assert {verdict for name, verdict in found.items() if name not in COUNTED} == {NOT_KNOWN}


def test_on_a_quiet_machine_what_is_level_is_not_known():
    level = changed(cost=lambda d, n, p, f: as_the_thesis_says(d, n, "sap-1d")["cost"])
    found = verdicts(bench_of(level))
    assert (found["B10"], found["B9"]) == (NOT_KNOWN, HOLDS)


def test_a_run_in_which_nothing_happens_has_verdicts():
    nothing = dict.fromkeys(("contacts", "walls", "bound"), lambda *_: 0)
    assert verdicts(bench_of(changed(**nothing)))["B9"] == HOLDS


def test_verdicts_of_a_part_of_a_run():
    cells = bench_of(as_the_thesis_says).rows
    for end in range(4, len(cells), 4):  # Ctrl-C comes after any scene
        found = statements(ThesisBench(cells[:end], {}))
        assert FAILS not in {part.answer for each in found for part in each.parts}


def test_what_was_not_measured_is_said():
    found = verdicts(bench_of(as_the_thesis_says, ("naive", "sap-1d")))
    assert set(found.values()) == {NOT_MEASURED}
    found = verdicts(bench_of(as_the_thesis_says, ("sap-1d", "sap-2d", "sweep-tiling")))
    assert {name for name, verdict in found.items() if verdict == HOLDS} == {"B5", "B7", "B8", "B10"}
    dense = [cell for cell in bench_of(as_the_thesis_says).rows if cell.density == 0.5]
    assert verdicts(ThesisBench(tuple(dense), {}))["B3"] == NOT_MEASURED
    assert len(STATEMENTS) == 11


def evidence(found: list[float], unrest: float = 1.0) -> Ratio:
    return Ratio({(1, k): math.log(each) for k, each in enumerate(found)}, unrest)


def test_nine_of_ten_pairs_decide():
    assert evidence([0.9] * 27 + [1.5] * 3).below == HOLDS
    assert evidence([0.9] * 26 + [1.5] * 4).below == NOT_KNOWN
    assert evidence([1.1] * 27 + [0.5] * 3).below == FAILS
    assert evidence([0.97] * 30).below == NOT_KNOWN
    assert evidence([0.1] * 30, unrest=1.06).below == NOT_KNOWN
