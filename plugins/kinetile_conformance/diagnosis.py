"""The diagnosis: what authors usually did wrong where a check fails with such words.

A check sees a symptom, and the same few mistakes cause most of them. The first row of ``symptoms.toml`` that
applies is printed. That is a guess from experience and no judgement: it comes last in the text of a failure,
and begins with "often".
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kinetile_conformance.cases import Subject

OFTEN = "often: "


@dataclass(frozen=True)
class Symptom:
    """A kind of failure: what is ``often`` behind it, and whose failures it is: those of these ``checks``
    (none: of any), in whose words the regular expression ``pattern`` is found."""

    id: str
    often: str
    checks: Sequence[str] = ()
    pattern: str = ""


SYMPTOMS = tuple(
    Symptom(name, **row)
    for name, row in tomllib.loads(
        Path(__file__).with_name("symptoms.toml").read_text(encoding="utf-8")
    ).items()
)
"""The rows, the more particular ones first."""


def likely(check: str, said: str) -> str:
    """Return what authors usually did wrong where this check says so; "" where no row applies."""
    rows = (row for row in SYMPTOMS if not row.checks or check in row.checks)
    return next((row.often for row in rows if re.search(row.pattern, said)), "")


def diagnosed(check: str, said: str, subject: Subject) -> list[str]:
    """Return the line that ends such a failure, if there is one: diagnoses are for broad phases."""
    often = likely(check, said) if subject.pair is None else ""
    return [f"{OFTEN}{often}"] if often else []
