"""A failing case shown: an SVG of the moment at which two runs differ, and a page of the player that opens
there."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from kinetile.errors import BadOption, KinetileError
from kinetile.run.compare import first_difference
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.show.picture import take_picture
from kinetile.show.player import View, view_scene
from kinetile.show.player.view import Choice
from kinetile.show.svg import as_svg
from kinetile_conformance.cases import CONTACTS, REFERENCE, Subject, horizon, load_case, outcome


def view_saved(path: Path, on_trial: Choice | None, *, until: float | None) -> View | None:
    """Return ``view_case`` of a file that is a saved case, and None of any other scene."""
    return None if load_case(path).check is None else view_case(path, on_trial, until=until)


def view_case(
    path: str | os.PathLike[str], on_trial: Choice | None = None, *, until: float | None = None
) -> View:
    """Return a view of a saved case, which opens where the phase under test differs from the reference.

    ``on_trial`` is that phase; None: the one that the file names. Raises BadOption where there is none, and
    UnknownName where it is not registered here.
    """
    path = Path(path)
    case = load_case(path)
    if on_trial is None:
        if case.name is None:
            raise BadOption(f"{path} names no broad phase: expected a case that `kinetile conform` has saved")
        on_trial = (case.name, case.options)
    until = horizon(case.scene) if until is None else until
    choices = [(REFERENCE, {}), on_trial]
    title = f"{path.name}: {on_trial[0]} beside {REFERENCE}"
    named = Subject(REFERENCE, {}, case.narrow_phases)
    narrow = named.narrow_phases(case.scene) if case.narrow_phases else None
    notes = [] if case.check is None else [f"The check that failed: {case.check}."]
    return view_scene(
        case.scene,
        choices,
        until=until,
        title=title,
        max_contacts=CONTACTS,
        narrow_phases=narrow,
        notes=notes,
    )


def moment(subject: Subject, scene: Scene) -> Simulation:
    """Return a simulation under the reference, run to the first contact at which the subject differs."""
    reference = subject.reference
    agreed = first_difference(outcome(subject, scene).contacts, outcome(reference, scene).contacts)
    sim = reference.simulation(scene)
    with suppress(KinetileError):
        sim.run(until=horizon(scene), max_contacts=CONTACTS if agreed is None else agreed + 1)
    return sim


def draw(subject: Subject, scene: Scene, said: str) -> bytes:
    """Return the picture as SVG: discs with their numbers, an arrow along each velocity, the arena."""
    try:
        sim = moment(subject, scene)
    except Exception:  # a phase that crashes leaves only the start to be drawn
        sim = Simulation(scene, REFERENCE)
    picture = take_picture(sim, structure=False)
    first = said.partition("\n")[0]
    return as_svg(replace(picture, caption=f"{subject.name} at time {sim.time!r}: {first}"), velocities=True)
