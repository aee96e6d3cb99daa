"""Replaying a case: one check on one scene, as the kit saved it or from anywhere else."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, Refused, one_of
from kinetile_conformance.cases import Case, Subject, load_case
from kinetile_conformance.checks import CHECKS
from kinetile_conformance.court.report import KIT_VERSION, Result
from kinetile_conformance.court.verdicts import Seen, applicable, verdict

__all__ = ["DEFAULT_CHECK", "replay"]

DEFAULT_CHECK = "same-contacts"
"""The check for a scene file that names none."""


def replay(
    name: str,
    path: str | os.PathLike[str],
    *,
    check: str | None = None,
    options: Mapping[str, Any] | None = None,
) -> Result:
    """Run a check on the scene of a file; return what came of it, with the verdict where it fails.

    Args:
        name: the name of the broad phase.
        path: a scene file; one that the kit has saved names the check that failed, and the narrow phases that
            were on trial.
        check: the name of the check; None: the one that the file names, or ``same-contacts``.
        options: options of the broad phase; where there are none, those that the file names for this phase.

    Raises:
        UnknownName, BadOption: there is no such phase, option, file or check, or the check takes no scene.
        SceneError: the file holds no scene.
        Refused: the phase cannot do this scene.
    """
    path = Path(path)
    case = _load(path)
    scene = case.scene
    wanted = check or case.check or DEFAULT_CHECK
    each = next((known for known in CHECKS if known.name == wanted), None)
    if each is None or not each.draws:
        known = one_of(wanted, [known.name for known in CHECKS if known.draws])
        where = f"{str(path)!r} names the check" if check is None else "the check is"
        raise BadOption(f"{where} {wanted!r}; expected one that takes a scene (kit {KIT_VERSION}): {known}")
    options = options or (case.options if name == case.name else {})
    subject = Subject(name, dict(options), case.narrow_phases)
    subject.simulation(scene)
    skipped = applicable(subject, each)
    if skipped is not None:
        raise BadOption(f"the check {each.name!r} does not apply to {name!r}: it is {skipped}")
    began = time.perf_counter()
    seen = Seen(each, subject)
    holds = seen.look(scene)
    if seen.refused:
        raise Refused(seen.refusal)
    return Result(
        each.name,
        each.sentence,
        "passed" if holds else "failed",
        1,
        time.perf_counter() - began,
        said=seen.said or "",
        verdict="" if holds else verdict(each, subject, scene),
        bodies=len(scene),
        case=path,
    )


def _load(path: Path) -> Case:
    """Return the case of a file; raise BadOption where it cannot be read."""
    if not path.is_file():
        raise BadOption(f"there is no scene file {str(path)!r}")
    try:
        return load_case(path)
    except OSError as error:
        raise BadOption(f"the scene file {str(path)!r} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BadOption(f"the scene file {str(path)!r} is not UTF-8 text") from error
