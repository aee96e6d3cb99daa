"""Query accuracy: the kernel's form holds, forms that are wrong are found out, and the findings say so."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kinetile.kernel.tables import NEVER
from kinetile.toolbox import Kernel, hook, since_anchor, ticks_after
from kinetile_accuracy.queries import chains as query_chains
from kinetile_accuracy.queries import section as part
from kinetile_accuracy.queries.chains import chain_findings, line_chain, three_discs
from kinetile_accuracy.queries.families import FAMILIES, Family
from kinetile_accuracy.queries.forms import KERNEL, ask, batch_times, forms
from kinetile_accuracy.queries.questions import Queries
from kinetile_accuracy.queries.truth import Encounter, Plan
from kinetile_accuracy.queries.verdicts import QueryRow, Verdict, judge, query_row, tie_row

COUNT = 400
UNIT = 1 << 52


def measured(name: str, form: Any, count: int = COUNT) -> QueryRow:
    family = next(family for family in FAMILIES if family.name == name)
    asked = family.draw(count)
    ticks = ask(form, asked).tolist()
    verdicts = [judge(Encounter(*plans), tick) for plans, tick in zip(asked.plans(), ticks, strict=True)]
    return query_row(family, "some form", verdicts, np.array([1.0, 2.0]))


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
def test_the_kernel_is_exact(family: Family) -> None:
    row = measured(family.name, forms()[KERNEL])
    assert row.hits > 0
    assert (row.wrong, row.missed, row.false) == (0, 0, 0)
    assert (row.late, row.ticks_max, row.error_max) == (0.0, 0.0, 0.0)
    assert row.depth_rho < 1.0


def test_textbook_forms_lose_the_square_of_the_distance() -> None:
    ours = measured("far apart", forms()[KERNEL])
    straight = measured("far apart", forms()["cross product"])
    for name in ("naive", "citardauq"):
        theirs = measured("far apart", forms()[name])
        assert theirs.depth > 1e3 * ours.depth
        assert theirs.error_p99 is not None
        assert straight.error_p99 is not None
        assert theirs.error_p99 > 1e4 * straight.error_p99 > 0.0


def test_textbook_forms_find_contacts_that_are_none_and_miss_some() -> None:
    for name in ("naive", "citardauq", "cross product"):
        row = measured("grazing, ulps", forms()[name])
        assert row.missed > 0
        assert row.false > 0
        assert row.wrong > row.missed + row.false
        assert 0.0 < row.widest_false < 1e-14


def test_a_wrong_sign_misses_every_contact() -> None:
    row = measured("generic", receding)
    assert row.missed == row.hits > 0
    assert row.wrong == row.missed + row.false
    assert row.deepest_missed > 0.9
    assert row.error_max is None
    assert row.late is None
    assert row.depth == 0.0


def test_an_absolute_value_left_out_finds_contacts_that_are_none_and_the_far_root_is_late() -> None:
    row = measured("generic", one_side_only)
    assert row.false > 20
    assert row.widest_false > 0.5
    assert row.late == 1.0


def test_half_the_plane_left_out_misses_half() -> None:
    row = measured("generic", half_the_plane)
    assert 0.3 * row.hits < row.missed < 0.7 * row.hits
    assert row.false == 0


def test_anchors_left_out_are_noticed_where_they_differ() -> None:
    assert measured("generic", without_anchors).missed == 0
    row = measured("anchors apart", without_anchors)
    assert row.missed > 20
    assert row.false > 20


def test_a_form_that_finds_everything_is_wrong_where_discs_pass() -> None:
    row = measured("generic", never_asks)
    assert row.missed == 0
    assert row.false == row.queries - row.hits
    assert row.wrong == row.queries
    assert row.late == 0.0
    assert row.error_max is not None
    assert row.error_max > 1.0


def test_verdicts() -> None:
    one = Plan(0.0, 0.0, 0.0, 0.0, 0, 1.0)
    hit = Encounter(one, Plan(4.0, 0.0, -1.0, 0.0, 0, 1.0))
    assert judge(hit, 2 * UNIT) == Verdict(True, True)
    late = judge(hit, 2 * UNIT + (UNIT >> 10))
    assert (late.off, late.error) == (UNIT >> 10, 2.0**-11)
    assert (late.depth, late.depth_rho) == (2.0**-11, 2.0**-10 / (16 * 2.0**-53 * 4.0))
    early = judge(hit, 2 * UNIT - 4)
    assert (early.off, early.error, early.depth) == (-4.0, 2.0**-51, 0.0)
    missed = judge(hit, NEVER)
    assert (missed.hit, missed.found, missed.missed) == (True, False, 1.0)
    passing = Encounter(one, Plan(4.0, 3.0, -1.0, 0.0, 0, 1.0))
    assert judge(passing, NEVER) == Verdict(False, False)
    assert judge(passing, UNIT) == Verdict(False, True, passing=0.5)
    far = Encounter(one, Plan(4.0, 0.0, -(2.0**-12), 0.0, 0, 1.0))
    assert judge(far, NEVER) == Verdict(False, False), "2^62 ticks or more away"
    assert judge(far, 8192 * UNIT) == Verdict(False, True)


def test_rows_count_what_the_verdicts_say() -> None:
    verdicts = [
        Verdict(True, True, off=-1.0, error=1.0),
        Verdict(True, True, off=2.0, error=3.0, depth=0.25, depth_rho=7.0),
        Verdict(True, True),
        Verdict(True, False, missed=0.5),
        Verdict(True, False, missed=0.25),
        Verdict(False, True, passing=0.125),
        Verdict(False, False),
    ]
    row = query_row(FAMILIES[0], "form", verdicts, np.array([1.0, 2.0, 9.0]))
    assert (row.queries, row.hits, row.wrong, row.missed, row.false) == (7, 5, 5, 2, 1)
    assert (row.deepest_missed, row.widest_false) == (0.5, 0.125)
    assert (row.error_max, row.ticks_max, row.late) == (3.0, 2.0, 1 / 3)
    assert (row.depth, row.depth_rho) == (0.25, 7.0)
    assert (row.ns_median, row.batches) == (2.0, 3)


def test_ties_are_counted_by_groups() -> None:
    answers = np.array([5, 5, 5, 7, 9, 8, 1], dtype=np.int64)
    row = tie_row(FAMILIES[0], "form", answers, 2)
    assert (row.groups, row.same, row.spread) == (3, 1 / 3, 2)
    answers[0] = NEVER
    assert tie_row(FAMILIES[0], "form", answers, 2).spread is None


def test_simultaneous_contacts_get_one_tick_from_the_kernel() -> None:
    for family in (family for family in FAMILIES if "simultaneous" in family.name):
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


def test_findings_say_what_is_wrong() -> None:
    good = query_row(FAMILIES[0], KERNEL, [Verdict(True, True)] * 2, np.ones(1))
    naive = replace(good, form="naive", depth=1e-4, wrong=1, missed=1)
    others = [naive, replace(naive, form="citardauq", depth=2e-4, missed=0, false=1)]
    said = part.query_findings([good, *others])
    assert "is the integer truth in each of 2 queries, 1 families" in said[0]
    assert "which bounds it" in said[1]
    assert "naive form: 50% to 50% of the answers" in said[2]
    assert "misses 1 contacts and finds 0 that are none; discs overlap by up to 1e-4 R (generic)" in said[2]
    assert "citardauq form: 50% to 50%" in said[3]
    assert "up to 2e-4 R" in said[3]
    assert all(claim.holds for claim in part.query_claims([good, *others]))
    bad = replace(good, wrong=7, missed=3, false=4, depth_rho=1.5)
    said = part.query_findings([bad, *others])
    assert "is not the exact one (generic: 7 of 2, 3 of them missed and 4 invented)" in said[0]
    assert "at most 1.5 rho (generic)" in said[1]
    assert "DOES NOT bound it" in said[1]
    assert not any(claim.holds for claim in part.query_claims([bad, *others]))


def test_one_wrong_answer_of_the_kernel_is_a_claim_that_does_not_hold() -> None:
    good = query_row(FAMILIES[0], KERNEL, [Verdict(True, True)] * 2, np.ones(1))
    exact, *rest = part.query_claims([replace(good, wrong=1)])
    assert exact.measured == "1 of 2 queries differ from the integer truth"
    assert not exact.holds
    assert all(claim.holds for claim in rest)


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
    monkeypatch.setitem(part.BATCHES, "quick", 1)
    monkeypatch.setattr(part, "BATCH", 20)
    monkeypatch.setitem(query_chains.LENGTHS, "quick", (1, 10))
    monkeypatch.setitem(query_chains.THREES, "quick", 20)
    told: list[tuple[str, int, int]] = []
    section = part.measure("quick", lambda *what: told.append(what))
    assert section.name == "queries"
    families, stages, ties, chains, hardness = section.tables
    assert [row.family for row in hardness.rows] == [family.name for family in FAMILIES]
    assert [(row.family, row.form) for row in families.rows] == [
        (family.name, form) for family in FAMILIES for form in forms()
    ]
    assert [row.family for row in stages.rows] == [family.name for family in FAMILIES]
    assert [table.name for table in section.tables if table.printed] == ["stages"]
    assert len(ties.rows) == 2 * len(forms())
    assert len(chains.rows) == 3 * 2 + 3
    for table in section.tables:
        assert all(set(table.heads) <= set(vars(row)) for row in table.rows)
    assert told[-1][1] == told[-1][2] == len(FAMILIES) + 1
    assert all(claim.holds for claim in section.claims)


def test_the_pictures_can_be_drawn() -> None:
    pytest.importorskip("matplotlib")
    from kinetile_accuracy.drawing import house_style

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
