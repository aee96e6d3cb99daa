"""The check that a run does not depend on its process: name, environment, thread, date.

A phase that recognises the judge can be right for the judge alone. So the same scenes are run under other
names of the program and with other variables, in another thread on whose stack no judge stands, with other
ends and another origin, without the modules of a test, on each day of the week, as a worker of a pool, and in
a process of its own that has never loaded the kit.

The patched clock and the hidden modules are there for phases that exist in this process only: these cannot be
run in a process without the kit, and without them the mutants that err on Fridays, or that search
``sys.modules`` for the judge, conform.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinetile.scene import Scene, Settings, relabelled
from kinetile.scene.files import dumps_scene
from kinetile_conformance.cases import CONTACTS, Subject, horizon, provided, run_summary
from kinetile_conformance.checks.check import Disagreement, Reference, check
from kinetile_conformance.deadline import uncounted
from kinetile_conformance.processes import in_a_fork

Summaries = list[tuple[str, str, int]]
"""For each scene how its run ended, its fingerprint, and its number of events of all kinds."""

SIMULATE = """
from kinetile.errors import KinetileError
from kinetile.run.simulation import Simulation

def simulate(name, options, narrow, contacts, scenes, ends):
    found = []
    for scene, end in zip(scenes, ends):
        sim = Simulation(scene, name, options=options, narrow_phases=narrow, live=True, room=len(scene))
        ended = "ran"
        try:
            sim.run(until=end, max_contacts=contacts)
        except KinetileError as error:
            ended = type(error).__name__
        found.append((ended, sim.fingerprint, sim.readings.events))
    return found

def simulate_into(results, *arguments):
    try:
        results.append(simulate(*arguments))
    except BaseException as error:
        results.append(error)
"""
"""What runs in the other thread and in the other process: no file of the kit may be on its stack, not even
for a wrapper."""

STRANGER = f"""
import json, sys
import kinetile as kt
{SIMULATE}
name, options, narrow, contacts, *paths = sys.argv[1:]
scenes = [kt.load_scene(path) for path in paths]
found = simulate(
    name, json.loads(options), json.loads(narrow), int(contacts), scenes, [None] * len(scenes)
)
print(json.dumps(found))
"""
"""The program of the other process: it imports nothing of the kit."""

SIGNS = ("kinetile_conformance", "hypothesis", "pytest", "_pytest")
"""Modules by which a phase could recognise a judge."""


def _scenes() -> list[Scene]:
    """Return scenes with arenas: all phases do them."""
    from kinetile_conformance.strategies.bulk import lattices
    from kinetile_conformance.strategies.swarms import swarm

    crowd = Scene(
        [[0.5, 0.5], [1.5, 0.625], [2.5, 0.5], [0.5, 1.5], [1.625, 1.5]],
        [[1.0, 0.5], [-0.5, 1.0], [-1.0, 0.25], [0.75, -1.0], [0.25, -0.5]],
        0.375,
        arena=(3.0, 2.0),
        settings=Settings(until=16.0),
    )
    return [
        crowd,  # in which all meet all
        lattices(1, 1, arena=True),
        lattices(1, 7, arena=True),
        lattices(9, 2, arena=True),
        swarm("gas", 30),
        swarm("shear", 40, variation=1),
    ]


def _summaries(subject: Subject, scenes: list[Scene], ends: list[float]) -> Summaries:
    """Run scenes, each until its time; return their summaries."""
    return [run_summary(subject, scene, end) for scene, end in zip(scenes, ends, strict=True)]


@contextmanager
def _in_disguise(argv: list[str]) -> Iterator[None]:
    """Gives the process another name and other variables within this context, and hides the judge's
    modules."""
    before, variables = sys.argv, dict(os.environ)
    hidden = {
        name: module
        for name, module in sys.modules.items()
        if any(name == sign or name.startswith(f"{sign}.") for sign in SIGNS)
    }
    try:
        sys.argv = argv
        for name in [name for name in os.environ if name.startswith(("PYTEST", "HYPOTHESIS", "CI"))]:
            del os.environ[name]
        os.environ["KINETILE_PRODUCTION"] = "1"
        for name in hidden:
            del sys.modules[name]
        yield
    finally:
        sys.modules.update(hidden)
        os.environ.clear()
        os.environ.update(variables)
        sys.argv = before


@contextmanager
def _on_another_day(days: int) -> Iterator[None]:
    """Sets the clock forward within this context, by so many days and as many hours."""
    now, exactly = time.time, time.time_ns
    late = days * 86_400 + 3_600 * days
    try:
        time.time, time.time_ns = lambda: now() + late, lambda: exactly() + late * 10**9
        yield
    finally:
        time.time, time.time_ns = now, exactly


def _in_a_thread(subject: Subject, scenes: list[Scene], ends: list[float]) -> Summaries:
    """Run in a thread of another name, by code that stands in no file of the kit; raise what it raises."""
    found: list[Any] = []
    names: dict[str, Any] = {}
    exec(compile(SIMULATE, "simulate.py", "exec"), names)
    narrow = subject.narrow_phases(scenes[0])
    arguments = (found, subject.name, dict(subject.options), narrow, CONTACTS, scenes, ends)
    thread = threading.Thread(target=names["simulate_into"], args=arguments, name="worker-7")
    thread.start()
    thread.join()
    if isinstance(found[0], BaseException):
        raise found[0]
    return list(found[0])


def _as_a_worker(subject: Subject, scenes: list[Scene], ends: list[float]) -> Summaries:
    """Run in a worker of ``multiprocessing``."""
    try:
        return list(in_a_fork(lambda: _summaries(subject, scenes, ends)))
    except EOFError:
        raise Disagreement("as a worker of multiprocessing it does not run") from None


def _by_a_stranger(subject: Subject, scenes: list[Scene]) -> Summaries:
    """Run scenes in a fresh interpreter, in another folder, with another seed of hashes."""
    with tempfile.TemporaryDirectory(prefix="scenes-") as folder:
        paths = []
        for number, scene in enumerate(scenes):
            paths.append(Path(folder) / f"{number}.toml")
            paths[-1].write_text(dumps_scene(scene), encoding="utf-8")
        own = {
            name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", "HYPOTHESIS"))
        }
        own["PYTHONPATH"] = os.pathsep.join(os.path.abspath(each) for each in sys.path if each)
        own["PYTHONHASHSEED"] = "4711"
        command = [
            sys.executable,
            "-c",
            STRANGER,
            subject.name,
            json.dumps(dict(subject.options)),
            json.dumps(subject.narrow_phases(scenes[0])),
            str(CONTACTS),
        ]
        with uncounted():
            done = subprocess.run(
                [*command, *map(str, paths)], env=own, cwd=folder, capture_output=True, text=True, check=False
            )
    if done.returncode != 0:
        last = done.stderr.strip().rpartition("\n")[2] or f"it ended with {done.returncode}"
        raise Disagreement(f"in a process of its own it does not run: {last}")
    return [(ended, fingerprint, events) for ended, fingerprint, events in json.loads(done.stdout)]


def _relabelled(scenes: list[Scene], until: float | None) -> list[Scene]:
    """Return the same scenes with another end and origin."""
    origin = {"recipe": "production"}
    return [relabelled(each, settings=Settings(until=until), origin=origin) for each in scenes]


@check(draws=False)
def does_not_see_who_asks(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It does not see who asks: program, variables, thread, day, origin, and when the scene would end."""
    scenes = _scenes()
    ends = [horizon(each) for each in scenes]
    plain = _summaries(subject, scenes, ends)
    views: list[tuple[str, Callable[[], Summaries]]] = [
        (
            "with another origin and a later end",
            lambda: _summaries(subject, _relabelled(scenes, 2.0**20), ends),
        ),
        ("with another origin and no end", lambda: _summaries(subject, _relabelled(scenes, None), ends)),
        ("in another thread", lambda: _in_a_thread(subject, scenes, ends)),
    ]
    if hasattr(os, "fork"):
        views.append(("as a worker", lambda: _as_a_worker(subject, scenes, ends)))
    if all(each.distribution is not None for each in provided(subject)):
        views.append(("in a process of its own", lambda: _by_a_stranger(subject, scenes)))
    found = [(how, view()) for how, view in views]
    for argv in (["simulate", "production.toml"], [""]):
        with _in_disguise(argv):
            found.append(("under another name of the program", _summaries(subject, scenes, ends)))
    for days in range(1, 8):
        with _on_another_day(days):
            found.append((f"{days} days later", _summaries(subject, scenes[:1], ends[:1])))
    for how, summaries in found:
        for number, (one, other) in enumerate(zip(plain, summaries, strict=False)):
            if one != other:
                raise Disagreement(
                    f"{how}, the run {other[0]}, with {other[2]} events; before it {one[0]}, with {one[2]}"
                    + ("" if one[1] == other[1] else ", and the contacts are others"),
                    scenes[number],
                )
