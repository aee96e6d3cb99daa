"""How a phase is judged: in its own time, each failure as often as it comes, and saved so that it comes
again."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import kinetile as kt
from kinetile.errors import PhaseError
from kinetile.kernel.compiled import INTERPRETED, compiling_seconds
from kinetile.scene import Scene
from kinetile.toolbox import BroadPhaseParts, Kernel, NoState, hook
from kinetile_conformance import check_broad_phase
from kinetile_conformance.cases import Subject, load_case
from kinetile_conformance.checks import check_named
from kinetile_conformance.court import limits
from kinetile_conformance.court.court import Court
from kinetile_conformance.court.drawing import Drawing
from kinetile_conformance.court.telling.picture import draw
from kinetile_conformance.court.verdicts import References
from kinetile_conformance.replay import replay
from kinetile_plugins.naive import near as everybody

pytestmark = pytest.mark.skipif(
    not INTERPRETED, reason="a loop for each of these phases: they are judged where hooks are interpreted"
)

COUNT = itertools.count()


@hook
def nobody(k: Kernel, s: NoState, body: int) -> int:
    return 0


class Slow:
    """Right, and takes its time."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        until = time.process_time() + 0.02
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


class Plugin:
    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        return [
            kt.BroadPhaseSpec("slow", Slow),
            kt.BroadPhaseSpec("moody", Moody),
            kt.BroadPhaseSpec("wrong-if", WrongIf),
            kt.BroadPhaseSpec("wrong-with-many", WrongWithMany),
        ]


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    plugin = Plugin()
    kt.registry().add(plugin)
    yield
    kt.registry().remove(plugin)


def test_out_of_time_is_not_judged() -> None:
    court = Court(Subject("slow", {}), examples=100, seconds=0.5)
    result = court.judge("repeats-itself")
    assert result.status == "not judged"
    assert (result.verdict, result.case, result.bodies) == ("", None, None)
    assert 0 < result.scenes < 100
    assert result.reason == "0.5 CPU s were not enough; no fault in the scenes seen until then"


def test_a_report_that_is_not_judged_is_neither_right_nor_wrong() -> None:
    checks = ["repeats-itself", "rejects-unknown-options"]
    report = check_broad_phase("slow", in_process=True, checks=checks, seconds=0.5)
    assert (report.exit_code, report.conforms, report.ok) == (4, None, False)
    assert str(report).endswith("slow is not judged: no fault was seen, and repeats-itself not ended")


def test_compiling_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    before = limits.spent()
    monkeypatch.setattr(limits, "compiling_seconds", lambda: compiling_seconds() + 1000.0)
    assert limits.spent() < before - 900.0


def test_a_failure_that_does_not_always_come_back_says_how_often() -> None:
    result = Court(Subject("moody", {}), examples=30, shrink=False).judge("same-contacts")
    assert result.status == "failed"
    times = int(result.said.rpartition("it failed ")[2].partition(")")[0])
    assert "(not every time: of 5 times more on this scene it failed" in result.said
    assert 1 <= times <= 2


def test_a_failure_that_comes_back_says_nothing_of_it() -> None:
    result = Court(Subject("wrong-if", {"wrong": 1}), examples=30, shrink=False).judge("same-contacts")
    assert "not every time" not in result.said


def test_a_saved_case_has_the_options_with_which_it_failed(tmp_path: Path) -> None:
    court = Court(Subject("wrong-if", {"wrong": 1}), examples=30, shrink=False, save_to=tmp_path)
    result = court.judge("same-contacts")
    assert result.case is not None
    case = load_case(result.case)
    assert (case.name, case.options, case.check) == ("wrong-if", {"wrong": 1}, "same-contacts")
    assert not replay("wrong-if", result.case).ok
    assert replay("wrong-if", result.case, options={"wrong": 0}).ok
    assert replay("naive", result.case).ok


def test_a_failure_in_the_gallery_is_saved_and_replayed(tmp_path: Path) -> None:
    court = Court(Subject("wrong-with-many", {}), examples=10, save_to=tmp_path)
    assert court.judge("same-contacts").ok
    result = court.judge("same-contacts-in-the-gallery")
    assert (result.status, result.bodies) == ("failed", 25)
    assert result.case is not None
    assert result.picture is not None
    assert load_case(result.case).check == "same-contacts"
    assert not replay("wrong-with-many", result.case).ok


def test_small_scenes_are_drawn_once_and_judged_by_the_reference_once() -> None:
    drawing, references = Drawing(10, seed=3), References()
    scenes = drawing.small(turns=False)
    assert drawing.small(turns=False) is scenes
    references.keep(scenes)
    assert references(scenes[0]) is references(scenes[0])
    assert references(scenes[0], 1) is not references(scenes[0])
    assert scenes == Drawing(10, seed=3).small(turns=False)


def test_what_fails_is_drawn_again_and_shrunk_without_looking_at_what_came_before() -> None:
    seen: list[Scene] = []

    def holds(scene: Scene) -> bool:
        seen.append(scene)
        return not any(scene.radius == 0.125)

    drawing = Drawing(60, seed=1)
    each = check_named("same-contacts")
    assert drawing.look(each, holds, shrink=True)
    first = next(at for at, scene in enumerate(drawing.small(turns=False)) if any(scene.radius == 0.125))
    assert seen[first + 1] == seen[first]
    smallest = min((scene for scene in seen if any(scene.radius == 0.125)), key=len)
    assert len(smallest) == 2


def test_what_a_hook_raises_is_where_the_author_wrote_it(monkeypatch: pytest.MonkeyPatch) -> None:
    class Raises(Slow):
        def prepare(self, scene: Scene) -> BroadPhaseParts:
            raise PhaseError("as it is")

    monkeypatch.setattr(Slow, "prepare", Raises.prepare)
    result = Court(Subject("slow", {}), examples=3, shrink=False).judge("same-contacts", "it raises")
    assert result.said.startswith("PhaseError: as it is")


def test_a_picture_shows_who_is_there() -> None:
    scene = Scene(
        [[1.0, 1.0], [3.0, 3.0]],
        [[0.5, 0.0], [0.0, 0.0]],
        0.25,
        arena=(4.0, 4.0),
        commands=[kt.Remove(0, 0.5), kt.Insert(1.0, (2.0, 2.0), (0.0, 0.0), 0.5)],
    )
    drawn = draw(Subject("sap-1d", {}), scene, "said")
    assert re.findall(r">(\d+)</text>", drawn) == ["1", "2"]
