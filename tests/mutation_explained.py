"""Why mutants survive, by phase and by the lines as they are changed: what docs/mutation.md prints.

Each is *equivalent* (no run can tell), a *cost* (over-reporting, which is allowed), or *unseen*: a fault.
"""

from __future__ import annotations

__all__ = ["EXPLAINED"]

Y = "of `axis=y` alone: `kinetile mutate sap-1d:axis=y` judges it"

STRIPES = {
    "s.width[1] = max(s.width[1], 2.0 * k.bodies.reach.max(initial=0.0))": (
        "cost: the width that was asked for is ignored, and none is asked for here"
    ),
    "s.width[1] = max(s.width[0], 2.0 * k.bodies.radius.max(initial=0.0))": (
        "**unseen**: two bodies two stripes apart touch while one is still a hair before its border; "
        "see [below](#unseen)"
    ),
    "s.width[1] = max(s.width[0], 2.0 * k.bodies.reach.max(initial=1.0))": "cost: wider stripes",
    "s.stripe[:] = np.trunc(positions_now(k)[:, 0] / s.width[1])": (
        "**unseen**: left of the origin every body counts one stripe too far to the right, until it moves; "
        "see [below](#unseen)"
    ),
    "gap = b.x - left if b.vx <= 0.0 else left + s.width[1] - b.x": (
        "equivalent: at speed 0 no gap closes, whichever it is"
    ),
    "step = -1 if k.bodies[body].vx <= 0.0 else 1": "equivalent: who crosses a border is not at rest",
    "return name_all(k, s, s.stripe[body] + step, 1)": (
        "cost: the first number named is what stood in `k.near[0]` before, a body: a needless newcomer"
    ),
    "def __init__(self, *, width: float = 1.0) -> None:": "cost: wider stripes",
    "rings = np.zeros(n + min(n, 1), dtype=np.int64)": "cost: one list for all stripes, which are told apart",
    "rings = np.zeros(n + max(n, 0), dtype=np.int64)": "equivalent: without bodies no list is looked for",
    "state = State(np.zeros(n, dtype=np.int64), rings, rings.copy(), np.array([self.width, 1.0]))": (
        "equivalent: `arrange` sets it before anybody reads it"
    ),
}

SAP_1D = {
    "edge = place[body] + np.where(upper == 1, k.bodies.reach[body], -k.bodies.radius[body])": (
        "equivalent: two bounds may be sorted the wrong way round when less than a skin is between; if they "
        "come nearer their gap falls at once, before the contact, and if not there is none"
    ),
    "gap = (q.x + q.vy * q_time + q_reach) - (p.y + p.vy * p_time + p_reach)": Y,
    "gap = (q.y - q.vy * q_time + q_reach) - (p.y + p.vy * p_time + p_reach)": Y,
    "gap = (q.y + q.vy * q_time + q_reach) - (p.x + p.vy * p_time + p_reach)": Y,
    "rate = q.vy - p.vx": Y,
    "dropped s.bounds[4 * body] = ...": (
        "equivalent: `watch` sets every bound after this, and the body's certificate with the later of both"
    ),
    'axis=np.array([1 if self.axis == "x" else 1]),': (
        "cost: it sorts along y, whatever is asked; which axis it is the answer does not show"
    ),
}

EXPLAINED: dict[str, dict[str, str]] = {"stripes": STRIPES, "sap-1d": SAP_1D}
