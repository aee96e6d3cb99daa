"""A failing case shown: an SVG of the moment at which two runs differ, and a page of the player that opens
there."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import BadOption, KinetileError
from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import WALLS
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.show.picture import take_picture
from kinetile.show.player import View, view_scene
from kinetile.show.player.recording import Recording
from kinetile.show.player.view import Choice
from kinetile.show.svg import as_svg
from kinetile_conformance.cases import CONTACTS, REFERENCE, Subject, horizon, load_case, outcome
from kinetile_conformance.compare import first_difference


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
    page = view_scene(
        case.scene, choices, until=until, title=title, max_contacts=CONTACTS, narrow_phases=narrow
    ).page
    tick, body, said = parting(*page.recordings)
    notes = [said] if case.check is None else [f"The check that failed: {case.check}.", said]
    return View(replace(page, notes=notes, open_at=tick, select=body))


def parting(reference: Recording, on_trial: Recording) -> tuple[int | None, int | None, str]:
    """Return the tick of the first row in which two recordings differ, a body of it, and a sentence about it;
    None, None and a sentence where they are the same."""
    right, found = reference.rows, on_trial.rows
    at = first_difference(_exact(right), _exact(found))
    if at is None:
        return (
            None,
            None,
            f"All {len(right)} events are the same under {on_trial.label} and {reference.label}.",
        )
    rows = [(each.label, each.rows[at : at + 1]) for each in (reference, on_trial) if at < len(each.rows)]
    ticks = [int(row["epoch"][0]) * TICKS + int(row["tick"][0]) for _, row in rows]
    said = "; ".join(f"under {label} it is {_in_words(row[0])}" for label, row in rows)
    if len(rows) == 1:
        other = on_trial if at < len(right) else reference
        said += f"; under {other.label} there is none"
    return min(ticks), int(rows[0][1]["a"][0]), f"They part at event {at}: {said}."


def _exact(rows: NDArray[Any]) -> NDArray[Any]:
    """Return the columns of rows that must agree."""
    return np.rec.fromarrays([rows[name] for name in ("epoch", "tick", "a", "b")])


def _in_words(row: Any) -> str:
    a, b = int(row["a"]), int(row["b"])
    partner = f"body {b}" if b >= 0 else f"the {WALLS[b]} wall" if b in WALLS else "a command"
    return f"body {a} with {partner} at time {float(row['time'])!r}"


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
