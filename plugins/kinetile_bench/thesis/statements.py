"""The thesis's statements about its benchmark (section 5.3), each compared with the cells of a run.

B1 to B6 and B11 are about time, B7 to B9 about numbers of events, B10 about the method that the thesis left
out. A statement is cut into parts that a number decides. Where the thesis gives no number ("almost
negligible", "many times over") the part says which one was taken.

Counts decide statements about numbers of events. Those about times are decided by the rules of
``kinetile_bench.thesis.evidence``, or not decided. A statement holds if all its parts do, does not if one
does not, and is open otherwise.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from kinetile_bench.thesis import ThesisBench, ThesisScene, evidence, plain
from kinetile_bench.thesis.evidence import Answer, Evidence, all_of, by_count, costs_of_one, more_than_half
from kinetile_bench.thesis.measures import fits

NAIVE, SAP, SAP2, TILING = "naive", "sap-1d", "sap-2d", "sweep-tiling"
THREE = (NAIVE, SAP, TILING)
"""The phases of the thesis's figures."""

SHORT = {NAIVE: "naive", SAP: "sap", SAP2: "sap-2d", TILING: "tiling"}

MANY = 3.0
"""Bound events for one of the others that count as many times over."""


NEGLIGIBLE = 0.1
"""A difference of exponents that counts as almost negligible."""


Scenes = Sequence[ThesisScene]


class StatementPart(NamedTuple):
    """A part of a statement: what it says, whether that holds, and the numbers that decide it."""

    text: str
    answer: Answer
    numbers: str


# Parts about numbers of events


def _fewest_events(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    fewest = [
        scene
        for scene in scenes
        if all(bench.mean(scene, each, "events") > bench.mean(scene, NAIVE, "events") for each in THREE[1:])
    ]
    return StatementPart(
        "naive has the fewest events",
        by_count(len(fewest) == len(scenes)),
        f"in {len(fewest)} of {len(scenes)} scenes",
    )


def _bound_events_prevail(bench: ThesisBench, scenes: Scenes) -> Iterable[StatementPart]:
    """Whether bound events outnumber the others under sweep-and-prune and sweep-tiling."""
    many = 0
    for phase in (SAP, TILING):
        found = [
            bench.mean(each, phase, "bound_events") / max(bench.mean(each, phase, "contacts"), 1e-9)
            for each in scenes
        ]
        least = min(found)
        many += sum(each >= MANY for each in found)
        yield StatementPart(
            f"more bound events than others in every scene under {SHORT[phase]}",
            by_count(least > 1.0),
            f"{least:.2f} (density/n {scenes[found.index(least)]}) to {max(found):.1f} for one of the others",
        )
    yield StatementPart(
        f"at least {MANY:g} times as many in more than half of the cases",
        by_count(many > len(scenes)),
        f"in {many} of {2 * len(scenes)}",
    )


def _largest_difference(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    """Whether the two differ most in the scene that the thesis names."""
    ratios = {}
    for scene in scenes:
        pairs = bench.seed_by_seed(scene, (SAP, TILING))
        found = [a.bound_events / b.bound_events if b.bound_events else 1.0 for a, b in pairs]
        ratios[scene] = statistics.median(found or [1.0])
    (most, ratio), (second, next_ratio) = sorted(ratios.items(), key=lambda item: -item[1])[:2]
    return StatementPart(
        f"bound events {_over(SAP, TILING)} are most at density/n .5/400",
        by_count(most == (0.5, 400)),
        f"{ratio:.2f} at {most}, then {next_ratio:.2f} at {second}",
    )


def _same_contacts(bench: ThesisBench, scenes: Scenes) -> Iterable[StatementPart]:
    """Whether contacts do not depend on the method; nothing without a run of all three."""
    runs = [cells for scene in scenes for cells in bench.seed_by_seed(scene, THREE)]
    if not runs:
        return
    counts = [
        [getattr(c, kind) for c in cells] for kind in ("contacts_disc", "contacts_wall") for cells in runs
    ]
    furthest = max((max(each) - min(each)) / max(*each, 1) for each in counts)
    same = sum(len({cell.fingerprint for cell in cells}) == 1 for cells in runs)
    yield StatementPart(
        "they differ by at most 1 %",
        by_count(furthest <= 0.01),
        f"by at most {100 * furthest:.2g} %; the whole list of contacts is the same, bit for bit, in "
        f"{same} of {len(runs)} runs",
    )


def _longest_queue(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    """The length of naive's queue, which cannot be compared here: a body has one entry under every method.
    Instead, how many partners are looked at for one event."""
    last = _most_discs(scenes)
    lengths = _listed(f"{SHORT[p]} {bench.mean(last, p, 'queue_max'):,.0f}" for p in THREE)
    asked = _listed(f"{SHORT[p]} {bench.mean(last, p, 'partners_per_event'):,.1f}" for p in THREE)
    return StatementPart(
        "naive's queue is longest in every scene",
        Answer.NOT_MEASURED,
        f"the queue has one entry a body and none a pair, under every method, at {last}: {lengths}. Partners "
        f"looked at for one event: {asked}",
    )


# Parts about time


def _in_order(bench: ThesisBench, scenes: Scenes, text: str, *pairs: tuple[str, str]) -> StatementPart:
    """Whether in all scenes the first of each pair of phases is faster than the second."""
    found = {pair: [evidence.ratio(bench, scene, *pair) for scene in scenes] for pair in pairs}
    ratios = [f"{_over(*pair)} {_listed(ratios)}" for pair, ratios in found.items()]
    sizes = _listed(scene.bodies for scene in scenes)
    return StatementPart(
        f"{text} at density {plain(scenes[0].density)}, n = {sizes}",
        all_of(each.below() for ratios in found.values() for each in ratios),
        f"time {'; '.join(ratios)}",
    )


def _tiling_first(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    return _in_order(bench, scenes, "tiling < sap < naive", (TILING, SAP), (SAP, NAIVE))


def _naive_first(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    return _in_order(bench, scenes, "naive is fastest", (NAIVE, SAP), (NAIVE, TILING))


def _slopes(bench: ThesisBench, scenes: Scenes) -> Iterable[StatementPart]:
    """Whether time grows fastest under naive, then sweep-and-prune, then sweep-tiling, at each density."""
    for density, group in _by_density(scenes).items():
        found = {phase: fits(bench, density, phase, "cost")[:1] for phase in THREE}
        if len(group) > 1 and all(fit and fit[0].exponent is not None for fit in found.values()):
            falling = (evidence.growth(bench, density, *pair) for pair in ((SAP, NAIVE), (TILING, SAP)))
            exponents = _listed(f"{SHORT[phase]} {fit[0]}" for phase, fit in found.items())
            yield StatementPart(
                f"at density {plain(density)}",
                all_of(each.below() for each in falling),
                f"exponents {exponents}",
            )


def _lead(bench: ThesisBench, scenes: Scenes) -> Iterable[StatementPart]:
    """Whether sweep-tiling's lead over sweep-and-prune shrinks with the density."""
    found = {
        density: evidence.growth(bench, density, SAP, TILING)
        for density, group in _by_density(scenes).items()
        if len(group) > 1
    }
    differences = {
        density: "{:.2f} ({:.2f} to {:.2f})".format(*(x / evidence.reach(bench, density) for x in each.span))
        for density, each in found.items()
    }
    if len(found) > 1:
        yield StatementPart(
            "the difference in slope shrinks at each step",
            _falling(list(found.values())),
            f"exponents sap - tiling {_listed(differences.values())} at {_listed(map(plain, found))}",
        )
    n = max((scene.bodies for scene in scenes), default=0)
    largest = [scene for scene in scenes if scene.bodies == n]
    if len(largest) > 1:
        heights = [evidence.ratio(bench, scene, SAP, TILING) for scene in largest]
        densities = _listed(plain(scene.density) for scene in largest)
        yield StatementPart(
            f"the difference in height shrinks at each step, with n = {n}",
            _falling(heights),
            f"time {_over(SAP, TILING)} {_listed(heights)} at {densities}",
        )
    if 0.01 in found:
        distance = found[0.01]._replace(logs=tuple(map(abs, found[0.01].logs)))
        yield StatementPart(
            f"at .01 the slopes differ by at most {NEGLIGIBLE:g}",
            distance.below(math.exp(NEGLIGIBLE * evidence.reach(bench, 0.01))),
            f"exponents sap - tiling {differences[0.01]}",
        )
        yield _in_order(bench, _by_density(scenes)[0.01], "tiling is faster", (TILING, SAP))


def _falling(values: Sequence[Evidence]) -> Answer:
    """Returns whether each value is less than the one before, pair by pair."""
    steps = [
        Evidence(
            tuple(later - earlier for earlier, later in zip(one.logs, two.logs, strict=False)),
            max(one.unrest, two.unrest),
        )
        for one, two in pairwise(values)
    ]
    return all_of(step.below() for step in steps)


def _slowest(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    """Whether naive takes the most time in most scenes."""
    answers = [
        all_of(evidence.ratio(bench, scene, other, NAIVE).below() for other in THREE[1:]) for scene in scenes
    ]
    found = [scene for scene, answer in zip(scenes, answers, strict=True) if answer is Answer.YES]
    unclear = len(scenes) - len(found) - answers.count(Answer.NO)
    return StatementPart(
        "it takes the most time in more than half of the scenes",
        more_than_half(answers),
        f"in {len(found)} of {len(scenes)}"
        + (f", density/n {_listed(found)}" if found else "")
        + (f"; {unclear} undecided" if unclear else ""),
    )


def _dearest_event(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    """Whether an event costs most under naive."""
    last = _most_discs(scenes)
    micro = _listed(f"{SHORT[p]} {bench.mean(last, p, 'microseconds_per_event'):.3g}" for p in THREE)
    cheaper = [evidence.ratio(bench, scene, p, NAIVE, costs_of_one) for p in THREE[1:] for scene in scenes]
    return StatementPart(
        "naive's is dearest in every scene",
        all_of(ratio.below() for ratio in cheaper),
        f"the others' are {_range(cheaper)} of it; microseconds at {last}: {micro}",
    )


def _dearer_event(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    """Whether an event costs more under sweep-tiling than under sweep-and-prune."""
    ratios = [evidence.ratio(bench, scene, SAP, TILING, costs_of_one) for scene in scenes]
    return StatementPart(
        "tiling's is dearer than sap's in every scene",
        all_of(ratio.below() for ratio in ratios),
        f"sap's are {_range(ratios)} of it",
    )


def _two_axes_slower(bench: ThesisBench, scenes: Scenes) -> StatementPart:
    """Whether sweep-and-prune on two axes is slower than on one."""
    ratios = [evidence.ratio(bench, scene, SAP, SAP2) for scene in scenes]
    answers = [ratio.below() for ratio in ratios]
    faster = [scene for scene, answer in zip(scenes, answers, strict=True) if answer is Answer.NO]
    unclear = len(answers) - answers.count(Answer.YES) - len(faster)
    return StatementPart(
        "in every scene",
        all_of(answers),
        f"time {_over(SAP, SAP2)} {_range(ratios)}"
        + (f"; not slower at density/n {_listed(faster)}" if faster else "")
        + (f"; {unclear} of {len(scenes)} scenes undecided" if unclear else ""),
    )


def _by_density(scenes: Scenes) -> dict[float, list[ThesisScene]]:
    groups: dict[float, list[ThesisScene]] = {}
    for scene in scenes:
        groups.setdefault(scene.density, []).append(scene)
    return groups


def _most_discs(scenes: Scenes) -> ThesisScene:
    """Returns the scene with the most discs at the density of the first."""
    return max(_by_density(scenes)[scenes[0].density], key=lambda scene: scene.bodies)


def _range(ratios: Sequence[Evidence]) -> str:
    """Returns the smallest and the largest of ratios, by their medians."""
    medians = [math.exp(ratio.span[0]) for ratio in ratios]
    return f"{min(medians):.2g} to {max(medians):.2g}"


def _listed(found: Iterable[object]) -> str:
    return ", ".join(map(str, found))


def _over(one: str, two: str) -> str:
    """Returns how a ratio of two phases is written."""
    return f"{SHORT[one]}/{SHORT[two]}"


class Statement(NamedTuple):
    """A statement of the thesis, and its parts: none where the run has not measured what it is about."""

    name: str
    text: str
    parts: tuple[StatementPart, ...]

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        if not self.parts:
            return "not measured"
        answer = all_of(part.answer for part in self.parts)
        return {Answer.YES: "holds", Answer.NO: "does not hold"}.get(answer, answer.value)

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types."""
        parts = [part._asdict() | {"answer": part.answer.value} for part in self.parts]
        return {"name": self.name, "text": self.text, "verdict": self.verdict, "parts": parts}


def statements(bench: ThesisBench) -> list[Statement]:
    """Returns B1 to B11, decided by the cells of a run."""
    three, two, axes = (bench.scenes(*phases) for phases in (THREE, (SAP, TILING), (SAP, SAP2)))
    groups = _by_density(three)
    small = [scene for scene in groups.get(0.125, ()) if scene.bodies == 25]
    large = [scene for scene in groups.get(0.125, ()) if scene.bodies > 25]
    sparse = groups.get(0.01)
    found = (
        (
            "At densities .5 and .25 sweep-tiling is fastest, then sweep-and-prune, then naive.",
            [_tiling_first(bench, group) for density, group in groups.items() if density >= 0.25],
        ),
        (
            "At density .125 naive is fastest with 25 discs; with more it is sweep-tiling, then "
            "sweep-and-prune, then naive.",
            [_naive_first(bench, small), _tiling_first(bench, large)] if small and large else [],
        ),
        ("At density .01 naive is fastest.", [_naive_first(bench, sparse)] if sparse else []),
        (
            "Time grows fastest with n under naive, then sweep-and-prune, then sweep-tiling, "
            "at every density.",
            _slopes(bench, three),
        ),
        (
            "Sweep-tiling's lead over sweep-and-prune, in slope and in height, shrinks with the density; at "
            ".01 the slopes are almost the same, and sweep-tiling is a constant factor faster.",
            _lead(bench, three),
        ),
        (
            "Naive has the fewest events and yet takes the most time in most cases.",
            [_fewest_events(bench, three), _slowest(bench, three)] if three else [],
        ),
        (
            "Under sweep-and-prune and sweep-tiling bound events outnumber the others, often many "
            "times over.",
            _bound_events_prevail(bench, two) if two else [],
        ),
        (
            "The two differ most in bound events with 400 discs at density .5.",
            [_largest_difference(bench, two)] if len(two) > 1 and (0.5, 400) in two else [],
        ),
        (
            "The numbers of collisions and of wall contacts hardly depend on the method.",
            _same_contacts(bench, three),
        ),
        (
            "Sweep-and-prune on two axes is slower than on one.",
            [_two_axes_slower(bench, axes)] if axes else [],
        ),
        (
            "An event costs most under naive, because of its queue; under sweep-tiling it costs more than "
            "under sweep-and-prune.",
            [_dearest_event(bench, three), _longest_queue(bench, three), _dearer_event(bench, three)]
            if three
            else [],
        ),
    )
    return [Statement(f"B{k}", text, tuple(parts)) for k, (text, parts) in enumerate(found, start=1)]
