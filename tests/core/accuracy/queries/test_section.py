"""Query accuracy: the kernel's form holds, forms that are wrong are found out, and the findings say so."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kinetile.accuracy.queries import chains as query_chains
from kinetile.accuracy.queries import section as part
from kinetile.accuracy.queries.chains import chain_findings, line_chain, three_discs
from kinetile.accuracy.queries.climbing import CHILDREN, KEPT, STARTS, Climb, climb
from kinetile.accuracy.queries.families import FAMILIES, Family
from kinetile.accuracy.queries.forms import KERNEL, ask, batch_times, forms
from kinetile.accuracy.queries.questions import Queries
from kinetile.accuracy.queries.truth import Encounter, Plan
from kinetile.accuracy.queries.verdicts import QueryRow, Verdict, judge, query_row, tie_row
from kinetile.kernel.tables import NEVER
from kinetile.toolbox import Kernel, hook, since_anchor, ticks_after

COUNT = 400
UNIT = 1 << 52
ROUNDING = 13.0
"""What all roundings of the kernel's form add up to at worst, in units of 2^-53 times the separation."""


def measured(name: str, form: Any, count: int = COUNT) -> QueryRow:
    family = next(family for family in FAMILIES if family.name == name)
    asked = family.draw(count)
    ticks = ask(form, asked).tolist()
    verdicts = [judge(Encounter(*plans), tick) for plans, tick in zip(asked.plans(), ticks, strict=True)]
    return query_row(family, asked, "some form", verdicts, np.array([1.0, 2.0]))


@hook
def receding(k: Kernel, a: int, b: int) -> int:
    """The sign of d.v the wrong way round."""
    one = k.bodies[a]
    two = k.bodies[b]
    dx = two.x - one.x
    dy = two.y - one.y
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    reach = one.radius + two.radius
    approach = dx * vx + dy * vy
    root = approach * approach - (vx * vx + vy * vy) * (dx * dx + dy * dy - reach * reach)
    if not approach > 0.0 or not root > 0.0:
        return NEVER
    return ticks_after(k, one.anchor, 0.0)


@hook
def one_side_only(k: Kernel, a: int, b: int) -> int:
    """Compares d x v with R|v| without taking its absolute value, and takes the farther root."""
    one = k.bodies[a]
    two = k.bodies[b]
    dx = two.x - one.x
    dy = two.y - one.y
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    reach = one.radius + two.radius
    approach = dx * vx + dy * vy
    speed2 = vx * vx + vy * vy
    cross = dx * vy - dy * vx
    if not approach < 0.0 or cross > reach * math.sqrt(speed2):
        return NEVER
    root = abs(reach * reach * speed2 - cross * cross)
    return ticks_after(k, one.anchor, (math.sqrt(root) - approach) / speed2)


@hook
def half_the_plane(k: Kernel, a: int, b: int) -> int:
    """Leaves out the absolute value the other way: misses every disc that passes on one side."""
    one = k.bodies[a]
    two = k.bodies[b]
    dx = two.x - one.x
    dy = two.y - one.y
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    reach = one.radius + two.radius
    approach = dx * vx + dy * vy
    speed2 = vx * vx + vy * vy
    cross = dx * vy - dy * vx
    root = reach * reach * speed2 - cross * cross
    if not approach < 0.0 or not root > 0.0 or cross < 0.0:
        return NEVER
    distance = math.sqrt(dx * dx + dy * dy)
    return ticks_after(k, one.anchor, (distance - reach) * (distance + reach) / (math.sqrt(root) - approach))


@hook
def without_anchors(k: Kernel, a: int, b: int) -> int:
    """Takes both discs to be where they were at their anchors."""
    one = k.bodies[a]
    two = k.bodies[b]
    since = max(one.anchor, two.anchor)
    dx = two.x - one.x
    dy = two.y - one.y
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    reach = one.radius + two.radius
    approach = dx * vx + dy * vy
    speed2 = vx * vx + vy * vy
    cross = dx * vy - dy * vx
    root = reach * reach * speed2 - cross * cross
    if not approach < 0.0 or not root > 0.0:
        return NEVER
    distance = math.sqrt(dx * dx + dy * dy)
    gap = max((distance - reach) * (distance + reach), 0.0)
    return ticks_after(k, since, gap / (math.sqrt(root) - approach))


@hook
def never_asks(k: Kernel, a: int, b: int) -> int:
    """Finds everything, at once."""
    since = max(k.bodies[a].anchor, k.bodies[b].anchor)
    return since if since_anchor(k, k.bodies[a], since) >= 0.0 else NEVER


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_the_kernel_holds_what_it_documents(family: Family) -> None:
    row = measured(family.name, forms()[KERNEL])
    assert row.hits > 0
    assert row.deepest_in_zones < 1.0 + 9.0 / 64.0  # by so much can rounding move the zone's edge
    assert row.false_positives == 0
    if not row.anchors_apart:
        assert row.depth_separation < ROUNDING
    assert row.depth_extent < ROUNDING
    if "grazing" not in family.name and "touching" not in family.name:
        assert row.false_negatives == 0


def test_textbook_forms_lose_the_square_of_the_distance() -> None:
    """The cross product loses the distance; the kernel, whose tick is the exact one rounded down, nothing."""
    ours = measured("far apart", forms()[KERNEL])
    assert ours.depth == 0.0
    assert ours.error_p99 is not None
    cross = measured("far apart", forms()["cross product"])
    assert cross.depth > 0.0
    for name in ("naive", "citardauq"):
        theirs = measured("far apart", forms()[name])
        assert theirs.depth > 1e3 * cross.depth
        assert theirs.error_p99 is not None
        assert theirs.error_p99 > 1e4 * ours.error_p99


def test_textbook_forms_find_contacts_that_are_none_and_miss_some() -> None:
    for name in ("naive", "citardauq", "cross product"):
        row = measured("grazing, ulps", forms()[name])
        assert row.false_negatives > 0
        assert row.false_positives > 0
        assert 0.0 < row.widest_false < 1e-14


def test_a_wrong_sign_misses_every_contact() -> None:
    row = measured("generic", receding)
    assert row.false_negatives == row.outside_dead_zone == row.hits > 0
    assert row.deepest_missed > 0.9
    assert row.error_max is None
    assert row.late is None
    assert row.depth == 0.0


def test_an_absolute_value_left_out_finds_contacts_that_are_none_and_the_far_root_is_late() -> None:
    row = measured("generic", one_side_only)
    assert row.false_positives > 20
    assert row.widest_false > 0.5
    assert row.late == 1.0
    assert row.depth > 0.9


def test_half_the_plane_left_out_misses_half() -> None:
    row = measured("generic", half_the_plane)
    assert 0.3 * row.hits < row.outside_dead_zone < 0.7 * row.hits
    assert row.false_positives == 0
    assert row.depth_separation < ROUNDING


def test_anchors_left_out_are_noticed_where_they_differ() -> None:
    assert measured("generic", without_anchors).outside_dead_zone == 0
    row = measured("anchors apart", without_anchors)
    assert row.outside_dead_zone > 20
    assert row.false_positives > 20


def test_a_form_that_finds_everything_is_wrong_where_discs_pass() -> None:
    row = measured("generic", never_asks)
    assert row.false_negatives == 0
    assert row.false_positives == row.queries - row.hits
    assert row.late == 0.0
    assert row.exact == 0.0
    assert row.error_median is not None
    assert row.error_median > 0.1


def test_verdicts() -> None:
    one = Plan(0.0, 0.0, 0.0, 0.0, 0, 1.0)
    hit = Encounter(one, Plan(4.0, 0.0, -1.0, 0.0, 0, 1.0))
    assert judge(hit, 2 * UNIT) == Verdict(True, True)
    late = judge(hit, 2 * UNIT + (UNIT >> 10))
    assert (late.late, late.off, late.error) == (UNIT >> 10, UNIT >> 10, 2.0**-11)
    assert (late.depth, late.depth_separation, late.depth_extent) == (2.0**-11, 2.0**41, 2.0**40)
    early = judge(hit, 2 * UNIT - 4)
    assert (early.late, early.off, early.error, early.depth) == (-4.0, 4.0, 2.0**-51, 0.0)
    missed = judge(hit, NEVER)
    assert (missed.hit, missed.found, missed.missed) == (True, False, 1.0)
    assert missed.zones == pytest.approx(2.0 / (2.0**-47 * 6.0))
    passing = Encounter(one, Plan(4.0, 3.0, -1.0, 0.0, 0, 1.0))
    assert judge(passing, NEVER) == Verdict(False, False)
    assert judge(passing, UNIT) == Verdict(False, True, passing=0.5)
    far = Encounter(one, Plan(4.0, 0.0, -(2.0**-12), 0.0, 0, 1.0))
    assert judge(far, NEVER) == Verdict(True, False, too_far=True)
    assert judge(far, 8192 * UNIT) == Verdict(True, True)


def test_rows_count_what_the_verdicts_say() -> None:
    family = FAMILIES[0]
    verdicts = [
        Verdict(True, True, late=-0.5, error=1.0),
        Verdict(True, True, late=2.0, error=3.0, off=2.0, depth=0.25, depth_separation=7.0, depth_extent=5.0),
        Verdict(True, False, missed=0.5, zones=0.75),
        Verdict(True, False, missed=0.25, zones=1.5),
        Verdict(True, False, too_far=True),
        Verdict(False, True, passing=0.125),
        Verdict(False, False),
    ]
    row = query_row(family, family.draw(7), "form", verdicts, np.array([1.0, 2.0, 9.0]))
    assert (row.queries, row.hits, row.too_far, row.false_negatives, row.outside_dead_zone) == (7, 5, 1, 2, 1)
    assert (row.deepest_missed, row.deepest_in_zones) == (0.5, 1.5)
    assert (row.false_positives, row.widest_false) == (1, 0.125)
    assert (row.error_median, row.error_max, row.exact, row.late) == (2.0, 3.0, 0.5, 0.5)
    assert (row.ticks_max, row.depth, row.depth_separation, row.depth_extent) == (2.0, 0.25, 7.0, 5.0)
    assert (row.ns_median, row.batches, row.anchors_apart) == (2.0, 3, False)


def test_ties_are_counted_by_groups() -> None:
    answers = np.array([5, 5, 5, 7, 9, 8, 1], dtype=np.int64)
    row = tie_row(FAMILIES[0], "form", answers, 2)
    assert (row.groups, row.same, row.spread) == (3, 1 / 3, 2)
    answers[0] = NEVER
    assert tie_row(FAMILIES[0], "form", answers, 2).spread is None


def test_copies_get_one_tick_from_the_kernel() -> None:
    family = next(family for family in FAMILIES if family.name == "simultaneous, copies")
    row = tie_row(family, KERNEL, ask(forms()[KERNEL], family.draw(COUNT)), 8)
    assert (row.same, row.spread) == (1.0, 0)


def test_a_form_that_reports_a_fault_is_not_believed() -> None:
    inside = Queries(
        np.array([[[0.0, 0.0], [0.5, 0.0]]]),
        np.array([[[0.0, 0.0], [-1.0, 0.0]]]),
        np.ones((1, 2)),
        np.zeros((1, 2), dtype=np.int64),
    )
    with pytest.raises(RuntimeError, match="query 0"):
        ask(forms()[KERNEL], inside)


def test_batches_are_timed_in_turn() -> None:
    times = batch_times(forms(), FAMILIES[0].draw(50), batch=20, least=3)
    assert list(times) == list(forms())
    assert all(len(each) == 3 and (each >= 0.0).all() for each in times.values())
    assert len(batch_times(forms(), FAMILIES[0].draw(100), batch=20, least=3)[KERNEL]) == 5


CLIMBED = Climb(1_000, 5.75, 0.5)


def test_findings_say_what_is_wrong() -> None:
    good = query_row(FAMILIES[0], FAMILIES[0].draw(2), KERNEL, [Verdict(True, True)] * 2, np.ones(1))
    naive = replace(good, form="naive", depth=1e-4)
    others = [naive, replace(naive, form="citardauq", depth=2e-4)]
    said = part.query_findings([good, *others], CLIMBED)
    assert "No false negative of the kernel outside its dead zone in any of 1 families, 2 queries" in said[0]
    assert "No false positive" in said[1]
    assert "eta, is nowhere passed" in said[2]
    assert "finds an overlap of 5.75 × 2^-53 × the separation, and one of 0.5 eta" in said[3]
    assert "1e-4" not in said[4]
    assert "2e-4 R (citardauq, generic)" in said[4]
    assert all(claim.holds for claim in part.query_claims([good, *others], CLIMBED))
    bad = replace(good, false_negatives=3, outside_dead_zone=2, deepest_in_zones=1.25, false_positives=4)
    bad = replace(bad, depth_separation=6.5, depth_proved=1.5, widest_false=0.5)
    said = part.query_findings([bad, *others], CLIMBED)
    assert "misses contacts outside the dead zone" in said[0]
    assert "generic: 2 of 3" in said[0]
    assert "1.250 times" in said[0]
    assert "contacts that are none (generic: 4" in said[1]
    assert "sampled maximum of the overlap" in said[2]
    assert "6.50 × 2^-53" in said[2]
    assert "eta, is passed: the sample's largest is 1.5 of it" in said[2]
    assert not any(claim.holds for claim in part.query_claims([bad, *others], CLIMBED))
    said = part.query_findings([replace(bad, anchors_apart=True, depth_extent=0.5), *others], CLIMBED)
    assert "anchored before" in said[2]
    assert "generic 6.5" in said[2]


def test_the_overlap_is_judged_by_the_proved_bound_and_not_by_what_a_sample_happened_to_hold() -> None:
    """However one looks: a tick that is exact and rounded down has no overlap."""
    deepest = climb(12)
    assert deepest.queries == 12 * 2 * len(STARTS) * KEPT * CHILDREN
    assert deepest.depth_separation == deepest.depth_proved == 0.0


def test_the_proved_bound_of_a_query_is_eta() -> None:
    one, two = Plan(0.0, 0.0, 0.0, 0.0, 0, 1.0), Plan(4.0, 0.0, -1.0, 0.0, 0, 1.0)
    assert Encounter(one, two).proved == 16 * 2.0**-53 * 4.0 + 2 * 1.0 * 2.0**-52
    beyond = Plan(-4.0, 0.0, -8.0, 0.0, 0, 1.0), Plan(-8.0, 0.0, -7.0, 0.0, 0, 1.0)
    assert Encounter(*beyond).proved == 16 * 2.0**-53 * 22.0 + 2 * 8.0 * 2.0**-52, "until they meet"


def test_chains_on_a_line_keep_their_order_and_lose_a_tick_a_contact() -> None:
    one, many = line_chain("one disc", (1.0,), (1, 100))
    assert (one.contacts, one.wrong, many.contacts, many.wrong) == (1, 0, 100, 0)
    assert one.ticks_max < 3.0
    assert 10.0 < many.ticks_max < 300.0
    assert many.error_max < 1e-12
    for mass in ((1.0, 1.0), (1.0, 1e12)):
        (row,) = line_chain("two discs", mass, (50,))
        assert row.wrong == 0
        assert row.error_max < 1e-11


def test_chains_notice_a_contact_that_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    right = query_chains.line_contacts

    def wrong(*arguments: Any) -> Any:
        contacts = right(*arguments)
        contacts[5] = contacts[5]._replace(b=-2 if contacts[5].b == -1 else -1)
        return contacts

    monkeypatch.setattr(query_chains, "line_contacts", wrong)
    before, after = line_chain("one disc between two walls", (1.0,), (5, 10))
    assert (before.wrong, after.wrong) == (0, after.runs)
    assert math.isnan(after.error_max)
    two = replace(before, chain="two equal discs between two walls")
    heavy = replace(before, chain="two discs of mass 1 and 1e12 between two walls")
    said = chain_findings([before, after, two, heavy, *three_discs(20)])
    assert "order of the contacts is wrong" in said[0]


def test_a_third_disc_is_met_where_it_should_be() -> None:
    rows = three_discs(120)
    assert sum(row.runs for row in rows) == 120
    assert all(row.wrong == 0 and row.error_max < 1e-11 for row in rows)


def test_the_part_measures_every_family_and_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(part.COUNTS, "quick", 40)
    monkeypatch.setitem(part.ROUNDS, "quick", 1)
    monkeypatch.setitem(part.BATCHES, "quick", 1)
    monkeypatch.setattr(part, "BATCH", 20)
    monkeypatch.setitem(query_chains.LENGTHS, "quick", (1, 10))
    monkeypatch.setitem(query_chains.THREES, "quick", 20)
    told: list[tuple[str, int, int]] = []
    section = part.measure("quick", lambda *what: told.append(what))
    assert section.name == "queries"
    families, ties, chains, hardness = section.tables
    assert [row.family for row in hardness.rows] == [family.name for family in FAMILIES]
    assert [(row.family, row.form) for row in families.rows] == [
        (family.name, form) for family in FAMILIES for form in forms()
    ]
    assert len(ties.rows) == 2 * len(forms())
    assert len(chains.rows) == 3 * 2 + 3
    for table in section.tables:
        assert all(set(table.heads) <= set(vars(row)) for row in table.rows)
    assert told[-1][1] == told[-1][2] == len(FAMILIES) + 1
    assert any("each of 40 answers is the same tick" in finding for finding in section.findings)
    assert not any("outside the dead zone that it documents" in finding for finding in section.findings)


def test_the_pictures_can_be_drawn() -> None:
    pytest.importorskip("matplotlib")
    from kinetile.accuracy.drawing import house_style

    rows = [
        replace(measured(name, form), form=which)
        for name in ("generic", "grazing, ulps", "far apart")
        for which, form in forms().items()
    ]
    with house_style():
        for picture in part._pictures(rows):
            figure = picture.draw()
            (panel,) = figure.axes
            assert [label.get_text() for label in panel.get_yticklabels()] == list(
                dict.fromkeys(row.family for row in rows)
            )
            figure.draw_without_rendering()
