"""What is no fault of the phase on trial ends no trial; and what is one is known by its type."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import hostile_phases
import kinetile as kt
import kinetile_conformance.court.court
from kinetile.errors import PhaseError, Refused, StalledError
from kinetile.kernel.faults import BAD_PAIR, STALLED
from kinetile.kernel.tables import Kernel
from kinetile.run.engine import Engine
from kinetile.run.engine.failures import failure
from kinetile.toolbox import BroadPhaseParts
from kinetile_conformance import check_broad_phase
from kinetile_conformance.cases import Subject, load_case
from kinetile_conformance.court.court import Court
from kinetile_conformance.court.report import Result
from kinetile_conformance.court.tightness import tightness


class EveryPair:
    """A broad phase that is right, as far as these tests look."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(hostile_phases.everyone)


class OnlyAFew(EveryPair):
    """A broad phase for 20 bodies at most."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        if len(scene) > 20:
            raise Refused("only-a-few stops at 20 bodies")
        return super().prepare(scene)


class FailsWithMany(EveryPair):
    """A broad phase that fails where there are more than 20 bodies."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        if len(scene) > 20:
            raise IndexError("my table has 20 rows")
        return super().prepare(scene)


class Plugin:
    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        return [
            kt.BroadPhaseSpec("only-a-few", OnlyAFew),
            kt.BroadPhaseSpec("fails-with-many", FailsWithMany),
        ]


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    plugins = (Plugin(), hostile_phases)
    for plugin in plugins:
        kt.registry().add(plugin)
    yield
    for plugin in plugins:
        kt.registry().remove(plugin)


# How much is over-reported


@pytest.mark.parametrize("name", ["only-a-few", "fails-with-many"])
def test_a_phase_that_does_not_do_the_dense_gas_gets_its_report(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert tightness(Subject(name, {})) is None
    monkeypatch.setattr(kinetile_conformance.court.court, "CHECKS", ())  # as if it had passed them all
    report = check_broad_phase(name, in_process=True)
    assert (report.ok, report.tightness, report.distribution) == (True, None, "this process")
    assert "over-reporting" not in str(report)


# What cannot be saved


def failing(save_to: Path) -> Result:
    """Return the result of a check that fails on the first scene; nothing is compiled for it."""
    court = Court(Subject("raises-in-arrange", {}), examples=5, save_to=save_to, shrink=False)
    result = court.judge("near-is-mutual", "it raises")
    assert result.status == "xfailed"
    assert "arrange raised KeyError: 'no such thing'" in result.said.splitlines()[0]
    return result


def test_a_scene_that_cannot_be_saved_is_a_line_of_the_result(tmp_path: Path) -> None:
    (tmp_path / "a-file").touch()
    result = failing(tmp_path / "a-file")
    assert (result.case, result.picture) == (None, None)
    assert result.said.splitlines()[-1].startswith("(the scene could not be saved: ")


def test_a_picture_that_cannot_be_saved_is_a_line_of_the_result(tmp_path: Path) -> None:
    (tmp_path / "raises-in-arrange-near-is-mutual.svg").mkdir()
    result = failing(tmp_path)
    assert result.picture is None
    assert result.said.splitlines()[-1].startswith("(the picture could not be saved: ")
    assert result.case is not None
    assert load_case(result.case).check == "near-is-mutual"


# A phase that does not get on


@pytest.mark.parametrize(("fault", "status"), [(STALLED, "xfailed"), (BAD_PAIR, "xpassed")])
def test_makes_progress_tells_one_that_stalls_from_one_that_is_wrong_by_the_type(
    fault: int, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    tables = Kernel(*(table.copy() for table in sim.tables))
    clock = tables.clock[0]
    clock.fault, clock.fault_a, clock.fault_b = fault, 0, 1
    found = failure(tables, sim.composition, 0.5)
    assert isinstance(found, PhaseError)
    assert isinstance(found, StalledError) == (fault == STALLED)
    found.args = ("in other words",)

    def chunk(*arguments: object, **more: object) -> int:
        raise found

    monkeypatch.setattr(Engine, "chunk", chunk)
    result = Court(Subject("naive", {}), examples=2).judge("makes-progress", "a reason")
    assert result.status == status
    assert result.said == ("in other words" if fault == STALLED else "")
