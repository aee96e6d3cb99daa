"""The observation that a run does not depend on its process, its thread, or what else a scene says.

The same scenes are run with other ends and another origin, in another thread, and in another process, where
strings have other hashes and so sets another order. There a saved run goes on, too.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import kinetile as kt
from kinetile.scene import Scene, Settings, relabelled
from kinetile_conformance.cases import CONTACTS, Subject, horizon, run_summary
from kinetile_conformance.checks.check import Case, Disagreement, observation
from kinetile_conformance.processes import Died, in_a_child
from kinetile_conformance.strategies.bulk import lattices
from kinetile_conformance.strategies.swarms import swarm

Summaries = list[tuple[str, str]]
"""For each scene how its run ended, and its fingerprint."""

OTHER_HASHES = {"PYTHONHASHSEED": "4711"}
"""The environment of the other process: the order of a set is another one there."""


def _scenes() -> list[Scene]:
    """Return scenes with arenas: all phases accept them."""
    all_meet = Scene(
        [[0.5, 0.5], [1.5, 0.625], [2.5, 0.5], [0.5, 1.5], [1.625, 1.5]],
        [[1.0, 0.5], [-0.5, 1.0], [-1.0, 0.25], [0.75, -1.0], [0.25, -0.5]],
        0.375,
        arena=(3.0, 2.0),
        settings=Settings(until=16.0),
    )
    of_lattices = [lattices(count, seed, arena=True) for count, seed in ((1, 1), (1, 7), (9, 2))]
    return [all_meet, *of_lattices, swarm("gas", 30), swarm("shear", 40, variation=1)]


def _summaries(subject: Subject, scenes: list[Scene], ends: list[float]) -> Summaries:
    """Run scenes, each until its time; return their summaries."""
    return [run_summary(subject, scene, end) for scene, end in zip(scenes, ends, strict=True)]


def _elsewhere(
    subject: Subject, scenes: list[Scene], ends: list[float], saved: list[Path]
) -> tuple[Summaries, Summaries]:
    """Run scenes in another process, and go on there with saved simulations, first, while nothing else has
    run there; return the summaries of those that went on, and of the scenes."""
    return [_resumed(path, end) for path, end in zip(saved, ends, strict=True)], _summaries(
        subject, scenes, ends
    )


def _resumed(path: Path, end: float) -> tuple[str, str]:
    """Go on with a saved simulation; return its summary."""
    try:
        sim = kt.resume(path)
        sim.run(until=end, max_contacts=CONTACTS - len(sim.contacts))
    except Exception as error:  # a foreign phase may raise anything; the verdict says what
        return f"{type(error).__name__}: {error}", ""
    return "ran", sim.fingerprint


def _saved(subject: Subject, scenes: list[Scene], folder: str) -> list[Path]:
    """Save each scene after some of its contacts; return the files."""
    paths = [Path(folder) / f"saved-{at}" for at in range(len(scenes))]
    for scene, path in zip(scenes, paths, strict=True):
        sim = subject.simulation(scene)
        sim.run(until=horizon(scene), max_contacts=CONTACTS // 3)
        sim.save(path)
    return paths


def _relabelled(scenes: list[Scene], until: float | None) -> list[Scene]:
    """Return the same scenes with another end and origin."""
    origin = {"recipe": "production"}
    return [relabelled(each, settings=Settings(until=until), origin=origin) for each in scenes]


@observation()
def does_not_see_who_asks(case: Case) -> None:
    """Contacts do not depend on process, thread, origin, or the end of the scene; a saved run goes
    on in another process"""
    subject, scenes = case.subject, _scenes()
    ends = [horizon(each) for each in scenes]
    plain = _summaries(subject, scenes, ends)
    with TemporaryDirectory() as folder, ThreadPoolExecutor(1, thread_name_prefix="worker-7") as thread:
        saved = _saved(subject, scenes, folder)
        try:
            resumed, there = in_a_child(_elsewhere, subject, scenes, ends, saved, environment=OTHER_HASHES)
        except Died as died:
            raise Disagreement(f"in another process it does not run: {died}") from None
        views = {
            "with another origin and a later end": _summaries(subject, _relabelled(scenes, 2.0**20), ends),
            "with another origin and no end": _summaries(subject, _relabelled(scenes, None), ends),
            "in another thread": thread.submit(_summaries, subject, scenes, ends).result(),
            "in another process": there,
            "saved, and resumed in another process": resumed,
        }
    for how, summaries in views.items():
        for shown, one, other in zip(scenes, plain, summaries, strict=True):
            if one[0] != other[0]:
                raise Disagreement(f"{how}, the run {other[0]}; before it {one[0]}", shown)
            if one != other:
                raise Disagreement(f"{how}, the contacts are others", shown)
