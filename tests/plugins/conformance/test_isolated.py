"""The isolated runner: plugins that do harm are named, with their distribution, and the caller goes on."""

import os
import pickle
import random
import re
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hostile_phases
import kinetile as kt
from installing import OWN, write_metadata
from kinetile.errors import MissingExtra, PhaseError
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.toolbox import BroadPhaseParts
from kinetile_conformance import CHECKS, Report, Result, check_broad_phase, checks, deadline, processes
from kinetile_conformance.cases import Subject, load_case
from kinetile_conformance.isolated import IsolatedRunner
from kinetile_conformance.processes import Child, Died, Message, in_a_child, pickled
from kinetile_conformance.runner import JudgingPlan, Runner
from kinetile_plugins.naive import near as everyone
from lanes import first
from messages import table
from registering import fixture

MIB = 1 << 20
OWNER = r" of hostile_phases \(added in this process\)"
HERE = r" \(hostile_phases\.py, line \d+\)"
OUT_OF_MEMORY = r"out of memory in check 'same-contacts': it asked for more than 0\.25 GiB"


_registered = fixture(hostile_phases)


def scene() -> kt.Scene:
    return kt.Scene([[1.0, 1.0], [2.0, 1.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25, arena=(4.0, 4.0))


def said_of(name: str) -> str:
    return f"broad phase '{name}'{OWNER}"


test_message = table(globals())


def test_everything_that_is_wrong_with_the_parts_is_said_at_once() -> None:
    with pytest.raises(PhaseError, match=f"^{said_of('returns-the-wrong-parts')}") as caught:
        kt.Simulation(scene(), "returns-the-wrong-parts")
    for said in (
        "room is -1; expected a whole number from 0 to 2147483647",
        "pairs is 0.5; expected a whole number",
        "state is (1, 2); expected a NamedTuple of arrays",
        "arrange is 7; expected a function or None",
        "audit is 'all'; expected a function or None",
        "expected arrays of int64",
    ):
        assert said in str(caught.value)
    assert NOTHING_IS_COMPILED or "near is a function; expected a function marked with toolbox.hook" in str(
        caught.value
    )


def isolated(name: str, *names: str, **more: Any) -> Report:
    return check_broad_phase(name, checks=names or ("same-contacts",), examples=4, **more)


@pytest.mark.small
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("crashes-in-arrange", f"the process died of SIGSEGV in check 'same-contacts', in crashes{HERE}"),
        pytest.param("takes-all-memory", OUT_OF_MEMORY, marks=pytest.mark.slow),
    ],
)
def test_a_death_is_a_result_that_names_check_distribution_and_cause(
    name: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    report = isolated(name, memory=256 * MIB, shrink=False)
    (result,) = report.results
    assert (result.status, report.exit_code) == ("died", 1)
    assert capfd.readouterr() == ("", "")
    assert re.fullmatch(rf"{said} \({said_of(name)}\)", result.said)
    assert report.distribution == "this process"


@pytest.mark.slow
def test_an_endless_loop_is_ended_and_located(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deadline, "SCENE_SECONDS", 1.0)
    (result,) = isolated("hangs-in-arrange", shrink=False).results
    assert result.status == "died"
    assert re.match(rf"an endless loop in hangs{HERE}, in check 'same-contacts': ", result.said)
    assert result.verdict.startswith("only hangs-in-arrange")


@pytest.mark.slow
def test_a_slow_phase_was_taken_for_an_endless_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deadline, "SCENE_SECONDS", 1.0)
    (result,) = isolated("dawdles-in-arrange", shrink=False).results
    assert result.status == "not judged"
    assert result.reason == "1 CPU s are too few for it, in check 'same-contacts'; it comes to an end"


def test_processes_of_a_check_inherited_the_limit_of_its_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """A slow phase that was right ended there by SIGXCPU: "in a process of its own it does not run"."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    monkeypatch.setattr(deadline, "_limit", 5000.0)
    try:
        deadline.begin_scene()
        limited = resource.getrlimit(resource.RLIMIT_CPU)[0]
        spent, limit = in_a_child(hostile_phases.cpu_limit, Subject("naive", {}))
        assert limit == hard
        assert spent < 1000
        assert resource.getrlimit(resource.RLIMIT_CPU)[0] >= limited, "it goes on with a limit"
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.parametrize(
    ("function", "how"),
    [
        (hostile_phases.sends_half_a_message, "idle"),
        (hostile_phases.waits_for_one_that_computes, "idle"),
        (hostile_phases.leaves_a_process_behind, "exit"),
    ],
)
def test_a_child_that_sends_nothing_hung_the_judge(
    function: Any, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No time by the clock is a limit for one that computes: beside busy processes it takes any time."""
    monkeypatch.setattr(processes, "IDLE", 1.0)
    monkeypatch.setattr(processes, "PATROL", 0.1)
    child = Child(Subject("naive", {}), processes._themselves)
    with pytest.raises(Died) as caught:
        child.call(function)
    assert caught.value.how == how


def compiled(name: str, *kinds: tuple[object, object]) -> None:
    """Compiles a phase's loops for scenes with these arenas and masses, so that a child need not."""
    for arena, mass in kinds:
        still = kt.Scene([[1.0, 1.0], [2.0, 2.0]], np.zeros((2, 2)), 0.25, mass, arena)  # type: ignore[arg-type]
        kt.Simulation(still, name, turning=True).compile()


@pytest.mark.slow
@pytest.mark.skipif(NOTHING_IS_COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("hangs-in-a-hook", r"an endless loop in a compiled hook, in check '.*'"),
        ("names-without-room", "died of SIG[A-Z]+ in check '.*', in a compiled hook"),
    ],
)
def test_what_a_compiled_hook_does_stays_in_the_child(
    name: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deadline, "SCENE_SECONDS", 2.0)
    compiled(name, ((4.0, 4.0), 1.0))
    (result,) = isolated(name, "same-contacts-in-the-gallery").results
    assert not result.ok
    assert re.search(said, result.said)
    assert re.search(said_of(name), result.said)


@pytest.mark.slow
@pytest.mark.small
def test_the_other_checks_are_run_after_a_death() -> None:
    heard: list[Result] = []
    report = isolated(
        *("crashes-in-arrange", "same-contacts-with-turns", "its-features-are-known"),
        on_result=heard.append,
        shrink=False,
    )
    assert [result.status for result in report.results] == ["died", "passed"]
    assert tuple(heard) == report.results
    assert report.notes == ()


@pytest.mark.slow
@pytest.mark.small
def test_a_death_on_the_scenes_that_run_as_python_is_the_whole_report() -> None:
    report = isolated("crashes-in-arrange", "same-contacts", "its-features-are-known", shrink=False)
    assert [(result.check, result.status) for result in report.results] == [("same-contacts", "died")]


@pytest.mark.slow
def test_after_three_deaths_the_rest_is_not_run() -> None:
    # other checks have a child of their own, and a death in those that are run first ends it
    names = [each.name for each in CHECKS if each.observation.compares and each.name not in checks.FIRST]
    report = isolated("crashes-in-arrange", *names, shrink=False)
    assert [result.status for result in report.results if result.status != "skipped"] == ["died"] * 3
    assert report.notes == (f"not run, after 3 deaths: {', '.join(names[len(report.results) :])}",)
    assert names[-1] in str(report)
    assert not report.ok


class ExitsWithTwo:
    """A broad phase that does the smallest scene, and ends the process at a larger one."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        if len(scene) > 1:
            os._exit(7)
        return BroadPhaseParts(everyone)


_exits_with_two = fixture(kt.BroadPhaseSpec("exits-with-two", ExitsWithTwo), autouse=False)


@pytest.mark.slow
@pytest.mark.small
@pytest.mark.usefixtures("_exits_with_two")
def test_a_death_outside_of_checks_is_an_error_that_says_what_was_done() -> None:
    with closing(IsolatedRunner(JudgingPlan.of_phase("exits-with-two", {}))) as runner:
        with pytest.raises(PhaseError, match="the process ended itself with status 7 in a measurement"):
            runner.attempt("a measurement", Runner.smoke_test)
        assert "Runner" in runner.attempt("another", repr)  # in another child


@pytest.mark.slow
@pytest.mark.small
@pytest.mark.usefixtures("_exits_with_two")
def test_the_scene_of_a_death_is_saved_with_few_bodies(tmp_path: Path) -> None:
    (result,) = isolated("exits-with-two", "its-structure-is-true", save_to=tmp_path).results
    assert (result.status, result.bodies) == ("died", 2)
    assert result.case is not None
    case = load_case(result.case)
    assert (case.check, len(case.scene)) == ("its-structure-is-true", 2)


@pytest.mark.slow
def test_a_conforming_phase_passes_in_a_child_as_it_does_here() -> None:
    report = check_broad_phase("sap-1d", checks=["its-features-are-known", "same-contacts"], examples=4)
    assert [result.status for result in report.results] == ["passed", "passed"]
    assert (report.ok, report.distribution) == (True, f"kinetile {kt.__version__}")


def test_only_a_phase_of_this_process_needs_more_than_pickle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cloudpickle", None)
    assert pickle.loads(pickled(Subject("naive", {}), "more"))[2] == "more"
    with pytest.raises(MissingExtra, match="conformance"):
        pickled(Subject("hangs-in-arrange", {}))


@pytest.mark.slow
@pytest.mark.interpreted
def test_an_error_of_the_kit_is_told_with_its_traceback() -> None:
    report = isolated("breaks-the-kit", "same-contacts-with-responses", "same-contacts-in-a-swarm")
    machine, minimiser = report.results
    assert (minimiser.status, machine.status) == ("failed", "not judged")
    for said in (machine.reason, minimiser.said):
        assert "an error of the kit itself, not of the phase, in check " in said
        assert "\nTypeError: 'NoneType' object is not callable\n" in said
    assert "Traceback (most recent call last):\n" in machine.reason
    assert "\n             TypeError: " in str(report)
    assert minimiser.said.startswith("contact ")


FIRST, *OTHERS = random.Random(26).sample(range(12), 4)
"""After how many of the messages that follow a failure its child is killed, while it looks for a smaller
scene: it sends some 14. It goes on while they are read, so it is anywhere in its work when it dies."""


@pytest.mark.interpreted
@pytest.mark.parametrize("after", [FIRST, *(pytest.param(each, marks=pytest.mark.slow) for each in OTHERS)])
def test_a_failure_that_was_seen_is_not_lost(
    after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    receive, heard = Child.receive, list[Message]()

    def then_killed(self: Child) -> Message | None:
        message = receive(self)
        if message is not None and (heard or "seen" in message):
            heard.append(message)
            if len(heard) == after + 1:
                self._process.kill()
        return message

    monkeypatch.setattr(Child, "receive", then_killed)
    (result,) = isolated("is-wrong-and-slow", save_to=tmp_path).results
    assert result.status == "failed"
    assert re.search(r"and while a smaller scene was looked for, .* by SIGKILL", result.said)
    assert result.verdict.startswith("only is-wrong-and-slow")
    assert result.case is not None
    assert len(load_case(result.case).scene) == result.bodies


@pytest.fixture
def installed(tmp_path: Path) -> list[str]:
    """Makes the hostile phases known as a distribution; returns what PYTHONPATH must have."""
    write_metadata(tmp_path, "kinetile-hostile", "0.3", {"kinetile": {"hostile": "hostile_phases"}})
    return [str(tmp_path), str(Path(str(hostile_phases.__file__)).parent)]


ASK = """
import kinetile as kt
from kinetile_conformance import check_broad_phase
check_broad_phase({name!r}, checks=["same-contacts"])
"""


def gone(pid: int) -> bool:
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        try:
            state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.05)
    return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
@pytest.mark.parametrize("number", first(1, [signal.SIGKILL, signal.SIGINT]))
def test_the_child_goes_with_whoever_asked(number: int, installed: list[str], tmp_path: Path) -> None:
    noted = tmp_path / "pid"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*installed, *OWN]), "HOSTILE_PID": str(noted)}
    environment["TMPDIR"] = str(tmp_path / "temporary")
    (tmp_path / "temporary").mkdir()
    asking = subprocess.Popen(
        [sys.executable, "-c", ASK.format(name="hangs-in-arrange")],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        until = time.monotonic() + 60.0
        while not (noted.exists() and noted.read_text(encoding="utf-8")) and time.monotonic() < until:
            time.sleep(0.05)
        asking.send_signal(number)
        _, errors = asking.communicate(timeout=600)
    finally:
        asking.kill()
    assert asking.returncode != 0
    assert number != signal.SIGINT or "KeyboardInterrupt" in errors
    assert gone(int(noted.read_text(encoding="utf-8")))
    assert not [*(tmp_path / "temporary").glob("kinetile-child-*")]
