"""The check that a run does not depend on its process, its thread, or what a scene says beside the motion.

The same scenes are run with other ends and another origin, in another thread, and in another process, where
strings have other hashes and so sets another order.
"""

from __future__ import annotations

import threading
from typing import Any

from kinetile.scene import Scene, Settings, relabelled
from kinetile_conformance.cases import Subject, horizon, run_summary
from kinetile_conformance.checks.check import Disagreement, Reference, check
from kinetile_conformance.processes import Gone, in_a_child

Summaries = list[tuple[str, str, int]]
"""For each scene how its run ended, its fingerprint, and its number of events of all kinds."""

OTHER_HASHES = {"PYTHONHASHSEED": "4711"}
"""What the other process has: the order of a set is another one there."""


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


def _in_a_thread(*arguments: Any) -> Summaries:
    """Run in a thread of another name; raise what it raises."""
    found: list[Any] = []

    def run() -> None:
        try:
            found.append(_summaries(*arguments))
        except BaseException as error:
            found.append(error)

    thread = threading.Thread(target=run, name="worker-7")
    thread.start()
    thread.join()
    if isinstance(found[0], BaseException):
        raise found[0]
    return list(found[0])


def _in_another_process(*arguments: Any) -> Summaries:
    """Run in a fresh interpreter, in which strings have other hashes."""
    try:
        return list(in_a_child(_summaries, *arguments, environment=OTHER_HASHES))
    except Gone as gone:
        raise Disagreement(f"in another process it does not run: {gone}") from None


def _relabelled(scenes: list[Scene], until: float | None) -> list[Scene]:
    """Return the same scenes with another end and origin."""
    origin = {"recipe": "production"}
    return [relabelled(each, settings=Settings(until=until), origin=origin) for each in scenes]


@check(draws=False)
def does_not_see_who_asks(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It does not see who asks: process, thread, origin, and when the scene would end."""
    scenes = _scenes()
    ends = [horizon(each) for each in scenes]
    plain = _summaries(subject, scenes, ends)
    views = {
        "with another origin and a later end": _summaries(subject, _relabelled(scenes, 2.0**20), ends),
        "with another origin and no end": _summaries(subject, _relabelled(scenes, None), ends),
        "in another thread": _in_a_thread(subject, scenes, ends),
        "in another process": _in_another_process(subject, scenes, ends),
    }
    for how, summaries in views.items():
        for number, (one, other) in enumerate(zip(plain, summaries, strict=False)):
            if one != other:
                raise Disagreement(
                    f"{how}, the run {other[0]}, with {other[2]} events; before it {one[0]}, with {one[2]}"
                    + ("" if one[1] == other[1] else ", and the contacts are others"),
                    scenes[number],
                )
