"""The checks: all that a broad phase must do, in the order in which they are run and reported.

``table.toml`` has them: for each strategy the observations that are made on its scenes, and on how many of
them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kinetile_conformance.checks import (
    claims,
    memory,
    narrow_phases,
    process_independence,
    responses,
    runs,
    side_effects,
)
from kinetile_conformance.checks.check import Check, Observation
from kinetile_conformance.strategies import bulk, gallery, kinds, living, shapes, small, swarms, torus
from kinetile_conformance.strategies.strategy import Draw, Strategy

__all__ = ["CHECKS", "OTHERWISE", "TABLE", "check_named", "table"]

DRAWS: dict[str, Draw] = {
    "small scenes": small.draw_small,
    "small scenes with turns": small.draw_turning,
    "swarms": swarms.swarms_of(swarms.KINDS),
    "giants": swarms.swarms_of(swarms.GIANTS),
    "bursts": swarms.swarms_of(swarms.BURSTS),
    "corridors": swarms.swarms_of(swarms.CORRIDORS),
    "scaled swarms": swarms.draw_scaled,
    "lattices": bulk.draw_lattices,
    "falling scenes": bulk.draw_falling,
    "marathons": bulk.draw_marathons,
    "large scenes": bulk.draw_large,
    "the gallery": gallery.draw_gallery,
    "many kinds": kinds.draw_kinds,
    "small scenes on a torus": torus.draw_few,
    "swarms on a torus": torus.draw_swarms,
    "shapes": shapes.draw_shapes,
    "shapes, and squares alone": shapes.draw_shapes_and_squares,
    "swarms of shapes": shapes.draw_swarms,
    "swarms of shapes on a torus": shapes.draw_swarms_on_a_torus,
    "living scenes": living.draw_played("living"),
    "living scenes with responses": living.draw_played("ruled"),
    "living scenes on a torus": living.draw_played("torus"),
    "living scenes of shapes": living.draw_played("shapes"),
    "swarms in which all pass": living.draw_passing,
}
"""What draws the scenes of each strategy."""

_MODULES = claims, memory, narrow_phases, process_independence, responses, runs, side_effects
OBSERVATIONS = {
    each.name: each for module in _MODULES for each in vars(module).values() if isinstance(each, Observation)
}
"""The observations by name."""

_READ: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("table.toml").read_text(encoding="utf-8")
)

OTHERWISE = {OBSERVATIONS[name]: why for why, names in _READ.pop("otherwise").items() for name in names}
"""Why an observation of drawn scenes is not made on the other strategies."""


def _cells(name: str, row: dict[str, Any]) -> tuple[Strategy | None, dict[Observation, float]]:
    """Return the strategy of a row, None where observations have scenes of their own, and what is looked at
    on its scenes: for each of ``--examples`` on how many."""
    cells = {OBSERVATIONS[each]: count / 100 for each, count in row.pop("observed").items()}
    return (Strategy(name, DRAWS[name], **row) if row else None), cells


TABLE = dict(_cells(*row) for row in _READ.items())
"""For each strategy the observations on its scenes. The first strategy of an observation is where it is at
home."""


def _checks() -> Iterator[Check]:
    at_home: set[str] = set()
    for strategy, cells in TABLE.items():
        for observation, share in cells.items():
            yield Check(observation, strategy, share, observation.name not in at_home)
            at_home.add(observation.name)


CHECKS: tuple[Check, ...] = tuple(_checks())


def check_named(name: str) -> Check:
    """Return the check of a name; raise ValueError, with the names there are."""
    for each in CHECKS:
        if each.name == name:
            return each
    raise ValueError(f"there is no check {name!r}; there are: {', '.join(c.name for c in CHECKS)}")


def most(strategy: Strategy, examples: int) -> int:
    """Return the number of scenes that are drawn of a strategy, for all its checks."""
    return max(each.count(examples) for each in CHECKS if each.strategy == strategy)


def table(examples: int) -> list[tuple[str, int, str]]:
    """Return the table of strategies and observations: for each check what draws its scenes, how many of
    them, and its name, which says what is observed. Rows of one strategy are together."""
    return [
        (each.strategy.name if each.strategy else "scenes of its own", each.count(examples), each.name)
        for each in CHECKS
    ]
