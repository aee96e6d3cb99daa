"""Errors come out of a worker process, and out of a copy, as they were raised."""

import copy
import importlib
import multiprocessing
import pickle
import pkgutil
import sys
from collections.abc import Iterator

import pytest

import kinetile as kt
from kinetile import errors
from kinetile.kernel.compiled import NotCompiled
from kinetile.plugin.registry import Failure
from kinetile.records.bounded import TooManyRows
from kinetile.run.pair_phases import NotTaken
from kinetile_accuracy.oracle.attempt import Undecided
from kinetile_bench.study.task import StudyStopped
from kinetile_conformance.checks.check import Disagreement, DoesNotApply
from kinetile_conformance.deadline import TimeIsUp
from kinetile_conformance.pipe import EngineError
from kinetile_conformance.processes import Died
from kinetile_conformance.watched_hooks import Breach

PLACED = {"time": 2.5, "bodies": [3, 1]}
RAISED: list[BaseException] = [
    errors.AuditError("an audit"),
    errors.BadOption("an option"),
    errors.BadPlugin("a plugin"),
    errors.BusyError("running"),
    errors.DuplicateName("two of a name"),
    errors.KinetileError("a sentence", 7),
    errors.MissedContactError("missed", **PLACED),
    errors.MissingExtra("Reading event files", "pyarrow", "records"),
    errors.NoRoom(lambda: "no room"),
    errors.NotJudged("a syntax error"),
    errors.PhaseError("a phase"),
    errors.PluginApiMismatch("2.0"),
    errors.RecordError("a file"),
    errors.Refused("a scene"),
    errors.SceneError([errors.Mistake("arena", "-1", "two lengths")], "mine.toml"),
    errors.StalledError("it stands"),
    errors.StudyError([errors.Mistake("seeds", "'x'", "whole numbers")], "mine.toml"),
    errors.UnawaitedContactError("not awaited", **PLACED),
    errors.TooThick("a skin"),
    errors.UnknownName(
        "broad phase", "sap", suggestion="sap-1d", available=["naive", "sap-1d"], failures=["broken: it is"]
    ),
    errors.ZenoError("jammed", **PLACED),
    Breach("an index"),
    Died("signal", -11, "", "Segmentation fault"),
    Disagreement("another contact"),
    DoesNotApply("no such claim"),
    EngineError("it does not start"),
    NotCompiled("a hook"),
    StudyStopped("no workers"),
    TimeIsUp(),
    TooManyRows("more than 10 rows"),
    NotTaken("a narrow phase"),
    Undecided("which is first", 1.5, (0, 2)),
]


class Foreign(Exception):
    """Errors that a plugin may raise: they can be pickled, and not be made again from that."""

    def __init__(self, one: int, two: int) -> None:
        super().__init__(f"{one} and {two}")


class Unwilling(Exception):
    def __reduce__(self) -> str:
        raise RuntimeError("not to be pickled")


PACKAGES = ("kinetile", "kinetile_plugins", "kinetile_conformance", "kinetile_accuracy", "kinetile_bench")


def modules() -> Iterator[str]:
    for package in PACKAGES:
        for module in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if module.name.split(".")[-1] != "__main__" and ".templates" not in module.name:
                yield module.name


def test_no_class_of_errors_is_forgotten_here():
    """That modules of the project define, once each module has been imported; others are caught in theirs."""
    found = set()
    for module in modules():
        importlib.import_module(module)
        classes = [each for each in vars(sys.modules[module]).values() if isinstance(each, type)]
        own = [each for each in classes if issubclass(each, BaseException) and each.__module__ == module]
        found |= {each for each in own if not each.__name__.startswith("_")}
    assert found == {type(error) for error in RAISED}


def same(one: BaseException, two: BaseException) -> bool:
    facts = [(type(e), str(e), repr(e), e.args, vars(e), getattr(e, "msg", None)) for e in (one, two)]
    return facts[0] == facts[1]


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
def test_an_error_that_did_not_come_back_from_a_pickle_or_a_copy(error):
    error.__notes__ = ["said later"]
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        assert same(pickle.loads(pickle.dumps(error, protocol)), error)
    assert same(copy.copy(error), error)
    assert same(copy.deepcopy(error), error)


@pytest.mark.parametrize("raised", [Foreign(1, 2), Unwilling("no"), Exception(lambda: None)])
def test_an_unknown_name_that_holds_an_error_which_cannot_be_pickled(raised):
    failures = [Failure("one", "one", raised), Failure("two", "two", ValueError("bad"))]
    error = errors.UnknownName("scene", "grid", failures=failures)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert again.failures == error.failures == tuple(map(str, failures))


def test_a_pool_that_waited_for_ever_for_an_error_gets_it():
    error, arguments = errors.SceneError, ([[0.0, 0.0]], [[0.0, 0.0]], -1.0)
    with multiprocessing.get_context("spawn").Pool(1) as pool, pytest.raises(error) as caught:
        pool.apply_async(kt.Scene, arguments).get(timeout=600)
    with pytest.raises(error) as here:
        kt.Scene(*arguments)
    assert str(caught.value) == str(here.value)
    assert vars(caught.value).keys() == vars(here.value).keys()


@pytest.mark.parametrize("kind", [errors.KinetileError, errors.RecordError, errors.BadOption])
def test_what_a_file_says_reached_the_terminal_as_it_is(kind):
    error = kind("mine\x1b[2J.kt:\n  at \r line \x9b3: \udc80" + "9" * 20_000)
    first, second = str(error).split("\n")
    assert (first, second[:29]) == (r"mine\x1b[2J.kt:", r"  at \r line \x9b3: \udc80999")
    assert len(second) < 11_000
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
