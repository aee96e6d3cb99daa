"""The report: the checks, their results, and advice for failures."""

import re
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from kinetile import Scene
from kinetile.instruments import OWN, escape
from kinetile_conformance.cases import Subject, save_case
from kinetile_conformance.checks import check_named

KIT_VERSION = "6.0"
"""The version of the set of checks."""

OFTEN = "often: "

SYMPTOMS: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("symptoms.toml").read_text(encoding="utf-8")
)
"""The mistake that is ``often`` the cause if one of these ``checks`` (none: any) fails with a message that
the regular expression ``pattern`` finds, for ``kinds`` (none: broad). Special rows are first; few mistakes
cause most symptoms."""


@dataclass(frozen=True)
class Result:
    """The result of one check: passed, failed, skipped, died (the process did not survive it), or not judged
    (its time was up). ``seconds`` are CPU seconds without compiling, by the clock if it died; ``verdict``
    names the phase that a failure is against, ``asked`` has the keys of lines that a program has answered."""

    check: str
    sentence: str
    status: str
    scenes: int
    seconds: float
    said: str = ""
    reason: str = ""
    verdict: str = ""
    bodies: int | None = None
    case: Path | None = None
    asked: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """True for a correct result."""
        return self.status in ("passed", "skipped")


@dataclass(frozen=True)
class Report:
    """All results of one broad phase, alone or with narrow phases and a response: the ``subject``."""

    subject: Subject
    distribution: str
    results: tuple[Result, ...] = ()
    seconds: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def failed(self) -> tuple[Result, ...]:
        """The results that fail; first failures of the phase's own audit, which cause the others."""
        failed = (result for result in self.results if not result.ok and result.status != "not judged")
        return tuple(sorted(failed, key=lambda result: OWN not in result.said))

    @property
    def not_judged(self) -> str:
        """The reason why the phase is not judged, if no fault was found; "" if everything was judged."""
        open_ = [result.check for result in self.results if result.status == "not judged"]
        if open_:
            return f"no fault was seen, and {', '.join(open_)} not judged"
        kinds = {"response": self.subject.response, "pair": self.subject.pair}
        for kind in [kind for kind, named in kinds.items() if named]:
            own = [result for result in self.results if check_named(result.check).judges == kind]
            if own and all(result.status == "skipped" for result in own):
                what = "response" if kind == "response" else "narrow phase"
                return f"all checks of the {what} were skipped: {own[0].reason}"
        return ""

    @property
    def conforms(self) -> bool | None:
        """True if the phase conforms; None if no fault was found and not everything was judged."""
        return False if self.failed else None if self.not_judged else True

    @property
    def ok(self) -> bool:
        """True if the phase conforms."""
        return self.conforms is True

    @property
    def limits(self) -> str:
        """The part that a verdict of conformance does not cover, as the end of its sentence."""
        return ""

    @property
    def in_doubt(self) -> bool:
        """True if some failure is as much the reference's as the phase's."""
        return any("in doubt" in result.verdict for result in self.results)

    @property
    def exit_code(self) -> int:
        """0: it conforms, 1: it does not, 3: the reference is in doubt, 4: not everything was judged."""
        return {True: 0, False: 3 if self.in_doubt else 1, None: 4}[self.conforms]

    def as_dict(self) -> dict[str, Any]:
        """Returns the report, fit for JSON."""
        return {
            "kit": KIT_VERSION,
            "broad_phase": self.subject.name,
            "options": dict(self.subject.options),
            "narrow_phases": {name: dict(options) for name, options in self.subject.narrow.items()},
            "response": {kind: each for each, kind in self.subject.beside.items()}.get("response"),
            "distribution": self.distribution,
            "conforms": self.conforms,
            "reference_in_doubt": self.in_doubt,
            "seconds": self.seconds,
            "checks": [self.row(result) for result in self.results],
            "notes": list(self.notes),
        }

    @staticmethod
    def row(result: Result) -> dict[str, Any]:
        """Returns a result, fit for JSON."""
        row = {key: value for key, value in vars(result).items() if value not in (None, "", ())}
        return {key: str(value) if isinstance(value, Path) else value for key, value in row.items()}

    def __str__(self) -> str:
        wide = max((len(result.check) for result in self.results), default=0)
        each = [line for result in self.results for line in self.lines(result, wide)]
        return "\n".join([self.head, "", *each, "", self.foot])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"

    @property
    def label(self) -> str:
        """The judged part, without the parts that are judged with it."""
        return self.subject.label

    @property
    def head(self) -> str:
        """The line above the results."""
        beside = "".join(f" with {kind} {written!r}" for written, kind in self.subject.beside.items())
        return f"conformance kit {KIT_VERSION}: broad phase {self.label!r}{beside}, of {self.distribution}"

    @property
    def foot(self) -> str:
        """The lines below the results: notes, and the verdict."""
        spent = sum(result.seconds for result in self.results)
        verdict = f"conforms ({spent:.0f} CPU s, {self.seconds:.0f} s){self.limits}"
        if self.not_judged:
            verdict = f"is not judged: {self.not_judged}"
        reasons: dict[str, list[str]] = {}
        for each in self.results:
            if each.status == "skipped":
                reasons.setdefault(each.reason, []).append(each.check)
        lines = [f"  skipped, {reason}: {', '.join(checks)}" for reason, checks in reasons.items()]
        lines += [f"  {note}" for note in self.notes]
        if self.failed:
            verdict = f"does not conform: {', '.join(result.check for result in self.failed)}"
            saved = (result for result in self.failed if result.case is not None)
            for result in sorted(saved, key=lambda result: (OWN not in result.said, result.bodies or 0))[:1]:
                lines.append(f"  begin with {result.check}: {self.replays(cast(Path, result.case))}")
        return "\n".join([*lines, f"{' with '.join([self.subject.name, *self.subject.beside])} {verdict}"])

    def lines(self, result: Result, wide: int) -> list[str]:
        """Returns the lines of one result, with its check's name padded to a width unless it is skipped."""
        if result.status == "skipped":
            return []
        scenes = f"{result.scenes:7,} {'scene ' if result.scenes == 1 else 'scenes'}"
        spent = f"{scenes}  {result.seconds:6.2f} s"
        first = f"  {result.status:10} {result.check:{wide}}  {spent}  {result.sentence}"
        return [first, *(f"             {line}" for line in self.details(result))]

    def replays(self, case: Path) -> str:
        """Returns the command that runs a saved case again."""
        return f"kinetile replay {self.label} {case}"

    def details(self, result: Result) -> list[str]:
        """Returns the lines of a result below its status."""
        case = result.case
        bodies = f"{result.bodies} {'body' if result.bodies == 1 else 'bodies'}"
        details = {
            "smallest scene found": bodies if result.bodies is not None else "",
            "verdict": result.verdict,
            "reason": result.reason,
            "replay": self.replays(case) if case else "",
            "see it": f"kinetile view {case}" if case and case.suffix == ".toml" else "",
        }
        lines = "\n".join(f"{name}: {text}" for name, text in details.items() if text)
        return [*result.said.splitlines(), *lines.splitlines()]


def likely(check: str, text: str, kind: str = "broad") -> str:
    """Returns the usual mistake of authors of this kind, broad, pair or response, if this check fails with
    these words; "" if no row applies."""
    rows = (row for row in SYMPTOMS.values() if check in row.get("checks", [check]))
    own = (row for row in rows if kind in row.get("kinds", ["broad"]))
    return next((row["often"] for row in own if re.search(row["pattern"], text)), "")


def diagnosed(check: str, text: str, subject: Subject) -> list[str]:
    """Returns the last line of such a failure, if there is one: a guess from experience."""
    kind = "response" if subject.response else "broad" if subject.pair is None else "pair"
    often = likely(check, text, kind)
    return [f"{OFTEN}{often}"] if often else []


def saved(result: Result, scene: Scene, subject: Subject, folder: Path | None) -> Result:
    """Returns a result with the file of its scene, if there is a folder and a check that replays it."""
    replayed = check_named(result.check).replay
    if folder is None or not replayed:
        return result
    name = re.sub(r"[^\w.-]+", "-", subject.name)  # the name of a phase may have "/" in it
    path = folder / f"{name}-{result.check}.toml"
    try:
        save_case(scene, path, result.said, subject, replayed)
    except OSError as error:
        why = f"(the scene could not be saved: {error.strerror or error})"
        return replace(result, said=f"{result.said}\n{why}")
    return replace(result, case=path)
