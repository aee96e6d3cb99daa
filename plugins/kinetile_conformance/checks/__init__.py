"""The checks: all that a broad phase must do, in the order in which they are run and reported."""

from __future__ import annotations

from kinetile_conformance.checks import (
    between_events,
    claims,
    commands,
    contacts,
    memory,
    metamorphic,
    narrow_phases,
    process_independence,
    side_effects,
)
from kinetile_conformance.checks.check import Check

__all__ = ["CHECKS", "check_named", "table"]

CHECKS: tuple[Check, ...] = (
    contacts.same_contacts,
    contacts.same_contacts_with_turns,
    memory.writes_only_where_it_may,
    memory.stays_within_its_arrays,
    contacts.same_contacts_in_a_swarm,
    commands.same_contacts_as_bodies_come_and_go,
    commands.its_structure_is_true_as_bodies_come_and_go,
    commands.same_contacts_when_commanded_by_hand,
    commands.same_contacts_with_responses,
    commands.same_contacts_while_some_pass,
    commands.its_structure_is_true_while_some_pass,
    commands.resumes_as_bodies_come_and_go,
    commands.same_contacts_as_shapes_come_and_go,
    between_events.never_misses_a_pair,
    between_events.its_structure_is_true,
    between_events.can_be_drawn,
    between_events.makes_progress,
    contacts.instances_are_independent,
    contacts.stops_and_goes_on,
    contacts.survives_being_built_anew,
    metamorphic.does_not_see_the_start,
    metamorphic.same_contacts_after_a_change_of_view,
    contacts.survives_the_smallest_scenes,
    contacts.same_contacts_in_the_gallery,
    *contacts.IN_LARGE_SCENES,
    narrow_phases.same_contacts_with_loose_bounds,
    claims.near_holds_while_bodies_pass,
    claims.skin_limit_holds_at_its_edge,
    claims.its_features_are_known,
    claims.state_is_not_kept,
    side_effects.leaves_the_process_alone,
    side_effects.memory_does_not_grow,
    side_effects.resumes_in_another_process,
    process_independence.does_not_see_who_asks,
    contacts.rejects_unknown_options,
    between_events.pairs_are_overlapping_boxes,
    narrow_phases.a_contact_depends_on_two_plans_alone,
    narrow_phases.a_contact_of_shapes_depends_on_two_plans_alone,
    narrow_phases.same_contacts_as_convex,
)


def check_named(name: str) -> Check:
    """Return the check of a name; raise ValueError, with the names there are."""
    for each in CHECKS:
        if each.name == name:
            return each
    raise ValueError(f"there is no check {name!r}; there are: {', '.join(c.name for c in CHECKS)}")


def table(examples: int) -> list[tuple[str, int, str]]:
    """Return the table of strategies and observations: for each check what draws its scenes, how many of
    them, and its name, which says what is observed. Rows of one strategy are together."""
    rows = [(each.strategy, each.count(examples), each.name) for each in CHECKS]
    order = list(dict.fromkeys(strategy for strategy, _, _ in rows))
    return sorted(rows, key=lambda row: order.index(row[0]))
