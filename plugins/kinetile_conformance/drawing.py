"""Scenes for checks: drawn once for all checks of a strategy, and minimised if they fail.

Hypothesis would minimise the drawn numbers of a scene, could not omit one body of a swarm, and takes a
hundred times as long for commands. ``reduced`` has four steps; each keeps only scenes that still fail (an
invalid scene does not):

1. The run is shortened by halves, so all later steps cost less.
2. Bodies are omitted by halves, quarters, eighths, ... one by one: delta debugging (Zeller and Hildebrandt,
   "Simplifying and isolating failure-inducing input", 2002). Halves by number are tried first, then halves by
   the order of x: bodies that meet are neighbours.
3. Commands are omitted in the same way.
4. Numbers are rounded to fewer digits: all numbers together, then the numbers of each body.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from typing import Generic, TypeVar

import numpy as np

from kinetile import Scene
from kinetile.arrays import Flags, Integers
from kinetile.errors import KinetileError, Refused
from kinetile_conformance.cases import horizon, is_living
from kinetile_conformance.checks import most
from kinetile_conformance.checks.check import Check
from kinetile_conformance.deadline import spent, uncounted
from kinetile_conformance.strategies.changes import ended_at, only_bodies, only_commands
from kinetile_conformance.strategies.gallery import smallest


@dataclass
class Drawing:
    """The scenes for the checks of a run, from a seed, each as changed by ``dressed`` for the phases."""

    examples: int
    seed: int
    dressed: Callable[[Scene], Scene] = lambda scene: scene
    _drawn: dict[str, tuple[list[Scene | Refused], Iterator[Scene | Refused]]] = field(default_factory=dict)

    def _shown(self, scene: Scene) -> Scene | Refused:
        try:
            return self.dressed(scene)
        except Refused as error:
            return error

    def scenes(self, each: Check) -> Iterator[Scene | Refused]:
        """Yields the scenes of a check's strategy, each drawn at its first use, and once; or the error of a
        response under test that refuses a scene."""
        strategy = each.strategy
        if strategy is None:
            yield smallest()
            return
        for at in range(each.count(self.examples)):
            with uncounted():  # playing a living scene takes as long as judging many
                if strategy.name not in self._drawn:
                    drawn = strategy.draw(most(strategy, self.examples), self.seed)
                    self._drawn[strategy.name] = [], map(self._shown, drawn)
                had, more = self._drawn[strategy.name]
                had += islice(more, int(at == len(had)))
            yield from had[at : at + 1]


FAMILIAR = 2
"""The fewest bodies after minimising: one alone meets no other."""

HALVINGS = 30
"""The most halvings of the length of a run."""

DIGITS = (0, 1, 2, 3, 4, 6, 8, 10, 13, 17, 21, 26, 32)
"""Binary digits after the point of rounded numbers, the fewest first."""


Case = TypeVar("Case")


class Search(Generic[Case]):
    """The smallest failing case so far, and the time left to search for a smaller one."""

    def __init__(self, scene: Case, fails: Callable[[Case], bool], seconds: float) -> None:
        self.scene = scene
        self.fails = fails
        self.end = spent() + seconds

    @property
    def over(self) -> bool:
        """Returns True if no time is left."""
        return spent() >= self.end

    def take(self, make: Callable[[], Case]) -> bool:
        """Makes a smaller scene, and keeps it if it is valid and fails; returns True if it was kept."""
        if self.over:
            return False
        try:
            scene = make()
        except KinetileError:
            return False
        if not self.fails(scene):
            return False
        self.scene = scene
        return True


def reduced(scene: Scene, fails: Callable[[Scene], bool], seconds: float) -> Scene:
    """Returns a smaller scene for which ``fails`` is true, as for the given one; the given scene if no
    smaller one fails. Starts no scene after this many CPU seconds of this process."""
    return minimised(scene, fails, seconds, (_shorten, _leave_out_bodies, _leave_out_commands, _round))


def minimised(
    case: Case, fails: Callable[[Case], bool], seconds: float, steps: Sequence[Callable[[Search[Case]], None]]
) -> Case:
    """Returns a smaller case that fails; repeats the steps until none makes it smaller; see ``reduced``."""
    search = Search(case, fails, seconds)
    before = None
    while before != search.scene and not search.over:
        before = search.scene
        for step in steps:
            step(search)
    return search.scene


def _shorten(search: Search[Scene]) -> None:
    """Ends the run soon after the fault: at once, or after half, a quarter, ..., of its time."""
    start = search.scene.start
    if horizon(search.scene) <= start or search.take(partial(ended_at, search.scene, start)):
        return
    for _ in range(HALVINGS):
        half = start + (horizon(search.scene) - start) / 2.0
        if not search.take(partial(ended_at, search.scene, half)):
            return


def by_number(scene: Scene) -> Integers:
    """Returns the bodies of a scene, in order of their numbers."""
    return np.arange(len(scene))


def _leave_out_bodies(search: Search[Scene]) -> None:
    least = 1 if is_living(search.scene) else FAMILIAR
    leave_out(search, by_number, only_bodies, least)
    leave_out(search, lambda scene: np.argsort(scene.position[:, 0], kind="stable"), only_bodies, least)


def _leave_out_commands(search: Search[Scene]) -> None:
    if search.scene.commands and not search.take(lambda: search.scene.replace(commands=())):
        leave_out(search, lambda scene: np.arange(len(scene.commands)), only_commands, 1)


def leave_out(
    search: Search[Case],
    order: Callable[[Case], Integers],
    only: Callable[[Case, Integers], Case],
    least: int,
) -> None:
    """Omits parts of the list ``order`` while at least ``least`` are left, and the scene fails."""
    parts = 2
    while not search.over:
        left = listed = order(search.scene)
        if len(listed) <= least:
            return
        parts = min(parts, len(listed))
        whole = search.scene  # omitting bodies changes their numbers, so parts are selected from the whole
        for cut in np.array_split(listed, parts):
            rest = left[~np.isin(left, cut)]
            if len(rest) >= least and search.take(partial(only, whole, rest)):
                left = rest
        if len(left) < len(listed):
            parts = max(2, parts - 1)
        elif parts == len(listed):
            return
        else:
            parts *= 2


def _round(search: Search[Scene]) -> None:
    """Rounds positions, velocities and radii to few binary digits, for all bodies, then for each."""
    sizes = () if search.scene.shapes else ("radius",)
    for fields in (("position", "velocity", *sizes), ("velocity",), ("position",), sizes):
        _round_some(search, fields, np.ones(len(search.scene), dtype=np.bool_))
    for body in range(len(search.scene)):
        for name in ("velocity", "position"):
            _round_some(search, (name,), np.arange(len(search.scene)) == body)


def _round_some(search: Search[Scene], fields: tuple[str, ...], which: Flags) -> None:
    unit = 2.0 ** np.ceil(np.log2(float(search.scene.radius.max())))
    for digits in DIGITS:
        new = {}
        for name in fields:
            old = getattr(search.scene, name)
            chosen = which[:, None] if old.ndim == 2 else which
            step = unit * 2.0**-digits
            new[name] = np.where(chosen, np.round(old / step) * step, old)
        if all(np.array_equal(new[name], getattr(search.scene, name)) for name in fields):
            return
        if search.take(partial(search.scene.replace, **new)):
            return
