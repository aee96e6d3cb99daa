"""Narrow phases of others under the kit: what they may depend on is put to the test, in every interface."""

import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import pytest

import kinetile as kt
import square_pairs
from installing import install, run
from kinetile.errors import Refused
from kinetile.toolbox import NEVER, Kernel, PairParts, hook
from kinetile_conformance import check_broad_phase
from kinetile_conformance.api import replay
from kinetile_conformance.cases import GENERAL, Subject, load_case
from kinetile_conformance.view import view_saved
from lanes import first
from registering import fixture, registered

PLANS_ALONE = "a-contact-depends-on-two-plans-alone"
PROJECT = """
[project]
name = "kinetile-squares"
version = "0.1.0"

[project.entry-points.kinetile]
squares = "square_pairs"
"""
WALLED = kt.Scene([[1.0, 1.0], [3.0, 1.25]], [[1.0, 0.5], [-1.0, 0.0]], 0.5, arena=(4.0, 4.0))
OPEN = kt.Scene([[1.0, 1.0], [3.0, 1.25]], [[1.0, 0.5], [-1.0, 0.0]], 0.5)


@pytest.fixture(scope="module")
def squares(tmp_path_factory):
    """A folder in which square_pairs is installed, and how to run commands there."""
    folder = tmp_path_factory.mktemp("squares")
    (folder / "pyproject.toml").write_text(PROJECT, encoding="utf-8")
    shutil.copy(square_pairs.__file__, folder)
    paths = install(folder, folder / "site")

    def command(*words: object, **more: str):
        return run(*words, folder=folder, paths=paths, **more)

    return SimpleNamespace(folder=folder, run=command)


_added = fixture(square_pairs, autouse=False)
SHORT = ("same-contacts-with-turns", PLANS_ALONE)
"""Some checks whose runs are short enough to be interpreted; compiled, all are run."""

LEFT_OUT = {
    "its-structure-is-true-while-all-pass": "for a broad phase alone: judge it without a narrow phase named",
    "same-contacts-of-shapes": "for a broad phase alone: judge it without a narrow phase named",
    "same-contacts-as-shapes-come-and-go": "for a broad phase alone: judge it without a narrow phase named",
    "its-features-are-known": "for a broad phase alone: judge it without a narrow phase named",
}


@pytest.mark.slow
def test_a_narrow_phase_of_somebody_else_could_not_be_judged(squares):
    checks = [word for check in (*SHORT, *LEFT_OUT) for word in ("--check", check)]
    chosen = ("--narrow-phase", "squares:touches=true", "--examples", 3)
    done = squares.run("conform", "cells", *chosen, *checks)
    assert done.returncode == 0, done.stdout + done.stderr
    head, *lines = done.stdout.splitlines()
    with_squares = "broad phase 'cells' with narrow phase 'squares:touches=True', of kinetile"
    assert head.endswith(f"{with_squares} {kt.__version__}")
    assert lines[-1].startswith("cells with squares:touches=True conforms (")
    found = {check: line for line in lines for check in (*SHORT, *LEFT_OUT) if f" {check} " in line}
    assert {check: found[check].split()[0] for check in SHORT} == dict.fromkeys(SHORT, "passed")
    for check, reason in LEFT_OUT.items():
        assert found[check].split()[0] == "skipped"
        assert lines[lines.index(found[check]) + 1].endswith(reason)


FAULTS = {
    "now": "at a later present time|with nothing in the kernel's other tables",
    "order": "with the bodies numbered the other way round",
    "asked": "with nothing in the kernel's other tables|and should be body 0 with body 1",
    "writes": "meet or collide wrote stamps",
}


@pytest.mark.interpreted
@pytest.mark.usefixtures("_added")
@pytest.mark.parametrize("broad", ["naive", pytest.param("cells", marks=pytest.mark.slow)])
@pytest.mark.parametrize("fault", first(2, ["now", "writes", "order", "asked"]))
def test_a_wrong_narrow_phase_is_found(broad, fault, tmp_path):
    chosen = {"checks": [PLANS_ALONE], "examples": 40, "save_to": tmp_path, "in_process": True}
    report = check_broad_phase(broad, narrow_phases={"squares": {"fault": fault}}, **chosen)
    (result,) = report.results
    assert (result.status, report.exit_code) == ("failed", 1)
    assert re.search(FAULTS[fault], result.said)
    assert result.bodies in (2, 3)
    assert report.foot.endswith(f"{broad} with squares:fault={fault} does not conform: {PLANS_ALONE}")
    again = replay(broad, result.case)
    assert not again.ok
    assert re.search(FAULTS[fault], again.said)


def test_two_narrow_phases_for_pairs_are_no_choice(squares):
    done = squares.run("conform", "naive", "--narrow-phase", "disc", "--narrow-phase", "squares")
    assert done.returncode == 2
    assert "would decide nothing: of disc, squares the first" in done.stderr


@pytest.mark.interpreted
@pytest.mark.usefixtures("_added")
def test_a_narrow_phase_of_this_process_is_sent_to_the_child():
    """Though the broad phase is installed."""
    chosen = {"checks": [PLANS_ALONE], "examples": 4}
    report = check_broad_phase(
        "naive", narrow_phases={"squares": {"fault": "writes"}}, shrink=False, **chosen
    )
    assert [result.status for result in report.results] == ["failed"]


@pytest.mark.interpreted
@pytest.mark.usefixtures("_added")
def test_a_case_names_its_narrow_phases(tmp_path):
    wrong = {"squares": {"fault": "order"}}
    chosen = {"checks": [PLANS_ALONE], "examples": 40, "in_process": True, "explains": False}
    report = check_broad_phase("naive", narrow_phases=wrong, save_to=tmp_path, **chosen)
    assert [result.status for result in report.results] == ["failed"]
    assert report.subject.narrow == wrong
    case = load_case(report.results[0].case)
    assert case.narrow_phases == wrong
    page = view_saved(report.results[0].case).page
    assert [recording.label for recording in page.recordings] == ["naive", "naive"]
    chosen["examples"] = 4
    assert check_broad_phase("naive", narrow_phases=["squares"], **chosen).ok
    plain = check_broad_phase("naive", **chosen)
    assert [result.status for result in plain.results] == ["skipped"]
    assert plain.results[0].reason == "for a narrow phase for pairs that is named"


@pytest.mark.usefixtures("_added")
def test_each_named_phase_takes_the_place_of_the_usual_one_of_its_role():
    squares = Subject("naive", {}, {"squares": {"fault": "now"}})
    assert squares.pair == "squares"
    for scene in (WALLED, OPEN):
        assert squares.narrow_phases(scene) == {"squares": {"fault": "now"}, "wall": GENERAL}
    walls = Subject("naive", {}, {"wall": {}})
    assert (walls.pair, walls.narrow_phases(OPEN)) == (None, {"disc": GENERAL})
    usual = Subject("naive", {})
    assert (usual.pair, usual.narrow_phases(OPEN)) == (None, {"disc": GENERAL, "wall": GENERAL})
    named = WALLED.replace(settings=kt.Settings(narrow_phases=["squares"]))
    assert usual.narrow_phases(named) is None
    assert squares.under("cells") == Subject("cells", {}, {"squares": {"fault": "now"}})


@pytest.mark.usefixtures("_added")
def test_a_broad_phase_that_cannot_do_it_is_not_judged():
    with pytest.raises(Refused, match="touch at the sum of their radii"):
        check_broad_phase("sweep-tiling", narrow_phases=["squares"], in_process=True)


usual = kt.registry().target("narrow phase", "disc")(general=True).prepare(WALLED)


@hook
def meets_a_tick_late(k: Kernel, a: int, b: int) -> int:
    tick = usual.meet(k, a, b)
    return tick if tick == NEVER else tick + 1


@hook
def heats(k: Kernel, a: int, b: int) -> float:
    depth = usual.collide(k, a, b)
    k.bodies[a].vx *= 1.0 + 2.0**-20
    return depth


@hook
def late_beyond_a_time(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    first, second, who = usual.soonest(k, body, count, barred, at)
    return first if first < 100.0 else 2.0 * first, second, who


WRONG = {
    "meet": (meets_a_tick_late, "discs-meet-at-the-tick-of-the-specification", "by the specification"),
    "collide": (heats, "a-contact-adds-no-energy", "a meeting of .* adds .*e-0[67] of energy"),
    "soonest": (
        late_beyond_a_time,
        "its-bounds-are-never-late",
        "2.[048] times as slow, .* and the bound is",
    ),
}
OF_PAIRS = [check for _, check, _ in WRONG.values()]


class Disc:
    def __init__(self, hook: str = "") -> None:
        self.parts = replace(usual, **({hook: WRONG[hook][0]} if hook else {}))

    def prepare(self, scene: kt.Scene) -> PairParts:
        return self.parts


@pytest.mark.interpreted
@pytest.mark.parametrize("hook", first(2, ["", *WRONG]))
def test_what_is_wrong_under_every_broad_phase_was_not_seen(hook):
    with registered(kt.NarrowPhaseSpec("trial-disc", Disc, role="pair")):
        chosen = {"narrow_phases": {"trial-disc": {"hook": hook}}, "checks": OF_PAIRS, "in_process": True}
        report = check_broad_phase(
            "naive", examples=40 if hook else 4, shrink=False, explains=False, **chosen
        )
    failed = {result.check: result.said for result in report.failed}
    if hook == "soonest":  # in slow scenes a late bound is a missing contact, which other checks see too
        failed = {check: said for check, said in failed.items() if "is missing" not in said}
    assert list(failed) == ([WRONG[hook][1]] if hook else []), str(report)
    assert all(re.search(WRONG[hook][2], said) for said in failed.values()), failed
