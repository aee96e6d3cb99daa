"""Sweep-tiling where x is periodic: its tiles, and an audit of links through other periods."""

from __future__ import annotations

import kinetile as kt
from kinetile_plugins.sweep_tiling.audit import audit, tiles_of
from tilings import Steps


def test_a_tile_may_reach_round_the_cylinder():
    """One body sees its own image: three tiles, and no candidate pair."""
    scene = kt.Scene([(0.9, 0.5)], [(1.0, 0.25)], 0.125, arena=(1.0, 1.0), periodic="x")
    steps = Steps(scene)
    tiles = tiles_of(steps.engine.k, steps.state)
    assert len(tiles.left) == 3
    assert sorted(tiles.away.tolist()) == [0.0, 0.0, 1.0]
    assert len(steps.sim.candidate_pairs()) == 0


def test_the_audit_sees_a_link_through_other_periods():
    scene = kt.Scene([(0.9, 0.5), (0.3, 0.25)], [(1.0, 0.25), (0, 0)], 0.125, arena=(1, 1), periodic="x")
    steps = Steps(scene)
    assert list(audit(steps.engine.k, steps.state)) == []
    left = int(tiles_of(steps.engine.k, steps.state).left[0])
    steps.state.turns[left] += 1
    complaints = "\n".join(audit(steps.engine.k, steps.state))
    assert "leads through other periods from its left than from its right" in complaints
    steps.state.turns[steps.state.web[left]] -= 1
    assert "is not the gap between" in "\n".join(audit(steps.engine.k, steps.state))
