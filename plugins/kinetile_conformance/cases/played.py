"""A saved case in the player: the phase on trial beside the reference, at the moment where they part."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import BadOption
from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import WALLS
from kinetile.show.player import View, view_scene
from kinetile.show.player.recording import Recording
from kinetile.show.player.view import Choice
from kinetile_conformance.cases.runs import CONTACTS, REFERENCE, Subject, horizon
from kinetile_conformance.cases.saved import Case, load_case

__all__ = ["parting", "view_case", "view_saved"]


def view_saved(path: Path, on_trial: Choice | None, *, until: float | None) -> View | None:
    """Return ``view_case`` of a file that is a saved case, and None of any other scene."""
    return None if load_case(path).check is None else view_case(path, on_trial, until=until)


def view_case(
    path: str | os.PathLike[str], on_trial: Choice | None = None, *, until: float | None = None
) -> View:
    """Return a view of a saved case, which opens where the phase on trial parts from the reference.

    ``on_trial`` is the phase; None: the one that the file names. Raises BadOption where there is none, and
    UnknownName where it is not registered here.
    """
    path = Path(path)
    case: Case = load_case(path)
    if on_trial is None:
        if case.name is None:
            raise BadOption(f"{path} names no broad phase: expected a case that `kinetile conform` has saved")
        on_trial = (case.name, case.options)
    until = horizon(case.scene) if until is None else until
    choices = [(REFERENCE, {}), on_trial]
    title = f"{path.name}: {on_trial[0]} beside {REFERENCE}"
    narrow = Subject(REFERENCE, {}, case.narrow_phases).narrow_phases(case.scene)
    page = view_scene(
        case.scene, choices, until=until, title=title, max_contacts=CONTACTS, narrow_phases=narrow
    ).page
    tick, body, said = parting(*page.recordings)
    notes = [said] if case.check is None else [f"The check that failed: {case.check}.", said]
    return View(replace(page, notes=notes, open_at=tick, select=body))


def parting(reference: Recording, on_trial: Recording) -> tuple[int | None, int | None, str]:
    """Return the tick of the first row in which two recordings differ, a body of it, and a sentence about it;
    None, None, and that there is none."""
    right, found = reference.rows, on_trial.rows
    both = min(len(right), len(found))
    differ = np.flatnonzero(_exact(right[:both]) != _exact(found[:both]))
    at = int(differ[0]) if len(differ) else both
    if at == len(right) == len(found):
        return None, None, f"All {at} events are the same under {on_trial.label} and {reference.label}."
    rows = [(each.label, each.rows[at : at + 1]) for each in (reference, on_trial) if at < len(each.rows)]
    ticks = [int(row["epoch"][0]) * TICKS + int(row["tick"][0]) for _, row in rows]
    said = "; ".join(f"under {label} it is {_in_words(row[0])}" for label, row in rows)
    if len(rows) == 1:
        other = on_trial if at < len(right) else reference
        said += f"; under {other.label} there is none"
    return min(ticks), int(rows[0][1]["a"][0]), f"They part at event {at}: {said}."


def _exact(rows: NDArray[Any]) -> NDArray[Any]:
    """Return what of rows is the answer, comparable with ==."""
    return np.rec.fromarrays([rows[name] for name in ("epoch", "tick", "a", "b")])


def _in_words(row: Any) -> str:
    a, b = int(row["a"]), int(row["b"])
    partner = f"body {b}" if b >= 0 else f"the {WALLS[b]} wall" if b in WALLS else "a command"
    return f"body {a} with {partner} at time {float(row['time'])!r}"
