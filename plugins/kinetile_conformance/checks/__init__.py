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
    passing_strategy,
    passing_swarms,
    solid_strategy,
)
from kinetile_conformance.strategies.shapes import (
    shape_and_square_scenes,
    shape_scenes,
    shape_swarms,
    shape_torus_scenes,
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

TABLE: dict[Strategy | None, Cells] = {
    small_scenes: {
        runs.same_contacts: 1.0,
        runs.pairs_are_overlapping_boxes: 0.5,
        narrow_phases.a_contact_depends_on_two_plans_alone: 0.25,
        narrow_phases.its_bounds_are_never_late: 0.25,
        narrow_phases.discs_meet_at_the_tick_of_the_specification: 1.0,
        narrow_phases.walls_are_met_at_the_tick_of_the_specification: 0.25,
        narrow_phases.a_contact_adds_no_energy: 0.25,
        responses.a_response_depends_on_the_meeting_alone: 0.25,
        responses.a_response_adds_no_energy_that_says_so: 0.25,
    },
    turning_scenes: {
        runs.same_contacts: 1.0,
        runs.never_misses_a_pair: 0.3,
        runs.its_structure_is_true: 0.15,
        runs.can_be_drawn: 0.2,
        runs.resumes: 0.24,
        claims.state_is_not_kept: 0.3,
        claims.same_contacts_after_a_change_of_view: 0.36,
    },
    None: {
        memory.writes_only_where_it_may: 0.0,
        side_effects.leaves_the_process_alone: 0.0,
        side_effects.memory_does_not_grow: 0.0,
        process_independence.does_not_see_who_asks: 0.0,
        claims.skin_limit_holds_at_its_edge: 0.0,
        claims.its_features_are_known: 0.0,
        claims.rejects_unknown_options: 0.0,
    },
    swarm_scenes: {
        runs.same_contacts: 0.5,
        runs.never_misses_a_pair: 0.25,
        runs.its_structure_is_true: 0.04,
        runs.can_be_drawn: 0.03,
        runs.resumes: 0.06,
    },
    living_strategy: {
        runs.same_contacts: 0.26,
        runs.never_misses_a_pair: 0.06,
        runs.its_structure_is_true: 0.12,
        runs.can_be_drawn: 0.03,
        runs.same_contacts_when_commanded_by_hand: 0.08,
        runs.resumes: 0.06,
    },
    solid_strategy: {runs.same_contacts: 0.06},
    passing_strategy: {
        runs.same_contacts: 0.06,
        runs.never_misses_a_pair: 0.03,
        runs.its_structure_is_true: 0.04,
        runs.can_be_drawn: 0.02,
        runs.same_contacts_when_commanded_by_hand: 0.02,
        runs.resumes: 0.03,
    },
    passing_swarms: {runs.never_misses_a_pair: 0.12},
    gallery_scenes: {runs.same_contacts: 1.0},
    giant_scenes: {runs.same_contacts: 0.3, claims.state_is_not_kept: 0.06},
    lattice_scenes: {runs.same_contacts: 0.5},
    scaled_scenes: {runs.same_contacts: 0.6},
    burst_scenes: {runs.same_contacts: 0.3},
    corridor_scenes: {runs.same_contacts: 0.24},
    torus_scenes: {
        runs.same_contacts: 0.3,
        runs.never_misses_a_pair: 0.1,
        runs.its_structure_is_true: 0.06,
        runs.can_be_drawn: 0.06,
        runs.resumes: 0.1,
    },
    torus_swarms: {
        runs.same_contacts: 0.6,
        runs.never_misses_a_pair: 0.2,
        runs.its_structure_is_true: 0.1,
        runs.can_be_drawn: 0.05,
        runs.resumes: 0.15,
    },
    living_torus_strategy: {
        runs.same_contacts: 0.12,
        runs.never_misses_a_pair: 0.06,
        runs.its_structure_is_true: 0.06,
        runs.can_be_drawn: 0.03,
        runs.same_contacts_when_commanded_by_hand: 0.04,
        runs.resumes: 0.06,
    },
    kind_scenes: {
        runs.same_contacts: 0.08,
        runs.never_misses_a_pair: 0.03,
        runs.its_structure_is_true: 0.03,
        runs.can_be_drawn: 0.02,
        runs.resumes: 0.02,
        responses.a_response_depends_on_the_meeting_alone: 0.03,
    },
    shape_scenes: {runs.same_contacts: 0.24, runs.its_structure_is_true: 0.06, runs.resumes: 0.06},
    shape_torus_scenes: {runs.same_contacts: 0.12, runs.its_structure_is_true: 0.05, runs.resumes: 0.04},
    shape_swarms: {
        runs.same_contacts: 0.14,
        runs.never_misses_a_pair: 0.06,
        runs.its_structure_is_true: 0.04,
        runs.can_be_drawn: 0.04,
        runs.resumes: 0.05,
    },
    shape_torus_swarms: {
        runs.same_contacts: 0.14,
        runs.never_misses_a_pair: 0.06,
        runs.its_structure_is_true: 0.04,
        runs.can_be_drawn: 0.04,
        runs.resumes: 0.05,
    },
    living_shape_strategy: {
        runs.same_contacts: 0.04,
        runs.never_misses_a_pair: 0.02,
        runs.its_structure_is_true: 0.04,
        runs.can_be_drawn: 0.02,
        runs.same_contacts_when_commanded_by_hand: 0.02,
        runs.resumes: 0.02,
    },
    large_scenes: {runs.same_contacts: 0.01, runs.never_misses_a_pair: 0.01, runs.resumes: 0.01},
    marathon_scenes: {runs.same_contacts: 0.03},
    shape_and_square_scenes: {
        narrow_phases.a_contact_depends_on_two_plans_alone: 0.25,
        narrow_phases.its_bounds_are_never_late: 0.25,
        narrow_phases.a_contact_adds_no_energy: 0.25,
        narrow_phases.same_contacts_as_convex: 0.5,
    },
}
"""For each strategy the observations on its scenes, and how many scenes for each of ``--examples``; None:
observations that have scenes of their own. The first strategy of an observation is where it is at home."""

_AT_STOPS = "it takes O(n^2) at each stop: what these scenes add is in their contacts"
_ON_SMALL_SCENES = "few bodies show it, at a hundredth of the cost"
OTHERWISE: dict[Observation, str] = {
    runs.never_misses_a_pair: _AT_STOPS,
    runs.its_structure_is_true: _AT_STOPS,
    runs.can_be_drawn: _AT_STOPS,
    runs.resumes: "a scene is saved by bodies, plans and commands: other scenes have all of these",
    runs.same_contacts_when_commanded_by_hand: "no body comes or goes in these scenes",
    runs.pairs_are_overlapping_boxes: _ON_SMALL_SCENES,
    claims.state_is_not_kept: _ON_SMALL_SCENES,
    claims.same_contacts_after_a_change_of_view: "seen from elsewhere it is another scene of its strategy",
    narrow_phases.same_contacts_as_convex: "discs have the contacts of the reference",
} | dict.fromkeys(
    (
        narrow_phases.a_contact_depends_on_two_plans_alone,
        narrow_phases.its_bounds_are_never_late,
        narrow_phases.discs_meet_at_the_tick_of_the_specification,
        narrow_phases.walls_are_met_at_the_tick_of_the_specification,
        narrow_phases.a_contact_adds_no_energy,
        responses.a_response_depends_on_the_meeting_alone,
        responses.a_response_adds_no_energy_that_says_so,
    ),
    _ON_SMALL_SCENES,
)
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
