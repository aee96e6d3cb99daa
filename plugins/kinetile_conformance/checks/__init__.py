"""The checks: all that a broad phase must do, in the order in which they are run and reported.

``TABLE`` has them: for each strategy the observations that are made on its scenes, and on how many of them.
"""

from __future__ import annotations

from collections.abc import Iterator

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
from kinetile_conformance.strategies.bulk import large_scenes, lattice_scenes, marathon_scenes
from kinetile_conformance.strategies.gallery import gallery_scenes
from kinetile_conformance.strategies.kinds import kind_scenes
from kinetile_conformance.strategies.living import (
    living_shape_strategy,
    living_strategy,
    living_torus_strategy,
    passing_swarms,
    ruled_strategy,
)
from kinetile_conformance.strategies.shapes import (
    shape_and_square_scenes,
    shape_scenes,
    shape_swarms,
    shape_torus_swarms,
)
from kinetile_conformance.strategies.small import small_scenes, turning_scenes
from kinetile_conformance.strategies.strategy import Strategy
from kinetile_conformance.strategies.swarms import (
    burst_scenes,
    corridor_scenes,
    giant_scenes,
    scaled_scenes,
    swarm_scenes,
)
from kinetile_conformance.strategies.torus import torus_scenes, torus_swarms

__all__ = ["CHECKS", "OTHERWISE", "TABLE", "check_named", "table"]

Cells = dict[Observation, float]

RUNS = (
    *(runs.same_contacts, runs.its_structure_is_true, runs.can_be_drawn, runs.resumes),
    runs.same_contacts_when_commanded_by_hand,
)
OF_PAIRS = (
    *(narrow_phases.a_contact_depends_on_two_plans_alone, narrow_phases.its_bounds_are_never_late),
    narrow_phases.a_contact_adds_no_energy,
)
OF_DISCS = (
    narrow_phases.discs_meet_at_the_tick_of_the_specification,
    narrow_phases.walls_are_met_at_the_tick_of_the_specification,
)
OF_RESPONSES = (
    responses.a_response_depends_on_the_meeting_alone,
    responses.a_response_adds_no_energy_that_says_so,
)


def _runs(*shares: float) -> Cells:
    """Return shares of the first observations of ``RUNS``, without those of 0."""
    return {each: share for each, share in zip(RUNS, shares, strict=False) if share}


TABLE: dict[Strategy | None, Cells] = {
    small_scenes: {
        runs.same_contacts: 1.0,
        runs.pairs_are_overlapping_boxes: 0.5,
        **dict.fromkeys((*OF_PAIRS, *OF_RESPONSES), 0.25),
        **dict.fromkeys(OF_DISCS, 1.0),
    },
    turning_scenes: {
        **_runs(1.0, 0.2, 0.2, 0.2),
        claims.state_is_not_kept: 0.2,
        claims.same_contacts_after_a_change_of_view: 0.16,
    },
    None: dict.fromkeys(
        (
            *(memory.writes_only_where_it_may, side_effects.leaves_the_process_alone),
            *(side_effects.memory_does_not_grow, process_independence.does_not_see_who_asks),
            *(claims.skin_limit_holds_at_its_edge, claims.its_features_are_known),
            claims.rejects_unknown_options,
        ),
        0.0,
    ),
    swarm_scenes: _runs(0.5, 0.12, 0.03, 0.03),
    living_strategy: _runs(0.22, 0.12, 0.03, 0.06, 0.07),
    ruled_strategy: _runs(0.1, 0.06, 0.0, 0.0, 0.03),
    passing_swarms: _runs(0.0, 0.12),
    gallery_scenes: _runs(1.0),
    giant_scenes: {runs.same_contacts: 0.3, claims.state_is_not_kept: 0.06},
    lattice_scenes: _runs(0.5),
    scaled_scenes: _runs(0.6),
    burst_scenes: _runs(0.3),
    corridor_scenes: _runs(0.24),
    torus_scenes: _runs(0.3, 0.1, 0.03, 0.05),
    torus_swarms: _runs(0.6, 0.15, 0.05, 0.15),
    living_torus_strategy: _runs(0.12, 0.06, 0.03, 0.06, 0.04),
    kind_scenes: {
        **_runs(0.08, 0.03),
        responses.a_response_depends_on_the_meeting_alone: 0.03,
    },
    shape_scenes: _runs(0.24, 0.04, 0.0, 0.03),
    shape_swarms: _runs(0.14, 0.06, 0.04, 0.05),
    shape_torus_swarms: _runs(0.18, 0.06, 0.04, 0.05),
    living_shape_strategy: _runs(0.04, 0.04, 0.02, 0.02, 0.02),
    large_scenes: _runs(0.01, 0.01),
    marathon_scenes: _runs(0.03),
    shape_and_square_scenes: {**dict.fromkeys(OF_PAIRS, 0.25), narrow_phases.same_contacts_as_convex: 0.5},
}
"""For each strategy the observations on its scenes, and how many scenes for each of ``--examples``; None:
observations that have scenes of their own. The first strategy of an observation is where it is at home."""

_AT_STOPS = "it takes O(n^2) at each stop: what these scenes add is in their contacts"
_ON_SMALL_SCENES = "few bodies show it, at a hundredth of the cost"
OTHERWISE: dict[Observation, str] = {
    runs.its_structure_is_true: _AT_STOPS,
    runs.can_be_drawn: _AT_STOPS,
    runs.resumes: "a scene is saved by bodies, plans and commands: other scenes have all of these",
    runs.same_contacts_when_commanded_by_hand: "no body comes or goes in these scenes",
    runs.pairs_are_overlapping_boxes: _ON_SMALL_SCENES,
    claims.state_is_not_kept: _ON_SMALL_SCENES,
    claims.same_contacts_after_a_change_of_view: "seen from elsewhere it is another scene of its strategy",
    narrow_phases.same_contacts_as_convex: "discs have the contacts of the reference",
} | dict.fromkeys((*OF_PAIRS, *OF_DISCS, *OF_RESPONSES), _ON_SMALL_SCENES)
"""Why an observation of drawn scenes is not made on the other strategies."""


def _cells() -> Iterator[Check]:
    at_home: set[str] = set()
    for strategy, cells in TABLE.items():
        for observation, share in cells.items():
            yield Check(observation, strategy, share, observation.name not in at_home)
            at_home.add(observation.name)


CHECKS: tuple[Check, ...] = tuple(_cells())


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
