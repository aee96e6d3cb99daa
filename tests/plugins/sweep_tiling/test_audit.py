"""The audit sees what it says it sees: a state that is broken by hand, and the sentence about it."""

from __future__ import annotations

import re

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import AuditError
from kinetile.kernel.tables import NEVER
from kinetile.toolbox import schedule
from kinetile_plugins.sweep_tiling.audit import AllTiles, _pairs, _sweep, audit, tiles_of
from tilings import LOWER, OUTER, UPPER, Steps

OTHER_SIDE = 5  # from a port UPPER or LOWER to the end that it looks at


def port(body: int, side: str, which: int) -> int:
    return 16 * body + (8 if side == "R" else 0) + which


@pytest.fixture
def steps() -> Steps:
    """A wide body (0), two small ones over it (1 left of 2), one under it (3), and one to its right (4)."""
    position = [[0.4, 0.5], [0.25, 0.85], [0.5, 0.9], [0.45, 0.15], [0.8, 0.55]]
    velocity = [[0.0, 0.0], [0.25, 0.0], [-0.25, 0.0], [0.0, 0.25], [-0.25, 0.0]]
    found = Steps(kt.Scene(position, velocity, [0.25, 0.05, 0.06, 0.07, 0.08], arena=(1.0, 1.0)))
    assert said(found) == ""
    return found


def said(steps: Steps) -> str:
    """All that the audit has to say, a sentence a line."""
    return "\n".join(audit(steps.engine.k, steps.state))


def join(steps: Steps, p: int, q: int) -> None:
    steps.state.web[p] = q
    steps.state.web[q] = p


def test_i1_links_are_symmetric(steps):
    steps.state.web[port(1, "R", OUTER)] = port(4, "L", OUTER)
    assert "the tile R(1).outer - L(4).outer: its right port is linked to " in said(steps)
    with pytest.raises(AuditError, match=r"at time 0.0, after 0 events under broad phase 'sweep-tiling': "):
        steps.audit()


@pytest.mark.parametrize("odd", [port(1, "L", UPPER), 3, 16 * 6, 2**32 - 1, port(5, "L", UPPER)])
def test_i2_a_link_joins_a_left_port_to_a_right_one(steps, odd):
    steps.state.web[port(0, "L", UPPER)] = odd
    assert re.search(r"the tile L\(0\).upper - .*: its right port is no right port", said(steps))


def test_i3_both_sides_agree_about_top_and_bottom(steps):
    steps.state.web[port(1, "L", LOWER) + OTHER_SIDE] = 3
    assert "lies between (1, 3) from its left, (1, 0) from its right" in said(steps)


def test_i4_the_left_bound_is_left(steps):
    steps.engine.k.bodies[1].x += 0.3
    assert "wider than nothing to the wrong side, and does not fail now" in said(steps)


def test_i5_top_and_bottom_span_the_tile(steps):
    steps.engine.k.bodies[0].x += 0.2
    assert re.search(r"the tile .* is wider than body \d or body \d, which bound it", said(steps))


def test_i6_the_top_is_above(steps):
    steps.engine.k.bodies[3].y += 0.6
    assert "has body 0 as its top and body 3 as its bottom, which is not below" in said(steps)


def test_i7_there_are_3n_plus_1_tiles(steps):
    steps.state.web[port(1, "L", LOWER)] = steps.state.web[port(2, "L", LOWER)]
    assert "there are not 16 tiles" in said(steps)


def test_i8_everybody_in_sight_is_named(steps, monkeypatch):
    monkeypatch.setitem(audit.__globals__, "near", lambda k, s, body: 0)
    assert "bodies 0 and 3 bound a tile, and 3 is not named as near 0" in said(steps)
    assert "bodies 3 and 0 bound a tile, and 0 is not named as near 3" in said(steps)


def test_i8_nobody_else_is_named(steps, monkeypatch):
    def everybody(k, s, body):
        k.near[:5] = range(5)
        return 5

    monkeypatch.setitem(audit.__globals__, "near", everybody)
    assert "body 2 is named as near 3, and they bound no tile" in said(steps)


def test_i9_and_i10_tiles_in_a_circle_are_on_no_walk(steps):
    """Bodies 1 and 2 and the tile between them, cut out of the row over body 0 and closed to a ring: all
    links and ends agree, but nothing leads there."""
    web = steps.state.web
    before, after = int(web[port(1, "L", OUTER)]), int(web[port(2, "R", OUTER)])
    join(steps, before, after)
    join(steps, port(2, "R", OUTER), port(1, "L", OUTER))
    complaints = said(steps)
    assert re.search(r"the walk over body 0 does not find the \d tiles there", complaints)
    assert re.search(r"the sweep comes to \d of 10 bounds: the tiles lie in a circle", complaints)


@pytest.mark.parametrize(("bound", "words"), [("R", "but its ends are"), ("L", "in a gap between")])
def test_i10_the_sweep_needs_the_ends(steps, bound, words):
    """Ends alone, which the links do not show to be wrong: asked of the sweep itself."""
    at = port(1, bound, 0)
    steps.state.web[at + OTHER_SIDE + LOWER] = 3
    complaints = list(_sweep(steps.state, tiles_of(steps.engine.k, steps.state)))
    assert len(complaints) == 1
    assert complaints[0].startswith(f"the sweep comes to {bound}(1)")
    assert words in complaints[0]


def test_i10_the_sweep_needs_the_links(steps):
    web = steps.state.web
    one, two = int(web[port(1, "L", UPPER)]), int(web[port(2, "L", UPPER)])
    join(steps, port(1, "L", UPPER), two)
    join(steps, port(2, "L", UPPER), one)
    complaints = list(_sweep(steps.state, tiles_of(steps.engine.k, steps.state)))
    assert complaints[0].endswith("where other tiles end than are linked to it") or "circle" in complaints[0]


def test_i11_on_every_line_the_tiles_are_the_gaps(steps):
    steps.engine.k.bodies[4].y = 0.05
    steps.engine.k.bodies[4].x = 0.45
    assert re.search(r"the tile .* at x = 0\.\d+ is not the gap between body \d and body \d", said(steps))
    assert re.search(r"at x = 0\.\d+ a gap between two bodies has no tile, or two", said(steps))


def test_i12_pairs_are_few(steps):
    """No planar map has all ten pairs of five bodies; a list of tiles that says so is not believed."""
    top, bottom = np.triu_indices(5, 1)
    count = np.arange(len(top))
    complaints = list(_pairs(steps.engine.k, steps.state, AllTiles(count, count, top, bottom, count)))
    assert "10 pairs of bodies see each other; among 5 there can be 9" in complaints
    every = np.triu_indices(7, 1)
    count = np.arange(len(every[0]))
    complaints = list(_pairs(steps.engine.k, steps.state, AllTiles(count, count, *every, count)))
    assert "20 pairs see each other, TOP and BOTTOM among them; there can be 14" in complaints


def test_i13_every_tile_is_watched(steps):
    failing = int(np.flatnonzero(steps.state.due != NEVER)[0])
    steps.state.due[failing] = NEVER
    assert re.search(r"fails at tick \d+ by the plans of its bodies, but is watched never", said(steps))


def test_i13_a_new_plan_is_a_new_failure_time(steps):
    steps.engine.k.bodies[1].vx = 0.5
    assert re.search(r"fails at tick \d+ by the plans of its bodies, but is watched at tick \d+", said(steps))


def test_i13_a_tile_that_will_not_fail_is_not_queued(steps):
    quiet = int(np.flatnonzero(steps.state.due[:-4].reshape(-1, 4)[:, :3].ravel() == NEVER)[0])
    steps.state.due[4 * (quiet // 3) + quiet % 3] = 2**60
    assert f"fails never by the plans of its bodies, but is watched at tick {2**60}" in said(steps)


def test_i13_what_fails_is_told_apart(steps):
    steps.state.web[port(1, "R", OUTER) + 3] ^= 1
    assert "the tile R(1).outer - L(2).outer fails by its width, but is watched otherwise" in said(steps)


def test_i13_the_owner_is_queued_for_its_first_tile(steps):
    body = int(np.argmin(steps.state.due)) // 4
    schedule(steps.engine.k, body, 2**59)
    assert f"body {body} is queued for tick {2**59}, but its first tile fails at " in said(steps)


def test_no_event_is_left_in_the_past(steps):
    steps.engine.k.clock[0].now = steps.state.due.min() + 5
    assert "failed 5 ticks ago" in said(steps)
