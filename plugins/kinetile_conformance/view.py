"""A page of the player that shows a failing case, and opens at the first difference of two runs."""

import os
from pathlib import Path

from kinetile.errors import BadOption
from kinetile.instruments import ShownPhase, View, view_scene
from kinetile_conformance.cases import CONTACTS, REFERENCE, Subject, horizon, load_case


def view_saved(
    path: str | os.PathLike[str], tested: ShownPhase | None = None, *, until: float | None = None
) -> View | None:
    """Returns a view of a saved case, which opens at the first difference of the phase under test
    (``tested``, or the phase that the file names) from the reference; None for any other scene. Raises
    BadOption if there is no such phase, and UnknownName if it is not registered here."""
    path = Path(path)
    case = load_case(path)
    if case.check is None:
        return None
    if tested is None:
        if case.name is None:
            raise BadOption(f"{path} names no broad phase: expected a case that `kinetile conform` has saved")
        tested = (case.name, case.options)
    named = Subject(REFERENCE, {}, case.narrow_phases)
    return view_scene(
        case.scene,
        [(REFERENCE, {}), tested],
        until=horizon(case.scene) if until is None else until,
        title=f"{path.name}: {tested[0]} beside {REFERENCE}",
        max_contacts=CONTACTS,
        narrow_phases=named.narrow_phases(case.scene) if case.narrow_phases else None,
        notes=[f"The check that failed: {case.check}."],
    )
