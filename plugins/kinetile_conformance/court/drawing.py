"""Drawing scenes with Hypothesis, and looking for a smaller one that fails.

Small scenes are drawn once and shown to all checks that look at such: to draw one takes longer than to run
it. What is drawn depends on the seed alone, so that the scene which failed can be drawn again and shrunk:
all that come before it are passed over without being run.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kinetile.errors import MissingExtra
from kinetile.scene import Scene
from kinetile_conformance.checks.check import Check

__all__ = ["Drawing"]


class _Fails(Exception):
    """A scene on which the check fails: what Hypothesis is to shrink."""


class Drawing:
    """What is drawn for the checks of a trial.

    Args:
        examples: how many small scenes.
        seed: what the drawing begins with; the same seed draws the same scenes.
    """

    def __init__(self, examples: int, seed: int) -> None:
        self.examples = examples
        self.seed = seed
        self._small: dict[bool, list[Scene]] = {}

    def count(self, each: Check) -> int:
        """Return how many scenes a check is to see."""
        return max(1, round(each.share * self.examples))

    def small(self, turns: bool) -> list[Scene]:
        """Return the small scenes, with or without turns."""
        if turns not in self._small:
            drawn: list[Scene] = []

            def keep(scene: Scene) -> bool:
                drawn.append(scene)
                return True

            draw(_small(turns), keep, self.examples, self.seed, shrink=False)
            self._small[turns] = drawn
        return self._small[turns]

    def look(self, each: Check, holds: Callable[[Scene], bool], shrink: bool) -> bool:
        """Show scenes to a check until it fails on one; then, if so wished, ever smaller ones on which it
        does. Return whether it ever fails.

        Raises FlakyError of Hypothesis where a failure does not come back.
        """
        if each.scenes is not None:
            return not draw(each.scenes(), holds, self.count(each), self.seed, shrink)
        scenes = self.small(each.turns)[: self.count(each)]
        failed = next((at for at, scene in enumerate(scenes) if not holds(scene)), None)
        if failed is not None and shrink:
            draw(_small(each.turns), holds, self.count(each), self.seed, shrink, passed_over=failed)
        return failed is not None

    def look_among_few(self, each: Check, holds: Callable[[Scene], bool], most: int) -> None:
        """Show small scenes of so few bodies to a check, until it fails on one, and shrink that."""
        draw(_small(each.turns, most), holds, 8 * self.examples, self.seed, shrink=True)


def _small(turns: bool, most: int | None = None) -> Any:
    from kinetile_conformance.strategies import MOST, scenes

    return scenes(turns=turns, most=most or MOST)


def draw(
    strategy: Any,
    holds: Callable[[Scene], bool],
    examples: int,
    seed: int,
    shrink: bool,
    passed_over: int = 0,
) -> bool:
    """Draw scenes until one does not hold; then make it smaller. Return whether all hold.

    The first ``passed_over`` are taken to hold, without being looked at.
    """
    try:
        from hypothesis import HealthCheck, Phase, given, settings
        from hypothesis import seed as seeded
    except ImportError as error:
        raise MissingExtra("the conformance kit", "hypothesis", "conformance") from error

    drawn = 0

    @seeded(seed)
    @settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=[Phase.generate, *([Phase.shrink] if shrink else [])],
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def look(scene: Scene) -> None:
        nonlocal drawn
        drawn += 1
        if drawn > passed_over and not holds(scene):
            raise _Fails

    try:
        look()
    except _Fails:
        return False
    return True
