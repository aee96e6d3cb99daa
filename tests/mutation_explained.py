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
        "seen in the third round, by `same-contacts-in-a-swarm`: two bodies two stripes apart touch while "
        "one is still a hair before its border; see [below](#seen-late)"
    ),
    "s.width[1] = max(s.width[0], 2.0 * k.bodies.reach.max(initial=1.0))": "cost: wider stripes",
    "s.stripe[:] = np.trunc(positions_now(k)[:, 0] / s.width[1])": (
        "seen in the third round, by `same-contacts-in-a-swarm`: left of the origin every body counts one "
        "stripe too far to the right, until it moves; see [below](#seen-late)"
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

PLACED = (
    "cost: a body that comes is put in at another place of the list, and wanders from there by exchanges at "
    "that very tick, before anything else happens"
)
SORTED = (
    "cost: the list begins in another order, and is sorted by exchanges at once, before anything else happens"
)
LEFT = "equivalent: nobody asks after a bound of nobody, and `enter` sets it again"
SET_AFTER = "equivalent: `watch` sets this bound before anybody reads it"
STRANGER = (
    "**unseen**: a bound's place is asked of a body that is not the bound's, perhaps beyond the array; "
    "what comes of it is a place to begin at, so no answer shows it"
)

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
    "place = positions_now(k)[:, axis]": SORTED,
    "speed = k.bodies.vy if axis else k.bodies.vx": SORTED,
    "order = np.lexsort((body, 1 - upper, speed[body], edge))": SORTED,
    "edge = place[body] + np.where(upper == 1, k.bodies.reach[body], -k.bodies.reach[body])": SORTED,
    "dropped s.order[:] = ...": (
        "equivalent: a list is arranged in a state that is new, or for as many bodies as before, and "
        "what stands behind its bounds is END already"
    ),
    "if s.axis[0] == 0:": Y,
    "gap = (q.y + q.vy * q_time + q_reach) - (p.y + p.vy * p_time + p_reach)": Y,
    "rate = q.vy - p.vy": Y,
    "s.bounds[4 * body] = NEVER": SET_AFTER,
    "s.bounds[4 * body + 1] = NEVER": SET_AFTER,
    "s.bounds[lower] = NEVER": SET_AFTER,
    "s.bounds[upper] = NEVER": SET_AFTER,
    "s.bounds[bound] = NEVER": LEFT,
    "dropped s.bounds[4 * body + 1] = ...": SET_AFTER,
    "dropped s.bounds[lower] = ...": SET_AFTER,
    "dropped s.bounds[upper] = ...": SET_AFTER,
    "dropped s.bounds[bound] = ...": LEFT,
    "for place in range(1, 2 * k.clock[0].bodies + 0):": (
        "equivalent: the last bound is the right one of somebody, and there is nothing right of it"
    ),
    "if s.order[inside] & 1 == 0:": (
        "equivalent: where neither of two intervals that overlap holds the other, one has the left end of "
        "the other inside, and the other its right end; one that holds another has both"
    ),
    "left = 4 * body if s.bounds[4 * body] < s.bounds[4 * body + 1] else 4 * body + 1": (
        "equivalent: where both ends pass somebody at one tick, either may be first"
    ),
    "return 1": "cost: what stood in `k.near[0]` before is named, a body: a needless newcomer",
    "overlaps = s.bounds[4 * other + PLACE] < last and first < s.bounds[4 * other + 1 + PLACE]": (
        "equivalent: no two bounds stand at one place, and the body itself is left out"
    ),
    "body = k.bodies[bound >> 1]": STRANGER,
    "place = body.x + body.vx * elapsed if s.axis[0] == 0 else body.y + body.vy * elapsed": PLACED,
    "return float(place + (body.reach if bound & 1 else -body.reach))": PLACED,
    "while s.order[place - 1] != END and edge(k, s, s.order[place - 1]) > there:": PLACED,
    'axis=np.array([0 if self.axis == "x" else 1]),': (
        "cost: it sorts along the other axis, or always along one; which it is the answer does not show"
    ),
    "dropped room=...": "equivalent: the kernel makes room for as many bodies as there are slots anyway",
    "dropped pairs=...": "cost: the table of pairs begins smaller, and grows",
    "pairs=4 * n + 64,": "cost: the table of pairs begins smaller, and grows",
    'axis=np.array([1 if self.axis == "x" else 1]),': (
        "cost: it sorts along y, whatever is asked; which axis it is the answer does not show"
    ),
}

NEEDLESS = "cost: what stood in `k.near[0]` before is named, a body: a needless newcomer"
OFFERED = "equivalent: the pair is offered, where it would be named: that is the same"
WANDERS = (
    "cost: a body that comes is put into another tile, or one of its bounds is; tiles that lie the wrong way "
    "round then collapse at that very tick until all is right, before anything else happens"
)
SAME_TICK = (
    "cost: the first tiling has bounds or bodies the wrong way round that are less than a skin apart, or "
    "level; their tiles collapse at once, before anything else happens"
)
FLIPPED = "cost: who stands above whom is chosen wrongly where two are level; a flip puts that right at once"
MARGIN = (
    "**unseen**: how narrow a tile counts as of no width; the proof has room to both sides, and nothing that "
    "is drawn reaches its edges"
)
ROOT = "equivalent: the root of the tree has no neighbour, and nobody reads what stands before it"
GONE = "equivalent: nobody asks after the tiles of nobody, and `enter` sets them again"
EITHER = "equivalent: where both are at one place, either may be first"
EITHER_TILE = "equivalent: where two tiles fail at one tick, either may be first"
UNUSED_LANE = "equivalent: of eight lanes those that only fill up are not read"
WALK_GUARD = (
    "equivalent: around a body there are at most 2n tiles, and only in a web that is broken does a walk not "
    "end there; what the hooks do then no answer shows"
)

FLIP = "cost: a flip is a parting and a meeting at once, and is done in two events instead of one"

BEYOND = (
    "**unseen**: more than is proved to be right, yet no scene shows it, nor did 1,140 with three bodies in "
    "a knot, skins up to 32 times the limit and sizes up to 64 times apart"
)
SEEN_LEFT = "equivalent: the two saw each other left of the body before; the lines are gone"

SWEEP_TILING = {
    "if fails_by_order(s, p): -> if False:": FLIP,
    "dropped join(...)": FLIP,
    "set_due(s, first, lane(tick, 4), lane(by_order, 3))": (
        "equivalent: neither can fail by order, the tile left of a body, which is no corner, and a lane that "
        "is not asked"
    ),
    "skin_limit=float(radius.min() / (8.0 * radius.max()) * radius.min()) if n else None,": BEYOND,
    "skin_limit=float(radius.min() / (7.0 * radius.max()) * radius.min()) if n else None,": BEYOND,
    "room=2 * scene.capacity + 1,": (
        "equivalent: around a body there are at most 2n tiles, and each names one other body"
    ),
    "if top < n and bottom < n:": SEEN_LEFT,
    "dropped offer(...)": SEEN_LEFT,
    "watch_around(k, s, body if turn == 0 else body_of(q))": (
        "equivalent: the same two bodies are watched, the other one first"
    ),
    "return 1": NEEDLESS,
    "if one != body: # then the other is not the body either: see passing": OFFERED,
    "room=3 * scene.capacity - 1,": "cost: less room to spare; nobody has so many neighbours",
    "room=3 * scene.capacity + 0,": "cost: less room to spare; nobody has so many neighbours",
    "edge = place[body, 0] + np.where(right, bodies.reach[body], -bodies.reach[body])": SAME_TICK,
    "s.sweep[: 2 * n] = bounds(n)[np.lexsort((body, ~right, bodies.vx[body], edge))]": SAME_TICK,
    "s.at_level[:n] = np.lexsort((np.arange(n), bodies.vy, place[:, 1]))": (
        "equivalent: two bodies that are level are beside each other, and never both on the sweep line"
    ),
    "tie = max(2.0**-46 * max(float(limits.width), float(limits.height)), float(limits.skin))": MARGIN,
    (
        "s.limits[:] = tie, max(tie, 4.0 * float(limits.skin), "
        "2.0**-30 * float(bodies.radius.min()) if n else 0.0)"
    ): MARGIN,
    "while at > 1:": ROOT,
    "while at <= leaves:": "equivalent: the lowest rank is above nobody, so no search upwards ends there",
    "if abs(rise) > s.limits[0]:": FLIPPED,
    "return bool(rise > 0.0)": FLIPPED,
    "if one.vy != two.vy:": FLIPPED,
    "return bool(one.vy > two.vy)": FLIPPED,
    "return a >= b": "equivalent: no body meets itself",
    "place = body.x + body.vx * since_anchor(k, body, k.clock[0].now)": WANDERS,
    "return float(place + body.reach if is_right_bound(p) else place - body.reach)": WANDERS,
    "if (top < n and stands_above(k, s, body, top)) or (bottom < n and stands_above(k, s, bottom, body)):": (
        WANDERS
    ),
    'right = float("inf") if body_of(q) == n else where(k, q) - x': WANDERS,
    "return left if left < right else right": WANDERS,
    "if other != body and is_there(k, other): -> if False:": WANDERS,
    "for which in range(2):": WANDERS,
    "if room > most:": WANDERS,
    "while body_of(q) < n and where(k, q) <= reached:": EITHER,
    "upper = body_of(below) == body or (body_of(above) != body and where(k, above) >= where(k, below))": (
        "equivalent: time stands still, and what is above the body and what is below do not touch each other"
    ),
    "set_due(s, own_tile(body, which), NEVER, False)": GONE,
    "dropped set_due(...)": GONE,
    "since = choose(left.anchor <= right.anchor, right.anchor, left.anchor)": (
        "equivalent: of two anchors that are equal either is the later one"
    ),
    "corner = ((left.port & seven) > outer) & ((right.port & seven) > outer) & (climb <= zero)": (
        "equivalent: a top that does not come nearer its bottom never reaches it"
    ),
    (
        "corner = corner & (spread(s.limits[0]) * climb <= then) "
        "& (then <= spread(s.limits[1]) * (zero - climb))"
    ): MARGIN,
    "if some(corner): -> if True:": "cost: what no corner needs is worked out",
    "sooner = due_of(s, body, UPPER) <= due": EITHER_TILE,
    "sooner = due_of(s, body, LOWER) <= due": EITHER_TILE,
    "mine = eight(1, 1, 1, 1, 0, 0, 0, 0) > spread_whole(0)": UNUSED_LANE,
    "mine = eight(1, 1, 1, 0, 0, 0, 0, 1) > spread_whole(0)": UNUSED_LANE,
    "asked = eight(1, 1, 1, 0, 1, 1, 1, 0) > spread_whole(0)": UNUSED_LANE,
    "asked = eight(1, 1, 1, 0, 0, 0, 0, 0) > spread_whole(0)": UNUSED_LANE,
    "left = 3 * n + 1 # there are no more tiles: a web that is broken leads no further": WALK_GUARD,
    "while left > 0:": WALK_GUARD,
    "left -= 1": WALK_GUARD,
    "leaves = 1 << max(bodies - 1, 0).bit_length()": "cost: a tree with more leaves than there are ranks",
}

EXPLAINED: dict[str, dict[str, str]] = {
    "stripes": STRIPES,
    "sap-1d": SAP_1D,
    "sweep-tiling": SWEEP_TILING,
}
