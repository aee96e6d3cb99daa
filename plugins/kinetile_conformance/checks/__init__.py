"""The checks: all duties of a broad phase, in the order of runs and reports. ``table.toml`` has for each
strategy the observations on its scenes, and the number of scenes for each."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kinetile.errors import one_of
from kinetile_conformance.checks import claims, meetings, runs, side_effects
from kinetile_conformance.checks.check import Check, Observation
from kinetile_conformance.strategies import bulk, gallery, kinds, living, shapes, small, swarms, torus
from kinetile_conformance.strategies.strategy import Draw, Strategy

__all__ = ["CHECKS", "DRAWS", "FIRST", "OTHERWISE", "check_named", "table"]

DRAWS: dict[str, Draw] = {
    name: draw
    for module in (bulk, gallery, kinds, living, shapes, small, swarms, torus)
    for name, draw in module.DRAWS.items()
}

_MODULES = claims, meetings, runs, side_effects
OBSERVATIONS = {
    each.name: each for module in _MODULES for each in vars(module).values() if isinstance(each, Observation)
}

_READ: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("table.toml").read_text(encoding="utf-8")
)

OTHERWISE = {OBSERVATIONS[name]: why for why, names in _READ.pop("otherwise").items() for name in names}
"""Why an observation of drawn scenes is not made on the other strategies."""


def _checks() -> Iterator[Check]:
    at_home: set[str] = set()
    for name, row in _READ.items():
        cells = row.pop("observed")
        strategy = Strategy(name, DRAWS[name], **row) if row else None  # else they have their own scenes
        for observed, count in cells.items():
            yield Check(OBSERVATIONS[observed], strategy, count / 100, observed not in at_home)
            at_home.add(observed)


CHECKS: tuple[Check, ...] = tuple(_checks())
"""The first check of an observation is its home."""


FIRST = tuple(
    each.name
    for each in CHECKS
    if each.name in ("same-contacts", "its-structure-is-true", "writes-only-where-it-may")
    or (each.at_home and each.observation.judges in ("pair", "wall", "response"))
)
"""Checks that are run as Python first: few of their scenes show most errors."""


def check_named(name: str) -> Check:
    """Returns the check of a name; raises ValueError, which lists the names."""
    for each in CHECKS:
        if each.name == name:
            return each
    raise ValueError(f"there is no check {name!r}; expected {one_of(name, (c.name for c in CHECKS))}")


def most(strategy: Strategy, examples: int) -> int:
    """Returns the number of scenes to draw of a strategy, for all its checks."""
    return max(each.count(examples) for each in CHECKS if each.strategy == strategy)


def table(examples: int) -> list[tuple[str, int, str]]:
    """Returns the strategy, the number of scenes and the name of each check, strategy by strategy."""
    return [
        (each.strategy.name if each.strategy else "scenes of its own", each.count(examples), each.name)
        for each in CHECKS
    ]
