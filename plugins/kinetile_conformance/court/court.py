"""The engine behind all doors: shows scenes to checks, has what fails made smaller, and says what came of it.

``Court`` judges one phase in this process, check by check; ``kinetile_conformance.isolation`` has one in a
process of its own, with limits.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict

from kinetile.plugin.registry import registry
from kinetile.run.composition import check_options, read_narrow_phases
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject, not_saved, provided, save_case
from kinetile_conformance.checks import CHECKS, check_named
from kinetile_conformance.checks.check import Check
from kinetile_conformance.court.drawing import Drawing
from kinetile_conformance.court.limits import SECONDS, Patience, TimeIsUp, spent
from kinetile_conformance.court.reduction import reduced
from kinetile_conformance.court.report import Report, Result
from kinetile_conformance.court.telling.symptoms import OFTEN, likely
from kinetile_conformance.court.verdicts import References, Seen, applicable, verdict
from kinetile_conformance.strategies.gallery import smallest

__all__ = ["EXAMPLES", "Court", "Trial", "Wishes"]

EXAMPLES = 100
"""Scenes drawn for each check by default."""

FEW = 3
"""Bodies in a scene that one can think through."""

REDUCING = 20.0
"""CPU seconds in which a scene of hundreds of bodies is made smaller."""

AGAIN = 5
"""Times that a check is run again on the scene on which it has failed."""


class Wishes(TypedDict, total=False):
    """What can be wished for when a broad phase is judged, at whichever door.

    Attributes:
        options: the phase's options.
        narrow_phases: narrow phases that are judged with it, by name, perhaps with options; each takes the
            place of the usual one of its role. None: the broad phase is judged alone.
        examples: scenes drawn for each check; ``EXAMPLES``.
        checks: names of the checks to run; None: all that apply.
        expected_failures: checks that are known to fail, each with the reason. They are run but not
            shrunk; one that passes makes the report not ok.
        save_to: a folder for the scenes that fail, as TOML, and their pictures; None: they are not saved.
        shrink: whether to look for the smallest scene that fails; it is.
        seed: what the drawing begins with; the same seed draws the same scenes; 0.
        seconds: the CPU seconds that a check of up to ``EXAMPLES`` scenes may take, without compiling; one of
            more has so much more. A check that does not suffice with them is not judged; ``SECONDS``.
        on_result: called after each check.
        on_scene: called with the check and the number of scenes that it has been shown, for each of them; not
            where the phase is judged in the process itself.
    """

    options: Mapping[str, Any] | None
    narrow_phases: Mapping[str, Mapping[str, Any]] | Sequence[str] | None
    examples: int
    checks: Sequence[str] | None
    expected_failures: Mapping[str, str] | None
    save_to: str | os.PathLike[str] | None
    shrink: bool
    seed: int
    seconds: float
    on_result: Callable[[Result], None] | None
    on_scene: Callable[[str, int], None] | None


@dataclass(frozen=True)
class Trial:
    """A trial of one broad phase, alone or with narrow phases: what was wished for, checked, and who is on
    trial."""

    subject: Subject
    checks: tuple[str, ...]
    whole: bool
    expected: Mapping[str, str]
    examples: int
    save_to: Path | None
    shrink: bool
    seed: int
    seconds: float
    on_result: Callable[[Result], None]
    on_scene: Callable[[str, int], None]
    began: float

    @classmethod
    def of(cls, name: str, wishes: Wishes) -> Trial:
        """Return the trial of a phase; UnknownName, BadOption, or ValueError for a check that does not
        exist."""
        expected = dict(wishes.get("expected_failures") or {})
        chosen = wishes.get("checks")
        for known in [*expected, *(chosen or ())]:
            check_named(known)
        examples = wishes.get("examples", EXAMPLES)
        return cls(
            subject=_subject(name, wishes),
            checks=tuple([each.name for each in CHECKS] if chosen is None else chosen),
            whole=chosen is None,
            expected=expected,
            examples=examples,
            save_to=None if (folder := wishes.get("save_to")) is None else Path(folder),
            shrink=wishes.get("shrink", True),
            seed=wishes.get("seed", 0),
            seconds=wishes.get("seconds", SECONDS) * max(1.0, examples / EXAMPLES),
            on_result=wishes.get("on_result") or (lambda result: None),
            on_scene=wishes.get("on_scene") or (lambda check, count: None),
            began=time.perf_counter(),
        )

    def report(self, results: Sequence[Result], tight: float | None, notes: tuple[str, ...] = ()) -> Report:
        """Return the report on what came of it."""
        first, *_ = provided(self.subject)
        return Report(
            name=self.subject.name,
            options=self.subject.options,
            distribution=f"{first.distribution or 'this process'} {first.version or ''}".strip(),
            narrow_phases=self.subject.narrow,
            results=tuple(results),
            tightness=tight,
            seconds=time.perf_counter() - self.began,
            notes=notes,
        )


def _subject(name: str, wishes: Wishes) -> Subject:
    """Return who is on trial; raise UnknownName for a phase that does not exist, and BadOption for an option
    that a narrow phase does not have. Options of the broad phase are checked by the rehearsal."""
    narrow: dict[str, Mapping[str, Any]] = {}
    for each, options in read_narrow_phases(wishes.get("narrow_phases") or ()).items():
        check_options("narrow phase", each, registry().narrow_phase(each), options)
        narrow[registry().spec("narrow phase", each).name] = dict(options)
    subject = Subject(name, dict(wishes.get("options") or {}), narrow)
    provided(subject)
    return subject


class Court:
    """Judges one phase, in this process.

    Args:
        subject: the phase.
        examples: how many small scenes are drawn.
        seed: what the drawing begins with.
        seconds: the CPU seconds of a check.
        shrink: whether to look for the smallest scene that fails.
        save_to: where scenes that fail are saved; None: nowhere.
        watched: returns a check as it is to be run here.
        drawing, references: scenes that have been drawn before, and what the reference makes of them.
    """

    def __init__(
        self,
        subject: Subject,
        *,
        examples: int = EXAMPLES,
        seed: int = 0,
        seconds: float = SECONDS,
        shrink: bool = True,
        save_to: Path | None = None,
        watched: Callable[[Check], Check] | None = None,
        drawing: Drawing | None = None,
        references: References | None = None,
    ) -> None:
        self.subject = subject
        self._drawing = Drawing(examples, seed) if drawing is None else drawing
        self._references = References(subject) if references is None else references
        self._seconds = seconds
        self._shrink = shrink
        self._save_to = save_to
        self._watched = watched

    def judge(self, name: str, expected: str | None = None) -> Result:
        """Run the check of a name and say what came of it; ``expected`` is why it is known to fail."""
        each = check_named(name)
        if self._watched is not None:
            each = self._watched(each)
        skipped = applicable(self.subject, each)
        if skipped is not None:
            return Result(each.name, each.sentence, "skipped", 0, 0.0, reason=skipped)
        if each.draws and each.scenes is None:
            self._references.keep(self._drawing.small(each.turns))
        began = spent()
        seen = Seen(each, self.subject, self._references, Patience(self._seconds))
        late = self._look(seen, self._shrink and expected is None)
        result = Result(each.name, each.sentence, "passed", seen.count, 0.0)
        if seen.said is not None:
            result = self._failed(seen, result, expected)
        elif late:
            reason = f"{self._seconds:g} CPU s were not enough; no fault in the scenes seen until then"
            result = replace(result, status="not judged", reason=reason)
        elif seen.count and seen.refused == seen.count:
            reason = seen.inapplicable or f"it refuses all scenes of this check: {seen.refusal}"
            result = replace(result, status="skipped", reason=reason)
        elif expected is not None:
            reason = f"was expected to fail ({expected}), and does not"
            result = replace(result, status="xpassed", reason=reason)
        return replace(result, seconds=spent() - began)

    def _look(self, seen: Seen, shrink: bool) -> bool:
        """Show scenes to a check; return whether its time was up before it was through."""
        each = seen.each
        try:
            if not each.draws:
                seen.look(smallest())
                return False
            self._drawing.look(each, seen.look, shrink)
        except TimeIsUp:
            if seen.said is None:
                return True
        except Exception as error:  # Hypothesis: the failure does not come back when it is tried again
            if seen.said is None:
                raise
            seen.said = f"{seen.said}\n(not every time: {type(error).__name__})"
            seen.fickle = True
            return False
        if shrink and seen.said is not None:
            with suppress(TimeIsUp):  # it has time of its own
                self._look_closer(seen)
        return False

    def _look_closer(self, seen: Seen) -> None:
        """Look for a scene of fewer bodies that fails than the one left.

        Scenes of hundreds Hypothesis cannot make smaller by itself: their bodies are left out here. And with
        small ones leaving out bodies can end where no single one can be left out, and yet fewer would do: so
        where more than a few are left, scenes of a few are drawn as well.
        """
        if seen.scene is None or len(seen.scene) <= FEW:
            return
        if seen.each.scenes is not None:
            self._reduce(seen)
            return
        few = Seen(seen.each, seen.subject, self._references, Patience(self._seconds))
        try:
            self._drawing.look_among_few(seen.each, few.look, FEW)
        finally:
            seen.count += few.count
            if few.said is not None:
                seen.said, seen.scene = few.said, few.scene

    def _reduce(self, seen: Seen) -> None:
        """Leave out of a scene what is not needed for its failure."""
        found = Seen(seen.each, seen.subject)
        assert seen.scene is not None
        scene = reduced(seen.scene, lambda fewer: not found.look(fewer), REDUCING)
        again = Seen(seen.each, seen.subject)
        seen.count += found.count + 1
        if not again.look(scene) and again.said is not None:
            seen.said, seen.scene = again.said, again.scene

    def _failed(self, seen: Seen, result: Result, expected: str | None) -> Result:
        """Return the result of a check that has failed."""
        each, scene = seen.each, seen.scene
        said = f"{seen.said}{self._how_often(seen) if expected is None else ''}"
        case = picture = None
        if self._save_to is not None and scene is not None and each.replay:
            path = self._save_to / f"{self.subject.name}-{each.name}.toml"
            try:
                save_case(scene, path, each.replay, self.subject, said)
                case = path
                picture = _draw_picture(self.subject, scene, path, said)
            except OSError as error:
                said = f"{said}\n{not_saved('scene' if case is None else 'picture', error)}"
        broad = self.subject.pair is None  # a cause is one of a broad phase
        cause = likely(each.name, said) if expected is None and broad else ""
        judged = check_named(each.replay) if each.replay else each
        asked = expected is None and each.compares
        return replace(
            result,
            status="failed" if expected is None else "xfailed",
            said=f"{said}\n{OFTEN}{cause}" if cause else said,
            reason=expected or "",
            verdict=verdict(judged, self.subject, scene) if asked and scene is not None else "",
            bodies=len(scene) if scene is not None and each.replay else None,
            case=case,
            picture=picture,
        )

    def _how_often(self, seen: Seen) -> str:
        """Run the check again on the scene on which it failed; return a line where it does not always."""
        if seen.scene is None or not seen.each.draws or seen.fickle:
            return ""
        times = tried = 0
        patience = Patience(self._seconds)
        with suppress(TimeIsUp):
            while tried < AGAIN:
                times += not Seen(seen.each, self.subject, None, patience).look(seen.scene)
                tried += 1
        if times == tried:
            return ""
        return f"\n(not every time: of {tried} times more on this scene it failed {times})"


def _draw_picture(subject: Subject, scene: Scene, case: Path, said: str) -> Path:
    """Draw the moment of disagreement beside the saved case."""
    from kinetile_conformance.court.telling.picture import draw

    path = case.with_suffix(".svg")
    path.write_text(draw(subject, scene, said), encoding="utf-8")
    return path
