"""The thesis's statements about its benchmark (section 5.3), as data: each with its criterion.

If the thesis gives no number ("almost negligible", "many times over"), one is chosen here. A comparison of
times consists of pairs, one for each seed and round, with both phases run one after the other. It is decided
if nine of ten pairs agree by more than 5 %, on a machine that took the same time for the same run in every
round, to 5 %: with one round that is not known. A statement holds if all its parts hold.
"""

import math
import statistics
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from kinetile_bench.event_rates import BODIES, DENSITIES
from kinetile_bench.thesis import ThesisBench, ThesisScene

NAIVE, SAP, SAP2, TILING = "naive", "sap-1d", "sap-2d", "sweep-tiling"
THREE = (NAIVE, SAP, TILING)
"""The phases of the thesis's figures."""

BOUND = "structural_events"
"""The thesis's bound events, by their name in readings."""

HOLDS, FAILS, NOT_KNOWN, NOT_MEASURED = "holds", "does not hold", "not known", "not measured"

QUIET, AGREEING = 1.05, 0.9
"""Slowest over fastest round of a quiet machine, and the ratio that is level; the share of agreeing pairs."""

MANY, NEGLIGIBLE, LEVEL = 3.0, 0.1, 0.01
"""Bound events for one other that are many times over; negligible differences of exponents and of counts."""


@dataclass(frozen=True)
class Part:
    """A part of a statement: its text, its verdict, and the numbers that decide it."""

    text: str
    answer: str
    numbers: str


@dataclass(frozen=True)
class Statement:
    """A statement of the thesis, and its parts that the run has measured."""

    name: str
    text: str
    verdict: str
    parts: tuple[Part, ...]


class Ratio(NamedTuple):
    """Logarithms of ratios of two phases' times, by seed and round, and the unrest of these runs."""

    logs: Mapping[tuple[int, int], float]
    unrest: float

    @property
    def below(self) -> str:
        """The verdict that the ratio is below 1."""
        for sign, answer in ((-1.0, HOLDS), (1.0, FAILS)):
            agreeing = sum(sign * log > math.log(QUIET) for log in self.logs.values())
            if self.logs and self.unrest <= QUIET and agreeing >= AGREEING * len(self.logs):
                return answer
        return NOT_KNOWN

    def over(self, other: "Ratio") -> "Ratio":
        """Returns this ratio over another, pair by pair."""
        logs = {key: self.logs[key] - other.logs[key] for key in self.logs.keys() & other.logs.keys()}
        return Ratio(logs, max(self.unrest, other.unrest))

    def __str__(self) -> str:
        return f"{math.exp(statistics.median(self.logs.values())):.3g}" if self.logs else "-"


def ratio(bench: ThesisBench, scene: ThesisScene, one: str, other: str, per: str | None = None) -> Ratio:
    """Returns the ratio of the times of one phase and another, for a run or for one of its ``per``."""
    mine, theirs = bench.of(scene, one), bench.of(scene, other)
    logs = {}
    for seed in sorted(mine.keys() & theirs.keys()):
        a, b = mine[seed], theirs[seed]
        weight = math.log(max(b.counts[per], 1) / max(a.counts[per], 1)) if per else 0.0
        for k, times in enumerate(zip(a.cpu_seconds, b.cpu_seconds, strict=True)):
            logs[seed, k] = math.log(times[0] / times[1]) + weight
    unrest = (statistics.median(each.unrest for each in cells.values()) for cells in (mine, theirs))
    return Ratio(logs, max(unrest))


def growths(bench: ThesisBench, one: str, other: str) -> dict[float, Ratio]:
    """Returns the ratio of two phases' times with the most discs over the one with the fewest, by density."""
    groups = {density: found for density, found in bench.by_density(one, other).items() if len(found) > 1}
    return {
        density: ratio(bench, most, one, other).over(ratio(bench, fewest, one, other))
        for density, (fewest, *_, most) in groups.items()
    }


def _all(answers: Iterable[str]) -> str:
    return max(answers, key=(HOLDS, NOT_MEASURED, NOT_KNOWN, FAILS).index)


def _below(text: str, found: Mapping[Any, Ratio]) -> Iterator[Part]:
    """Yields the part that all of some ratios are below 1; nothing without ratios."""
    if found:
        numbers = ", ".join(f"{each} at {where}" for where, each in found.items())
        yield Part(text, _all(each.below for each in found.values()), f"ratios {numbers}")


def _counted(text: str, count: int, of: int, least: int) -> Part:
    """Returns the part with a text that must hold in at least ``least`` of the cases."""
    return Part(text, HOLDS if count >= least else FAILS, f"in {count} of {of} cases")


Check = Callable[[ThesisBench], Iterable[Part]]
"""Yields parts of a statement, decided by a run; nothing if the run has not measured their subject."""


def faster(
    one: str,
    other: str,
    densities: Collection[float] = DENSITIES,
    bodies: Collection[int] = BODIES,
    per: str | None = None,
) -> Check:
    """One phase takes less time than another on all of some scenes, for a run or for one of its ``per``."""

    def check(bench: ThesisBench) -> Iterator[Part]:
        scenes = [s for s in bench.scenes(one, other) if s.density in densities and s.bodies in bodies]
        text = f"{one} takes less time than {other}" + (f", by {per}" if per else "")
        yield from _below(text, {scene: ratio(bench, scene, one, other, per) for scene in scenes})

    return check


def grows_less(one: str, other: str) -> Check:
    """One phase's time grows less with the number of discs than another's, at each density."""
    text = f"time grows less under {one} than under {other}"
    return lambda bench: _below(text, growths(bench, one, other))


def lead_shrinks(bench: ThesisBench) -> Iterator[Part]:
    """Sweep-tiling's lead shrinks with the density, and the slopes are the same where that is least."""
    groups, slopes = bench.by_density(SAP, TILING), growths(bench, SAP, TILING)
    heights = {density: ratio(bench, groups[density][-1], SAP, TILING) for density in slopes}
    for what, found in (("slope", slopes), ("height", heights)):
        steps = {density: found[density].over(found[before]) for before, density in pairwise(found)}
        yield from _below(f"the lead in {what} is less than at the density before", steps)
    if 0.01 in slopes:
        most = NEGLIGIBLE * math.log(groups[0.01][-1].bodies / groups[0.01][0].bodies)
        beyond = {key: abs(log) - most for key, log in slopes[0.01].logs.items()}
        text = f"the exponents differ by less than {NEGLIGIBLE:g}"
        yield from _below(text, {0.01: slopes[0.01]._replace(logs=beyond)})


def fewest_events_slowest(bench: ThesisBench) -> Iterator[Part]:
    """Naive has the fewest events in all scenes, and takes the most time in most of them."""
    scenes = bench.scenes(*THREE)
    if scenes:
        means = [[bench.mean(scene, phase, "events") for phase in THREE] for scene in scenes]
        fewest = sum(mine < min(others) for mine, *others in means)
        yield _counted("naive has the fewest events", fewest, len(scenes), len(scenes))
        answers = [_all(ratio(bench, s, phase, NAIVE).below for phase in (SAP, TILING)) for s in scenes]
        slowest, half = answers.count(HOLDS), len(scenes) / 2
        answer = HOLDS if slowest > half else FAILS if answers.count(FAILS) >= half else NOT_KNOWN
        yield Part("it takes the most time in more than half", answer, f"in {slowest} of {len(scenes)} cases")


def bound_events_prevail(bench: ThesisBench) -> Iterator[Part]:
    """Bound events outnumber the others, often many times over."""
    cases = [(scene, phase) for scene in bench.scenes(SAP, TILING) for phase in (SAP, TILING)]
    found = [bench.mean(*each, BOUND) / max(bench.mean(*each, "contacts"), 1.0) for each in cases]
    if found:
        more, many = (sum(each >= least for each in found) for least in (1.0, MANY))
        yield _counted("more bound events than others", more, len(found), len(found))
        yield _counted(f"at least {MANY:g} times as many in most", many, len(found), len(found) // 2 + 1)


def largest_difference(bench: ThesisBench) -> Iterator[Part]:
    """The two differ most in bound events in the scene that the thesis names."""
    ratios = {
        scene: bench.mean(scene, SAP, BOUND) / max(bench.mean(scene, TILING, BOUND), 1.0)
        for scene in bench.scenes(SAP, TILING)
    }
    if len(ratios) > 1 and (0.5, 400) in ratios:
        most = max(ratios, key=lambda scene: ratios[scene])
        text = f"bound events of {SAP} over {TILING}'s are most at .5/400"
        yield Part(text, HOLDS if most == (0.5, 400) else FAILS, f"{ratios[most]:.2f} at {most}")


def same_contacts(bench: ThesisBench) -> Iterator[Part]:
    """Contacts hardly depend on the method."""
    for kind in ("contacts_disc", "contacts_wall"):
        runs = [[bench.mean(scene, phase, kind) for phase in THREE] for scene in bench.scenes(*THREE)]
        if runs:
            level = sum(max(each) - min(each) <= LEVEL * max(each) for each in runs)
            yield _counted(f"{kind} differ by at most {LEVEL:.0%}", level, len(runs), len(runs))


STATEMENTS: Mapping[str, tuple[str, Sequence[Check]]] = {
    "B1": (
        "At densities .5 and .25 sweep-tiling is fastest, then sweep-and-prune, then naive.",
        [faster(TILING, SAP, (0.5, 0.25)), faster(SAP, NAIVE, (0.5, 0.25))],
    ),
    "B2": (
        "At density .125 naive is fastest with 25 discs; with more it is sweep-tiling, then sweep-and-prune, "
        "then naive.",
        [
            *(faster(NAIVE, other, (0.125,), (25,)) for other in (SAP, TILING)),
            *(faster(*pair, (0.125,), (100, 400)) for pair in ((TILING, SAP), (SAP, NAIVE))),
        ],
    ),
    "B3": ("At density .01 naive is fastest.", [faster(NAIVE, other, (0.01,)) for other in (SAP, TILING)]),
    "B4": (
        "Time grows fastest with n under naive, then sweep-and-prune, then sweep-tiling, at every density.",
        [grows_less(SAP, NAIVE), grows_less(TILING, SAP)],
    ),
    "B5": (
        "Sweep-tiling's lead over sweep-and-prune, in slope and in height, shrinks with the density; at .01 "
        "the slopes are almost the same, and sweep-tiling is a constant factor faster.",
        [lead_shrinks, faster(TILING, SAP, (0.01,))],
    ),
    "B6": ("Naive has the fewest events and yet takes the most time in most cases.", [fewest_events_slowest]),
    "B7": (
        "Under sweep-and-prune and sweep-tiling bound events outnumber the others, often many times over.",
        [bound_events_prevail],
    ),
    "B8": ("The two differ most in bound events with 400 discs at density .5.", [largest_difference]),
    "B9": ("The numbers of collisions and of wall contacts hardly depend on the method.", [same_contacts]),
    "B10": ("Sweep-and-prune on two axes is slower than on one.", [faster(SAP, SAP2)]),
    "B11": (
        "An event costs most under naive, because of its queue; under sweep-tiling it costs more than under "
        "sweep-and-prune.",
        [
            *(faster(one, NAIVE, per="events") for one in (SAP, TILING)),
            faster(SAP, TILING, per="events"),
            lambda _: [Part("naive's queue is longest", NOT_MEASURED, "one entry a body under all")],
        ],
    ),
}


def statements(bench: ThesisBench) -> list[Statement]:
    """Returns B1 to B11, decided by the cells of a run."""
    found = []
    for name, (text, checks) in STATEMENTS.items():
        parts = [tuple(check(bench)) for check in checks]
        answers = [_all(each.answer for each in part) if part else NOT_MEASURED for part in parts]
        found.append(Statement(name, text, _all(answers), sum(parts, ())))
    return found
