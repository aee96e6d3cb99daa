"""The diagnosis: what authors usually did wrong where a check fails with such words.

A check sees a symptom, and the same few mistakes cause most of them. A row says to which failures it
applies, by the check, by a pattern of the message, or by both; the first one that applies is printed. That is
a guess from experience and no judgement: it comes last in the text of a failure, and begins with "often".
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from kinetile_conformance.cases import Subject

OFTEN = "often: "


@dataclass(frozen=True)
class Symptom:
    """A kind of failure, and what is often behind it.

    Attributes:
        id: how it is called.
        often: what authors usually did wrong, in one or two sentences.
        checks: the checks whose failures these are; empty: of any check.
        pattern: a regular expression that is found in what was said; "": whatever was said.
    """

    id: str
    often: str
    checks: tuple[str, ...] = ()
    pattern: str = ""

    def applies(self, check: str, said: str) -> bool:
        """Whether a failure of this check with these words is such a one."""
        return (not self.checks or check in self.checks) and re.search(self.pattern, said) is not None


SYMPTOMS = (
    Symptom(
        "one-sided",
        "`near` names one side only: a loop over the later bodies, half of the neighbouring places, or a "
        "link that is set at one of its ends.",
        pattern=r"is near (body )?\d+, but (body )?\d+ is not near",
    ),
    Symptom(
        "index",
        "an index by one, or outside of its array: -1 or n taken for a body, a loop that ends one too "
        "late, a count returned that is not that of the numbers written.",
        pattern=r" used [sk]\.|there is room for|was written to|no body of the scene|no such body",
    ),
    Symptom(
        "scene",
        "an array of the scene is kept and written to. `prepare` copies what is to change into the state.",
        pattern=r"wrote the scene's",
    ),
    Symptom(
        "writes",
        "a hook writes what is the kernel's: a body, a count, the clock, the queue. It only reads bodies, "
        "by `since_anchor`, and calls `schedule`, `offer`, `add_pair` for the rest.",
        pattern=r"\w+ wrote \w|the common clock is not that of its plan",
    ),
    Symptom(
        "shared",
        "state kept in the class or in the module: an array made once for all simulations, a counter, a "
        "random number. What a simulation changes belongs into the state that `prepare` makes.",
        checks=("state-is-not-kept",),
        pattern=r"^(after|side by side)",
    ),
    Symptom(
        "surroundings",
        "something is read that is not the scene's motion: `settings`, `origin`, the thread, the order of a "
        "set.",
        checks=("does-not-see-who-asks",),
    ),
    Symptom(
        "start",
        "times are computed from `scene.start`, or as floating-point numbers since then. Hooks know "
        "ticks: `anchor` and `now`.",
        checks=("same-contacts-after-a-change-of-view",),
        pattern=r"^started",
    ),
    Symptom(
        "anew",
        "rebuilt on what is there: `arrange` or `build` does not clear what it wrote before, or does "
        "its work the first time only.",
        pattern=r"^(built anew|put back|resumed from a file),",
    ),
    Symptom(
        "ticks",
        "late by a view: a tick kept in the state and not in `ticks`. When the base of the clock moves "
        "on, it stays behind.",
        checks=("same-contacts-after-a-change-of-view",),
        pattern=r"^256 times as slow",
    ),
    Symptom(
        "long",
        "a number of few bits overflows after many events, or a tick is kept in the state and not in "
        "`ticks`: only long runs fail.",
        checks=("same-contacts-in-a-marathon",),
    ),
    Symptom(
        "absolute",
        "an absolute length, speed or place, such as 1e-9, where one in proportion to a reach is meant.",
        checks=("same-contacts-after-a-change-of-view",),
        pattern=r"^(32 times as large|2\^40 times as small)",
    ),
    Symptom(
        "floor",
        "truncation for floor: `int()` rounds towards 0, so only negative coordinates fail. `math.floor` "
        "comes first.",
        checks=("same-contacts-after-a-change-of-view",),
        pattern=r"^(mirrored|moved)",
    ),
    Symptom(
        "turns",
        "a certificate scheduled once and not after a new plan: there is no `replan`, or it overlooks a "
        "turn, which only one body has.",
        checks=("same-contacts-with-turns",),
    ),
    Symptom(
        "stalled",
        "a certificate that fails again at once: `repair` does not schedule it anew, or what it says is "
        "false from the start, by a wrong sign or a border that was not moved on.",
        pattern=r"does not get on|the bodies are jammed|an endless loop",
    ),
    Symptom(
        "empty",
        "nobody was thought of: the largest of no numbers, body 0 of none, a remainder by 0.",
        checks=("same-contacts-in-the-gallery",),
        pattern=r"raised",
    ),
    Symptom(
        "pair-set",
        "pairs are added and removed by two rules that are not each other's opposite: ends exchanged, or "
        "a pair that `build` left out.",
        pattern=r"(removed|reported) the pair \(",
    ),
    Symptom(
        "sizes",
        "computed with one body's size, not the other's: two bodies are near by the sum of both reaches, and "
        "a wide one has to be found from each small one as well.",
        checks=("same-contacts-beside-giants",),
    ),
    Symptom(
        "many",
        "a list overflows, or a number has too few bits: only many bodies fail. If few are left of them, "
        "look for truncation where `floor` is meant: many swarms lie about the origin.",
        checks=("same-contacts-in-a-swarm",),
    ),
    Symptom(
        "claims",
        "more is claimed than kept: `solid=True` or `skin_limit` left out, or the feature `boxes` for "
        "pairs of another kind.",
        checks=(
            "never-misses-a-pair-while-all-pass",
            "skin-limit-holds-at-its-edge",
            "pairs-are-overlapping-boxes",
        ),
    ),
    Symptom(
        "late",
        "reported too late: `radius` used where `reach` is meant, or a comparison of rounded places or "
        "times that a tie decides the other way.",
        pattern=r"MissedContactError|lies in the past|touch \(gap -?\d(\.\d+)?e-1\d\)",
    ),
    Symptom(
        "newcomer",
        "somebody who has come near was not named: a neighbouring place left out, at the corner or the "
        "end of a loop; or a certificate scheduled once and not after `replan`.",
        pattern=r"are not (a candidate pair|near each other)|looked at too late|is awaited|watched at"
        r"|contact \d+ is ",
    ),
)
"""The rows, the more particular ones first."""


def likely(check: str, said: str) -> str:
    """Return what authors usually did wrong where this check says so; "" where no row applies."""
    return next((row.often for row in SYMPTOMS if row.applies(check, said)), "")


def diagnosed(check: str, said: str, subject: Subject) -> list[str]:
    """Return the line that ends such a failure, if there is one: diagnoses are for broad phases."""
    often = likely(check, said) if subject.pair is None else ""
    return [f"{OFTEN}{often}"] if often else []
