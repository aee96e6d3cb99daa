"""Another process compiles a loop while a run goes on as Python: whatever becomes of either."""

import copy
import json
import multiprocessing
import os
import pickle
import random
import resource
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import broken_phases
import kinetile as kt
from inside import engine_of
from kinetile.errors import PhaseError
from kinetile.kernel.compiled import NOTHING_IS_COMPILED, backend, compiled_by_default, composer
from kinetile.kernel.compiled.cache import is_whole
from kinetile.run import compile_loop
from kinetile.run.engine import engine, meanwhile
from kinetile.run.simulation import composition_of
from kinetile.toolbox import hook
from registering import registered

if NOTHING_IS_COMPILED or not hasattr(os, "posix_spawn"):
    pytest.skip("nothing is compiled, or no process is started", allow_module_level=True)
pytestmark = pytest.mark.compiled

SCENE, CONTACTS = kt.make_scene("random", bodies=6, seed=1), 200


@pytest.fixture(autouse=True)
def _as_without_tests(monkeypatch):
    """Runs begin as Python, with loops that nobody has compiled yet."""
    monkeypatch.setattr(composer, "_composed", {})
    with compiled_by_default(None):
        yield


@pytest.fixture
def started(monkeypatch):
    """Has no process started; returns what would have been."""
    found = []
    monkeypatch.setattr(os, "posix_spawn", lambda *given, **how: found.append(given) or 2**22)
    return found


@pytest.mark.parametrize(
    ("place", "value", "expected"),
    [
        (engine, {}, 1),
        (multiprocessing, {"parent_process": lambda: True}, 0),  # a worker
        (meanwhile, {"_PROCESS": -1}, 0),  # a fork
        (meanwhile, {"_processors": lambda: 1}, 0),
        (sys, {"executable": ""}, 0),
        (pickle, {"dump": lambda *given: 1 / 0}, 0),  # a scene of what is nowhere else
        (backend.numba.config, {"CACHE_DIR": "/dev/null"}, 0),  # nothing can be kept
    ],
    ids=str,
)
def test_a_process_is_started_where_it_may_be(place, value, expected, started, monkeypatch):
    for name, each in value.items():
        monkeypatch.setattr(place, name, each)
    sim = kt.Simulation(SCENE, "naive")
    of = engine_of(sim)
    process = meanwhile.compile_meanwhile(of.loop, of.composition, of.commands)
    assert (process is not meanwhile.NO_PROCESS) == len(started) == expected


def of_main(x):
    return x


of_main.__module__ = "__main__"


def test_a_live_run_had_another_loop_compiled_than_its_own(monkeypatch, tmp_path):
    """Its scene lost the room for insertions on the way, and a frame of a game waited for the compiler."""
    given: list[Any] = []
    monkeypatch.setattr(pickle, "dump", lambda value, file: given.append(value))
    monkeypatch.setattr(os, "posix_spawn", lambda *how, **more: 2**22)
    sim = kt.Simulation(SCENE, "naive", live=True)
    of = engine_of(sim)
    meanwhile.compile_meanwhile(of.loop, of.composition, of.commands)
    seen: list[Any] = []
    monkeypatch.setattr(compile_loop.Engine, "compile", lambda engine, wholly: seen.append(engine.loop))
    monkeypatch.setattr(compile_loop, "is_cached", lambda loop: False)
    monkeypatch.setattr(compile_loop, "folder", lambda: tmp_path)
    monkeypatch.setattr(os, "nice", lambda more: None)
    (tmp_path / "given").write_bytes(pickle.dumps(*given))
    with (tmp_path / "given").open() as file:
        monkeypatch.setattr(sys, "stdin", file)
        compile_loop.main()
    assert seen[0].made.py_func.__qualname__ == of.loop.made.py_func.__qualname__


def test_a_copy_of_a_run_for_a_debugger_was_compiled():
    sim = kt.Simulation(SCENE, "naive", compiled=False)
    assert not copy.deepcopy(sim).compiled


def test_no_process_is_started_for_hooks_of_main(started):
    sim = kt.Simulation(SCENE, "naive")
    loop, of = composer._compose(of_main, {}, "main", tuple), engine_of(sim)
    assert meanwhile.compile_meanwhile(loop, of.composition, of.commands) is meanwhile.NO_PROCESS
    assert not started


def test_a_run_waits_for_one_process_and_goes_over(monkeypatch):
    """Two runs of one loop have one process; while it works, neither is compiled."""
    process, lies_there = SimpleNamespace(runs=True), []
    wanted = kt.Simulation(SCENE, "naive", compiled=False)
    wanted.run(max_contacts=3 * CONTACTS)
    begun = []
    monkeypatch.setattr(engine, "compile_meanwhile", lambda *of: begun.append(of) or process)
    for each in (composer, engine):
        monkeypatch.setattr(each, "is_cached", lambda of: bool(lies_there))
    monkeypatch.setattr(composer, "WORTH", 1e-9)
    monkeypatch.setattr(engine, "UNNOTICED", 1e-9)
    sims = [kt.Simulation(SCENE, "naive") for _ in range(2)]
    for way in (False, True):
        lies_there.extend([1] * way)
        composition_of(sims[0]).loop(engine_of(sims[0]).commands)._looks_at = 0.0
        for sim in sims:
            sim.run(max_contacts=CONTACTS)
            assert sim.compiled is way
    process.runs = False
    for sim in sims:
        sim.run(max_contacts=CONTACTS)
        assert (sim.compiled, sim.fingerprint) == (True, wanted.fingerprint)
    assert len(begun) == 1


@hook
def near_in_words(k, s, body):
    for other in range(len(k.bodies)):
        k.near[other] = other
    return len(k.bodies) if f"{k.near[0]:3d}" else 0


@pytest.mark.slow
def test_a_hook_that_does_not_compile_is_warned_of_once_and_runs_as_python(caplog, monkeypatch):
    """Later, with compiled=True, it was not even an error."""
    monkeypatch.setattr(composer, "WORTH", 1e-9)
    monkeypatch.setattr(meanwhile, "_processors", lambda: 1)
    with registered(kt.BroadPhaseSpec("in-words", broken_phases.phase(near_in_words))):
        sims = [kt.Simulation(SCENE, "in-words") for _ in range(2)] + [kt.Simulation(SCENE, compiled=False)]
        for sim in sims:
            sim.run(max_contacts=CONTACTS)
        assert len({sim.fingerprint for sim in sims}) == 1
        assert [record.levelname for record in caplog.records] == ["WARNING"]
        assert "in-words" in caplog.text
        assert caplog.text.endswith("; it runs as Python\n")
        with pytest.raises(PhaseError, match=r"(?s)in-words.* do not compile"):
            kt.Simulation(SCENE, "in-words", compiled=True).run(max_contacts=1)


# Tries: runs in a fork of this process, which takes itself for a program of its own


class Try:
    """A job in a fork, with a cache of its own, and the compilers that it starts."""

    def __init__(self, place: Path, job: Callable[[Any], None]) -> None:
        self.place, self.cache, self.compilers, self.runs = place, place / "cache", [], []
        taken, given = os.pipe()
        self.process = os.fork()
        if not self.process:
            try:
                self._as_program(lambda **said: os.write(given, f"{json.dumps(said)}\n".encode()), job)
            finally:
                os._exit(0)
        os.close(given)
        self._lines = os.fdopen(taken)
        self.read(1)

    def _as_program(self, tell: Any, job: Callable[[Any], None]) -> None:
        os.setsid()
        meanwhile._PROCESS, spawn = os.getpid(), os.posix_spawn
        engine.UNNOTICED, composer.WORTH = 0.0, 1e9  # another process compiles, or none
        os.environ |= {"NUMBA_CACHE_DIR": str(self.cache), "TMPDIR": str(self.place / "tmp")}
        backend.numba.config.CACHE_DIR, tempfile.tempdir = str(self.cache), str(self.place / "tmp")

        def started(*given: Any, **how: Any) -> int:
            process = spawn(*given, **how)
            tell(compiler=process)
            return process

        os.posix_spawn = started
        job(tell)

    def read(self, most: int = 99) -> None:
        """Reads the fork's messages: up to the start of so many compilers, or all."""
        while len(self.compilers) < most and (line := self._lines.readline()):
            said = json.loads(line)
            self.compilers.extend([said["compiler"]] if "compiler" in said else [])
            self.runs.extend([said["run"]] if "run" in said else [])

    def wait(self) -> None:
        """Waits for the end of all processes, of the compilers a minute at most."""
        self.read()
        began = time.monotonic()
        while any(map(_runs, self.compilers)):
            assert time.monotonic() < began + 60.0
            time.sleep(0.05)

    def end(self) -> None:
        """Waits; then nothing is left but whole files of the cache."""
        self.wait()
        os.waitpid(self.process, 0)
        assert [*(self.place / "tmp").iterdir()] == []
        assert [each for each in self.cache.rglob("*") if each.is_file() and not is_whole(each)] == []


def _runs(process: int) -> bool:
    with suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


def run(tell, then=lambda: None):
    """Runs, and waits while a compiler is at work; sends the fingerprint, and True if the run went over."""
    sim = kt.Simulation(SCENE, "naive")
    loop = composition_of(sim).loop(engine_of(sim).commands)

    def progress(_):
        if loop.meanwhile is not None:
            then()
            while loop.meanwhile.runs:
                time.sleep(0.05)
        loop._looks_at = 0.0

    sim.run(max_contacts=CONTACTS, progress=progress)
    tell(run=[sim.fingerprint, sim.compiled])


def forking(tell):
    forks = []
    run(tell, lambda: forks or forks.append(os.fork()))
    if forks[0]:
        os.waitpid(forks[0], 0)


def in_threads(tell):
    threads = [threading.Thread(target=run, args=(tell,)) for _ in range(3)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()


def on_a_full_disk(tell):
    resource.setrlimit(resource.RLIMIT_FSIZE, (110_000, 110_000))  # enough for what is tried, not for a loop
    run(tell)


def killed(tried, names):
    with suppress(ProcessLookupError):  # it has ended
        os.kill(tried.compilers[0], signal.SIGKILL)


def parent_killed(tried, names):
    os.kill(tried.process, signal.SIGKILL)


def interrupted(tried, names):
    os.killpg(tried.process, signal.SIGINT)


def unwritable(tried, names):
    """There is a file where the folder was: root may write to any folder."""
    aside = tried.cache.rename(tried.place / "aside")
    tried.cache.write_bytes(b"")
    tried.wait()
    tried.cache.unlink()
    aside.rename(tried.cache)


def forged(tried, names):
    """Code that is no machine code, or another function's, has the names of the loop's files; what no one
    has read by the end is removed."""
    other = next(path for path in tried.cache.rglob("*.nbc") if path not in names).read_bytes()
    contents = [(name, [b"", b"forged", other][random.randrange(3)]) for name in names]
    for name, content in contents:
        name.write_bytes(content)
    tried.wait()
    for name, content in contents:
        if name.read_bytes() == content:
            name.unlink()


TRIES = {
    "undisturbed": (run, None, 1),
    "fork": (forking, None, 2),
    "threads": (in_threads, None, 3),
    "full disk": (on_a_full_disk, None, 1),
    "killed": (run, killed, 1),
    "unwritable": (run, unwritable, 1),
    "forged": (run, forged, 1),
    "parent killed": (run, parent_killed, 0),
    "interrupted": (run, interrupted, 0),
}
"""The run, the action on it, and the least number of runs that end."""


@pytest.fixture(scope="module")
def tries(tmp_path_factory):
    """A folder with the code of the loop's hooks, the files of the loop, and how long a compiler takes."""
    place = tmp_path_factory.mktemp("tries")
    (place / "tmp").mkdir()
    with compiled_by_default(None):
        Try(place, run).end()
        names, began = [*place.rglob("*advance_*.nb[ic]")], time.monotonic()
        for name in names:
            name.unlink()
        Try(place, run).end()
    assert sorted(name.suffix for name in names) == [".nbc", ".nbi"]
    return place, names, time.monotonic() - began


@pytest.mark.slow
@pytest.mark.parametrize("many", [1, pytest.param(22, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", TRIES)
def test_whatever_becomes_of_it_there_is_one_fingerprint_and_nothing_is_left(kind, many, tries):
    (place, names, took), (job, meddle, ended) = tries, TRIES[kind]
    wanted = kt.Simulation(SCENE, "naive", compiled=False)
    wanted.run(max_contacts=CONTACTS)
    for _ in range(many):
        for name in names:
            name.unlink(missing_ok=True)
        tried = Try(place, job)
        if meddle is not None:
            time.sleep(random.uniform(0.0, took))
            meddle(tried, names)
        tried.end()
        assert len(tried.compilers) == 1
        assert {fingerprint for fingerprint, _ in tried.runs} <= {wanted.fingerprint}
        assert len(tried.runs) >= ended
        assert kind not in ("undisturbed", "fork", "threads") or any(over for _, over in tried.runs)


@pytest.mark.slow
def test_two_processes_compile_their_loop_once(tries):
    place, names, _ = tries
    for name in names:
        name.unlink(missing_ok=True)
    both = [Try(place, run) for _ in range(2)]
    while not all(name.exists() and is_whole(name) for name in names):
        assert any(map(_runs, both[0].compilers + both[1].compilers))
        time.sleep(0.02)
    written = [name.stat().st_mtime_ns for name in names]
    for each in both:
        each.end()
        assert each.runs[0][1]
    assert [name.stat().st_mtime_ns for name in names] == written
