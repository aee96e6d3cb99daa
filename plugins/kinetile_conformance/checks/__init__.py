"""The checks: all that a broad phase must do, in the order in which they are run and reported."""

from __future__ import annotations

from kinetile_conformance.checks import (
    askers,
    between_events,
    claims,
    living,
    memory,
    outcomes,
    pair_phases,
    ruled,
    swarms,
    views,
)
from kinetile_conformance.checks.check import Check

__all__ = ["CHECKS", "check_named"]

CHECKS: tuple[Check, ...] = (
    outcomes.same_contacts,
    outcomes.same_contacts_with_turns,
    memory.writes_only_where_it_may,
    memory.stays_within_its_arrays,
    swarms.same_contacts_in_a_swarm,
    living.same_contacts_as_bodies_come_and_go,
    living.its_structure_is_true_as_bodies_come_and_go,
    living.same_contacts_when_commanded_by_hand,
    outcomes.same_contacts_when_turned_by_hand,
    ruled.same_contacts_with_responses,
    ruled.same_contacts_while_some_pass,
    ruled.its_structure_is_true_while_some_pass,
    between_events.never_misses_a_pair,
    between_events.its_structure_is_true,
    between_events.near_is_mutual,
    between_events.structural_events_move_nothing,
    between_events.makes_progress,
    outcomes.repeats_itself,
    outcomes.instances_are_independent,
    outcomes.leaves_the_scene_alone,
    outcomes.stops_and_goes_on,
    outcomes.survives_being_built_anew,
    views.does_not_see_the_start,
    views.same_contacts_after_a_change_of_view,
    views.same_contacts_back_in_time,
    outcomes.survives_the_smallest_scenes,
    outcomes.same_contacts_in_the_gallery,
    swarms.same_contacts_beside_giants,
    swarms.same_contacts_on_lattices,
    swarms.same_contacts_in_a_marathon,
    pair_phases.same_contacts_with_loose_bounds,
    claims.near_holds_while_bodies_pass,
    claims.skin_limit_holds_at_its_edge,
    claims.its_features_are_known,
    claims.state_is_not_kept,
    askers.does_not_see_who_asks,
    outcomes.rejects_unknown_options,
    between_events.pairs_are_overlapping_boxes,
    pair_phases.a_contact_depends_on_two_plans_alone,
)


def check_named(name: str) -> Check:
    """Return the check of a name; raise ValueError, with the names there are."""
    for each in CHECKS:
        if each.name == name:
            return each
    raise ValueError(f"there is no check {name!r}; there are: {', '.join(c.name for c in CHECKS)}")
