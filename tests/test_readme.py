"""README's limits, and the counts that docs show of runs: the same wherever they are run.

Times are not judged: of lines and tables that have them, their surroundings are, and what follows from
counts.
"""

import re
from pathlib import Path

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import Refused
from kinetile_bench.event_rates import DENSITIES
from lanes import BUILT_IN, COMPILED, SHARED, first

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
WHICH = (ROOT / "docs" / "which-broad-phase.md").read_text(encoding="utf-8")

MEASURED = {"speed", "CPU time"}
"""Lines that differ from run to run."""

pytestmark = pytest.mark.compiled


def by_label(lines: list[str]) -> dict[str, str]:
    return dict(re.split(r" {2,}", line, maxsplit=1) for line in lines)


def cells(text: str, head: str) -> list[list[str]]:
    (place,) = re.finditer(re.escape(head), text)
    lines = text[place.end() :].splitlines()[2:]
    rows = lines[: next((k for k, line in enumerate(lines) if not line.startswith("|")), len(lines))]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def test_the_sample_run_is_what_the_command_prints():
    (sample,) = re.findall(r"```text\n(scene .*?)```", COMMANDS, flags=re.DOTALL)
    shown = by_label(sample.splitlines())
    printed = by_label(kinetile("run", code=0).stdout.splitlines())
    assert len(shown) == 9
    assert [label for label in printed if label in shown] == list(shown)
    for label in set(shown) - MEASURED:
        assert shown[label] == printed[label], label
    numbers = re.compile(r"[\d.,]+")
    for label in set(shown) & MEASURED:
        assert numbers.sub("0", shown[label]) == numbers.sub("0", printed[label])
    sim = kt.Simulation(kt.make_scene("grid"))
    sim.run(1.0)
    assert shown["fingerprint"] == sim.fingerprint


@pytest.mark.parametrize("phase", first(len(COMPILED), [*COMPILED, *sorted({*BUILT_IN} - {*COMPILED})]))
def test_the_sample_run_has_the_same_fingerprint_under_every_phase(phase):
    (fingerprint,) = re.findall(r"^fingerprint +(\w+)$", COMMANDS, flags=re.MULTILINE)
    sim = kt.Simulation(kt.make_scene("grid"), phase, narrow_phases=SHARED, keep_contacts=False)
    sim.run(1.0)
    assert sim.fingerprint == fingerprint


@pytest.mark.slow
def test_the_table_of_speeds_has_as_many_events_for_a_contact_as_there_are():
    phases = ("naive", "cells", "sap-1d", "sap-2d", "sap-k", "sweep-tiling", "power")
    head = "|density|" + "|".join(f"`{phase}`" for phase in phases) + "|"
    (table,) = re.findall(r"## Contacts a second\n(.*?)\n## ", WHICH, flags=re.DOTALL)
    rows = cells(table, head)
    assert [float(row[0]) for row in rows] == list(DENSITIES)
    for density, *of_phases in rows:
        scene = kt.make_scene("grid", bodies=400, density=float(density))
        for phase, cell in zip(phases, of_phases, strict=True):
            million_events, thousand_contacts = (float(each) for each in cell.split(", "))
            sim = kt.Simulation(scene, phase, keep_contacts=False)
            sim.run(max_contacts=20_000)
            rounding = 0.005 / million_events + 0.5 / thousand_contacts
            found = sim.readings.events / 20_000
            assert 1e3 * million_events / thousand_contacts == pytest.approx(found, rel=0.05 + rounding)


def test_the_first_contacts_are_those_that_the_first_block_prints(capsys):
    code, printed = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", README, flags=re.DOTALL).groups()
    exec(code, {})
    assert capsys.readouterr().out == printed


def test_naive_refuses_as_many_bodies_as_the_limits_say():
    (limit,) = re.findall(r"`naive` refuses more than ([\d,]+) bodies", README)
    most = int(limit.replace(",", ""))
    velocity = [[0.0, 0.0]]
    for bodies, refused in ((most, False), (most + 1, True)):
        scene = kt.Scene([[4.0 * k, 0.0] for k in range(bodies)], velocity * bodies, 1.0)
        if refused:
            with pytest.raises(Refused):
                kt.Simulation(scene, "naive")
        else:
            kt.Simulation(scene, "naive")
