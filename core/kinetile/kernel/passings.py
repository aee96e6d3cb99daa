"""Pairs that pass through each other: by the rules of the scene, and at present.

A *passing* is a pair through one image (0, 0 if no axis is periodic): two bodies may be passing through each
other through several images at a time (docs/specification.md, rules 11 and 11p).
"""

from kinetile.kernel.compiled import hook
from kinetile.kernel.pairs import follower
from kinetile.kernel.tables import Kernel, Records

IS_ELASTIC, IS_PASS, FIRST = range(3)
"""Responses, as rows of ``k.rules`` name them; hooks of responses are numbered from ``FIRST`` on."""

MOST_IMAGES = 4
"""Images through which two bodies can overlap at a time: each is narrower than a period, so two an axis."""


@hook
def row_of(kinds: int, one: int, other: int) -> int:
    """Returns the row of the rule for two of ``kinds`` kinds; walls come after the last kind."""
    return int(one * (kinds + 1) + other)


@hook
def rule_of(k: Kernel, a: int, b: int) -> int:
    """Returns the row of the rule for the bodies in two slots, or for a body and a wall (b below 0)."""
    kinds = k.clock[0].kinds
    return row_of(kinds, k.traits[a].kind, k.traits[b].kind if b >= 0 else kinds)


@hook
def lets_pass(rule: Records) -> bool:
    """Returns True if two bodies with a rule pass through each other: always, or met from one side."""
    return bool(rule.response == IS_PASS or rule.way_x != 0.0 or rule.way_y != 0.0)


@hook
def passes(k: Kernel, a: int, b: int) -> bool:
    """Returns True if two bodies may pass through each other. Before: the scene has rules."""
    return lets_pass(k.rules[rule_of(k, a, b)])


@hook
def is_passing(k: Kernel, a: int, b: int, m: int, n: int) -> bool:
    """Returns True if two bodies are passing through each other in this image. O(their shorter list)."""
    body = a if k.traits[a].inside < k.traits[b].inside else b
    pair = k.passers[body]
    while pair >= 0:
        record = k.passings[pair]
        of_both = record.a + record.b == a + b and (record.a == a or record.a == b)
        if of_both and record.m == m and record.n == n:
            return True
        pair = follower(k.passings, body, pair)
    return False


@hook
def counts_from(k: Kernel, a: int, b: int, since: int) -> int:
    """Returns the number of ticks after a tick until the contacts of two bodies count: for two that pass
    through each other, from now on (rule 11); for others, always."""
    past = k.clock[0].now - since
    return int(past if past > 0 and len(k.rules) > 0 and passes(k, a, b) else 0)
