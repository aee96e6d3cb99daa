"""The judge: time limits, failures that do not always come back, saved cases, phases without a fault."""

import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import hostile_phases
import kinetile as kt
from hostile_phases import nobody
from kinetile.errors import PhaseError, Refused
from kinetile.kernel.compiled import compiling_seconds
from kinetile.scene import Scene
from kinetile.toolbox import BroadPhaseParts
from kinetile_conformance import check_broad_phase, deadline
from kinetile_conformance.api import replay
from kinetile_conformance.cases import Subject, load_case, outcome
from kinetile_conformance.checks import check_named
from kinetile_conformance.checks.check import Case, Disagreement, compare
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.reporting import Result
from kinetile_conformance.runner import CheckRun, JudgingPlan, Runner, reference_of
from kinetile_plugins.naive import near as everybody
from registering import fixture, registered

pytestmark = pytest.mark.interpreted

COUNT = itertools.count()

QUICKLY = {"examples": 10, "shrink": False, "explains": False}


class Slow:
    """Right, and takes its time."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        until = time.process_time() + 0.05
        while time.process_time() < until:
            pass
        return BroadPhaseParts(everybody)


class Moody:
    """Wrong every third time that it is asked."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        return BroadPhaseParts(nobody if next(COUNT) % 3 == 0 else everybody)


class WrongIf:
    """Wrong where its option says so."""

    def __init__(self, wrong: int = 0) -> None:
        self.wrong = wrong

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        return BroadPhaseParts(nobody if self.wrong else everybody)


class WrongWithMany:
    """Wrong from seven bodies on: no small scene shows it."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        return BroadPhaseParts(nobody if len(scene) > 6 else everybody)


PHASES = (
    kt.BroadPhaseSpec("slow", Slow),
    kt.BroadPhaseSpec("moody", Moody),
    kt.BroadPhaseSpec("wrong-if", WrongIf),
    kt.BroadPhaseSpec("wrong-with-many", WrongWithMany),
)


_registered = fixture(*PHASES, hostile_phases)


@pytest.mark.slow
def test_out_of_time_is_not_judged() -> None:
    runner = Runner(JudgingPlan(Subject("slow", {}), examples=40, seconds=0.25))
    list(runner._drawing.scenes(check_named("its-structure-is-true")))  # drawing takes time, too
    result = runner.run("its-structure-is-true")
    assert result.status == "not judged"
    assert (result.verdict, result.case, result.bodies) == ("", None, None)
    assert 0 < result.scenes < 40
    assert result.reason == "0.25 CPU s were not enough; no fault in the scenes seen until then"


@pytest.mark.slow
def test_drawing_takes_nothing_of_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = list(Drawing(2, seed=0).scenes(check_named("same-contacts")))

    def slowly(*_: object) -> Iterator[Scene]:
        for scene in scenes:
            for _ in range(12):
                Slow().prepare(scene)
            yield scene

    monkeypatch.setattr(Drawing, "scenes", slowly)
    runner = Runner(JudgingPlan(Subject("naive", {}), seconds=0.5))
    assert runner.run("same-contacts").status == "passed"


def test_drawing_is_not_of_the_scene_before(monkeypatch: pytest.MonkeyPatch) -> None:
    drawing, limits = Drawing(1, seed=0, dressed=lambda scene: limits.append(0.0) or scene), []
    monkeypatch.setattr(deadline, "_limit", 20.0)
    monkeypatch.setattr(deadline, "end_after", limits.append)
    list(drawing.scenes(check_named("same-contacts")))
    assert limits[:3] == [math.inf, 0.0, 20.0]


@pytest.mark.slow
def test_a_report_that_is_not_judged_is_neither_right_nor_wrong() -> None:
    checks = ["its-structure-is-true", "its-features-are-known"]
    report = check_broad_phase("slow", in_process=True, checks=checks, seconds=0.25)
    assert (report.exit_code, report.conforms, report.ok) == (4, None, False)
    assert str(report).endswith("slow is not judged: no fault was seen, and its-structure-is-true not judged")


def test_compiling_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    before = deadline.spent()
    monkeypatch.setattr(deadline, "compiling_seconds", lambda: compiling_seconds() + 1000.0)
    assert deadline.spent() < before - 900.0


@pytest.mark.slow
def test_a_failure_that_does_not_always_come_back_says_how_often() -> None:
    result = Runner(JudgingPlan(Subject("moody", {}), examples=10, shrink=False)).run("same-contacts")
    assert result.status == "failed"
    times = int(result.said.rpartition("it failed ")[2].partition(")")[0])
    assert "(not every time: of 5 times more on this scene it failed" in result.said
    assert 1 <= times <= 2


def test_a_saved_case_has_the_options_with_which_it_failed(tmp_path: Path) -> None:
    runner = Runner(JudgingPlan(Subject("wrong-if", {"wrong": 1}), **QUICKLY, save_to=tmp_path))
    result = runner.run("same-contacts")
    assert "not every time" not in result.said
    assert result.case is not None
    case = load_case(result.case)
    assert (case.name, case.options, case.check) == ("wrong-if", {"wrong": 1}, "same-contacts")
    assert not replay("wrong-if", result.case).ok
    assert replay("wrong-if", result.case, options={"wrong": 0}).ok
    assert replay("naive", result.case).ok


def test_a_failure_in_the_gallery_is_saved_and_replayed(tmp_path: Path) -> None:
    options = QUICKLY | {"examples": 1, "save_to": tmp_path}
    runner = Runner(JudgingPlan(Subject("wrong-with-many", {}), **options))
    assert runner.run("same-contacts").ok
    result = runner.run("same-contacts-in-the-gallery")
    assert (result.status, result.bodies) == ("failed", 26)
    assert result.case is not None
    case = load_case(result.case)
    assert (case.check, len(case.scene)) == ("same-contacts-in-the-gallery", 26)


def test_small_scenes_are_drawn_once_and_judged_by_the_reference_once() -> None:
    drawing, each = Drawing(10, seed=3), check_named("same-contacts")
    reference = reference_of(Subject("naive", {}))
    scenes = list(drawing.scenes(each))
    assert all(one is other for one, other in zip(drawing.scenes(each), scenes, strict=True))
    assert reference(scenes[0]) is reference(scenes[0])
    assert reference(scenes[0], 1) is not reference(scenes[0])
    assert scenes == list(Drawing(10, seed=3).scenes(each))


def test_no_scene_is_drawn_after_one_that_fails() -> None:
    seen: list[Scene] = []

    def holds(scene: Scene) -> bool:
        seen.append(scene)
        return len(seen) < 3

    assert not all(map(holds, Drawing(20, seed=1).scenes(check_named("same-contacts-with-turns"))))
    assert len(seen) == 3


def test_a_small_scene_that_fails_is_minimised() -> None:
    result = Runner(JudgingPlan(Subject("wrong-if", {"wrong": 1}), examples=30)).run("same-contacts")
    assert (result.status, result.bodies) == ("failed", 2)


def test_what_a_hook_raises_is_where_the_author_wrote_it(monkeypatch: pytest.MonkeyPatch) -> None:
    class Raises(Slow):
        def prepare(self, scene: Scene) -> BroadPhaseParts:
            raise PhaseError("as it is")

    monkeypatch.setattr(Slow, "prepare", Raises.prepare)
    result = Runner(JudgingPlan(Subject("slow", {}), examples=3, shrink=False)).run("same-contacts")
    assert result.said.startswith("PhaseError: as it is")


def failing(save_to: Path) -> Result:
    runner = Runner(JudgingPlan(Subject("raises-in-arrange", {}), examples=5, save_to=save_to, shrink=False))
    result = runner.run("its-structure-is-true")
    assert result.status == "failed"
    assert "arrange raised KeyError: 'no such thing'" in result.said.splitlines()[0]
    return result


@pytest.mark.slow
def test_a_scene_that_cannot_be_saved_is_a_line_of_the_result(tmp_path: Path) -> None:
    (tmp_path / "a-file").touch()
    result = failing(tmp_path / "a-file")
    assert result.case is None
    assert result.said.splitlines()[-1].startswith("(the scene could not be saved: ")


def test_the_name_of_a_phase_became_the_path_of_its_case(tmp_path: Path) -> None:
    folder = tmp_path / "within"
    with registered(kt.BroadPhaseSpec("../of/mine", WrongIf)):
        plan = JudgingPlan(Subject("../of/mine", {"wrong": 1}), **QUICKLY, save_to=folder)
        result = Runner(plan).run("same-contacts")
    assert result.case == folder / "..-of-mine-same-contacts.toml"
    assert list(tmp_path.iterdir()) == [folder]
    assert load_case(result.case).name == "../of/mine"


@pytest.mark.parametrize("check", ["same-contacts", "its-structure-is-true"])
def test_a_phase_that_refused_a_skin_on_the_way_was_condemned(check):
    """The skin of bodies that fly away grows: a run may end with a refusal that could not be foreseen."""
    leaving = [[-(2.0**24), 0.0], [2.0**24, 0.25]]
    scene = kt.Scene([[1.0, 1.0], [3.0, 1.0]], leaving, 0.25, unit=1.0, settings=kt.Settings(until=1e5))
    scene = scene.replace(commands=[kt.Turn(0, 10.0, leaving[0])])
    run = CheckRun(check_named(check), Subject("sweep-tiling", {}))
    assert run.holds(scene)
    assert run.refused
    assert "the skin around bodies is thin" in run.refusal


@pytest.mark.slow
def test_turns_that_are_scheduled_are_known_to_the_skin() -> None:
    """By hand they are not: that is no fault of a phase."""
    scene = kt.Scene(
        [[1.0, 1.0], [3.0, 1.0]], [[0.5, 0.0], [0.0, 0.25]], 0.25, settings=kt.Settings(until=3.0)
    )
    scene = scene.replace(turns=[kt.Turn(0, 1.0, (64.0, 0.0))], arena=(4.0, 4.0))
    assert CheckRun(check_named("its-structure-is-true"), Subject("naive", {})).holds(scene)


def test_a_refused_skin_excuses_no_contact_that_was_wrong_before():
    speed = 2.0**24
    place, flies = [[1.0, 1.0], [3.0, 1.0], [5.0, 1.0]], [[speed, 0.0], [0.0, 0.0], [-speed, 1.0]]
    scene = kt.Scene(place, flies, 0.25, unit=1.0, settings=kt.Settings(until=1e5))
    case = Case(Subject("sweep-tiling", {}), scene, reference_of(Subject("sweep-tiling", {})))
    found = outcome(case.subject, scene)
    assert len(found.contacts) > 1
    with pytest.raises(Refused, match="the skin around bodies is thin"):
        compare(case, found)
    for wrong in (found.contacts[1:], found.contacts[:-1]):
        with pytest.raises(Disagreement):
            compare(case, replace(found, contacts=wrong))
