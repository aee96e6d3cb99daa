"""The chart of speed against error: its counts, its sentences, and its drawing."""

import json
import re
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import kinetile as kt
from kinetile_accuracy.report import write_report
from kinetile_accuracy.stepped import chart as speed_error
from kinetile_accuracy.stepped.chart import EFFORTS, FINDERS, Effort, claims, crossing, findings, measure
from kinetile_accuracy.stepped.engines import ENGINES
from kinetile_accuracy.stepped.methods import Method, SpeedError, first_encounters, found, reference_runs
from kinetile_accuracy.stepped.snapshots import STEPPED
from lanes import ALIKE, first


def broad_phases() -> tuple[str, ...]:
    return kt.registry().names("broad phase")


CHART = Path(__file__).parents[4] / "docs" / "speed-against-error.svg"

SILENT: Any = lambda *_: None  # noqa: E731

BUILT_IN = ("naive", "cells", "sap-1d", "sap-2d", "sap-k", "sweep-tiling", "power")


def contacts(*rows: tuple[int, int, int]) -> npt.NDArray[np.void]:
    return np.array([*rows], STEPPED)


def row(method: str, dt: float | None = None, **more: Any) -> SpeedError:
    kinds: Any = {name: kind for kind, name in speed_error._LOOKS}
    plain = SpeedError(
        bodies=100,
        density=0.25,
        kind=kinds.get(method, "kinetic"),
        method=method,
        dt=dt,
        cost=1e-3,
        cost_low=1e-3,
        cost_high=1e-3,
        deepest=1e-15,
        deepest_high=1e-15,
        energy_drift=0.0,
        contacts=1000.0,
        events=None,
        encounters=2000,
        missed=0,
        missed_share=0.0,
    )
    return replace(plain, **more)


KINETIC = (row("naive", cost=3e-3), row("sap-1d", cost=2e-3), row("sweep-tiling", cost=1e-3))
CURVE = (
    row("sweep", 1e-2, cost=1e-4, deepest=1.0, missed=200, missed_share=0.1),
    row("sweep", 1e-3, cost=5e-4, deepest=0.1, missed=20, missed_share=0.01),
    row("sweep", 1e-4, cost=2e-3, deepest=0.01, missed=0),
)


def test_first_encounters_are_those_of_discs_that_touched_nothing() -> None:
    seen = contacts((0, 0, 1), (1, 2, -1), (2, 1, 3), (3, 2, 4), (4, 5, 6), (5, 0, 1))
    # 0-1 and 5-6 only: 3 meets a disc that has collided, 4 one that has been at a wall.
    assert first_encounters(seen, 7).tolist() == [0, 4]
    assert first_encounters(contacts(), 7).tolist() == []


def test_an_encounter_is_found_as_the_first_contact_of_both() -> None:
    pairs = np.array([(0, 1), (2, 3), (4, 5)])
    late = contacts((7, 0, 1), (8, 3, 2), (9, 4, 5))
    assert found(pairs, late, 6).all()
    instead = contacts((7, 0, 2), (8, 2, 3), (9, 4, -2), (9, 4, 5), (10, 0, 1))
    # 2 has met 0 before, and 0 has met 2; 4 is at a wall at the same snapshot, which has no order.
    assert found(pairs, instead, 6).tolist() == [False, False, True]


def test_where_two_methods_cost_the_same() -> None:
    at = crossing(CURVE, 1e-3)
    assert at is not None
    assert at.cost == 1e-3
    assert at.dt == pytest.approx(10**-3.5)  # 1e-3 is half way from 5e-4 to 2e-3, by logarithms
    assert at.deepest == pytest.approx(10**-1.5)
    assert at.missed_share == pytest.approx(0.005)
    at = crossing(CURVE, 5e-4)
    assert at is not None
    assert (at.dt, at.deepest, at.missed_share) == pytest.approx((1e-3, 0.1, 0.01))
    assert crossing(CURVE, 1.0) is None
    assert crossing(CURVE, 1e-6) is None
    assert crossing(CURVE[:1], 1e-4) is None


SLOW = tuple(row("box2d-bullets", dt, cost=cost, deepest=0.01) for dt, cost in ((1e-2, 5e-3), (1e-3, 9e-3)))


def test_the_sentences_say_what_the_rows_say() -> None:
    (of_sweep,) = findings([*KINETIC, *CURVE])
    assert "takes as long at dt = 3.2e-4, with overlaps up to 0.032 radii and 0.50% of first" in of_sweep
    assert "; 2 times as long at dt = 1e-4, with overlaps up to 0.01 radii and no first enc" in of_sweep
    (of_engine,) = findings([*KINETIC, *SLOW])
    assert "Box2D 2.3 with bullets takes 5 times as long" in of_engine
    assert "takes as long" not in of_engine, "it never costs as little"


@pytest.mark.parametrize(
    ("rows", "measured", "hold"),
    [
        (CURVE, "of 3 measurements 2 are as fast, 0 as true, 0 both", (True, True, True)),
        (SLOW, "of 2 measurements 0 are as fast, 0 as true, 0 both", (True, True, True)),
        (
            (row("cells", 1e-3, cost=5e-4, deepest=1e-16),),
            "of 1 measurements 1 are as fast, 1 as true, 1 both",
            (True, True, False),
        ),
        (
            (replace(KINETIC[2], missed=7, deepest_high=0.2),),
            "of 0 measurements 0 are as fast, 0 as true, 0 both",
            (False, False, True),
        ),
    ],
)
def test_claims_hold_or_not_as_the_rows_say(
    rows: tuple[SpeedError, ...], measured: str, hold: tuple[bool, ...]
) -> None:
    found = claims([*KINETIC, *rows])
    assert tuple(claim.holds for claim in found) == hold
    assert found[-1].measured == measured


@pytest.mark.slow
@pytest.mark.parametrize("fast", first(1, ["cells", "of-a-plugin"]))
def test_the_chart_took_sweep_tiling_for_the_fastest_whatever_was(
    fast: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("matplotlib")
    kinetic = tuple(
        row(name, kind="kinetic", cost=1e-3 if name == fast else 4e-3, contacts=9.0)
        for name in dict.fromkeys([*BUILT_IN, fast])
    )
    monkeypatch.setattr(speed_error, "measure_rows", lambda *_, **__: [*kinetic, *CURVE])
    monkeypatch.setattr(speed_error, "_installed", lambda: ({}, ()))
    conditions = {"versions": {}, "processor": "one", "processors": 2, "system": "Linux"}
    section = measure("quick", SILENT)
    page, *_ = write_report([section], tmp_path, budget="quick", conditions=conditions)
    text = page.read_text(encoding="utf-8")
    assert f"at the cost of {fast}, the fastest kinetic method here" in text
    assert f"100 discs at density 0.25 ({fast}: 1 ms)" in text
    assert f"as fast as the fastest kinetic one ({fast}) and as true" in text
    assert "of 3 measurements 2 are as fast" in text


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    effort = Effort(((16, 0.25),), 1, 5, (1e-1, 1e-2), (1e-1,))
    monkeypatch.setitem(speed_error.EFFORTS, "quick", effort)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.usefixtures("small")
def test_the_section_holds_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymunk", None)
    monkeypatch.setitem(sys.modules, "Box2D", None)
    section = measure("quick", SILENT)
    assert section.name == "chart"
    assert len(section.left_out) == 2, "each package once"
    assert all("kinetile[peers]" in reason for reason in section.left_out)
    (table,) = section.tables
    assert len(table.rows) == len(broad_phases()) + 2 * 2
    assert all(hasattr(table.rows[0], head) for head in table.heads)
    assert {row.method for row in table.rows} == {*broad_phases(), "sweep"}
    assert [row.kind for row in table.rows if row.method == "cells"] == ["kinetic", *["snapshots"] * 2]
    (picture,) = section.pictures
    said = json.loads(picture.description)
    assert list(said["kinetic"]) == list(broad_phases())
    assert said["steps"] == {"snapshots": {"sweep": [1e-1, 1e-2], "cells": [1e-1, 1e-2]}}
    assert section.findings


def test_the_chart_is_drawn_and_names_every_method() -> None:
    pytest.importorskip("matplotlib")
    from kinetile_accuracy.stepped.chart import draw_speed_error

    engines = (
        row("chipmunk", 1e-2, cost=2e-3, deepest=0.9, missed_share=0.01),
        row("box2d", 1e-2, cost=7e-3, deepest=0.2),
        row("box2d-bullets", 1e-2, cost=9e-3),
    )
    both = (row("cells", 1e-2, deepest=0.5), row("cells", kind="kinetic", cost=5e-4), row("sap-2d"))
    figure = draw_speed_error((*KINETIC, *CURVE, *engines, *both))
    said = {text.get_text() for axes in figure.axes for text in axes.texts}
    said |= {text.get_text() for text in figure.legends[0].get_texts()}
    assert {name for name, *_ in speed_error._LOOKS.values()} | {"naive", "sap-1d", "cells", "sap-2d"} <= said
    assert {"slower", "faster", "dt = 1e-4"} <= said
    assert [axes.get_yscale() for axes in figure.axes] == ["log"] * 4
    assert figure.axes[2].get_xticklabels()[0].get_text() == "none"


def committed() -> dict[str, Any]:
    """Returns the subject of README's chart, from its metadata."""
    (text,) = re.findall(r"<dc:description>(.*?)</dc:description>", CHART.read_text(encoding="utf-8"))
    said: dict[str, Any] = json.loads(unescape(text))
    return said


def test_the_chart_of_readme_has_the_methods_that_there_are() -> None:
    # It was of three phases; one had become ten times as fast, and nothing said so.
    effort, said = EFFORTS["normal"], committed()
    assert (said["bodies"], said["density"]) == (400, 0.25)
    assert list(said["kinetic"]) == list(BUILT_IN)
    assert said["steps"] == {
        "snapshots": {finder: list(effort.steps) for finder in FINDERS},
        "engine": {peer: list(effort.engine_steps) for peer in ENGINES},
    }


def test_the_line_of_the_chart_of_readme_is_at_the_fastest_kinetic_method() -> None:
    text = CHART.read_text(encoding="utf-8")  # it stayed at sweep-tiling when cells had become faster
    lines = re.findall(r'd="M \S+ (\S+) \nL \S+ \1 \n" clip\S+ style="fill: none; stroke: #0072b2', text)
    marks = re.findall(r'<use \S+ x="\S+" y="(\S+)" style="fill: #0072b2', text)
    assert {*lines} == {max((y for y in marks if float(y) < 214.0), key=float)}


@pytest.mark.compiled
@pytest.mark.parametrize("phase", first(len(ALIKE), sorted(BUILT_IN, key=lambda name: name not in ALIKE)))
def test_the_chart_of_readme_has_the_counts_that_there_are(phase: str) -> None:
    effort, said = EFFORTS["normal"], committed()
    bodies, density = said["bodies"], said["density"]
    if phase == "cells":
        pairs = sum(len(t.pairs) for t in reference_runs(bodies, density, effort.encounters))
        assert said["encounters"] == pairs
    counts = said["kinetic"][phase]
    found = [
        Method("kinetic", phase).run(
            kt.make_scene("grid", bodies=bodies, density=density, seed=seed + 1), 1.0, "contacts"
        )
        for seed in range(effort.seeds)
    ]
    contacts = [int((observed.contacts["b"] >= 0).sum()) for observed in found]
    assert counts["contacts"] == np.mean(contacts)
    # A tenth is less than the width of a mark; beyond, the phase has to be measured again.
    assert counts["events"] == pytest.approx(np.mean([each.steps for each in found]), rel=0.1)
