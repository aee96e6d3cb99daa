"""Differences of two runs, for ``kinetile compare``, pages and the conformance kit. A broad phase may never
change an answer, so there is no tolerance: rows have the same bits, or they differ, and -0.0 is not 0.0."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from kinetile.arrays import Array, Floats, Rows
from kinetile.errors import FAULTS, BadOption, answering
from kinetile.kernel.log import WALLS
from kinetile.kernel.plan import Plan
from kinetile.plugin.choices import write_phase
from kinetile.plugin.registry import installed
from kinetile.run.compose import Named, accepting
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.scene.checks import shown

Choice = str | tuple[str, Mapping[str, Any]]

JUDGES_GROUP = "kinetile.judges"
"""Entry points of plugins that judge contacts: each is a function of a scene, lists of contacts by the name
of their source, the index of the first different contact, and the narrow phases. It returns a sentence that
names the right contact, or "" if it cannot decide."""


def first_difference(one: Array, other: Array) -> int | None:
    """Returns the index of the first row with different bits in two arrays, or in one alone, if any."""
    shared = min(len(one), len(other))
    unlike = np.flatnonzero((_bits(one[:shared]) != _bits(other[:shared])).any(axis=1))
    if len(unlike):
        return int(unlike[0])
    return None if len(one) == len(other) else shared


def _bits(rows: Array) -> NDArray[np.uint8]:
    """Returns rows as their bytes, (n, size)."""
    size = rows.dtype.itemsize * (rows.shape[1] if rows.ndim == 2 else 1)
    return np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), size)


@dataclass(frozen=True)
class Outcome:
    """The data that two runs of a scene must have in common. ``ended`` is "ran", or the error that ended the
    run, with its message; ``bodies`` are the numbers of the bodies in ``positions`` and ``velocities``."""

    contacts: Rows
    ended: str
    time: float
    bodies: NDArray[np.int32]
    positions: Floats
    velocities: Floats


def outcome_of(simulation: Simulation, ended: str = "ran") -> Outcome:
    """Returns the outcome of a run up to now."""
    places = simulation.bodies, simulation.positions(), simulation.velocities()
    return Outcome(simulation.contacts, ended, simulation.time, *places)


@dataclass(frozen=True)
class Divergence:
    """The first place where a phase's answer differs from the reference's: ``what`` is "contact" (``index``
    counts contacts from 0), "end" or "body" (``index`` is the body, at the end).

    ``expected`` and ``found`` are rows with exact ticks, or None without such a contact; ``before`` is the
    last common contact; ``judged`` names the right contact, if a plugin can decide (``JUDGES_GROUP``).
    """

    reference: str
    phase: str
    what: str
    index: int
    expected: Mapping[str, Any] | None
    found: Mapping[str, Any] | None
    before: Mapping[str, Any] | None = None
    judged: str = ""

    @property
    def place(self) -> str:
        """The place in words."""
        places = {"contact": f"contact {self.index}", "body": f"body {self.index} at the end"}
        return places.get(self.what, "the end")

    def __str__(self) -> str:
        lines = [f"{self.phase} differs from {self.reference} at {self.place}:"]
        rows = [(self.reference, self.expected), (self.phase, self.found)]
        if self.before is not None:
            rows.insert(0, ("(before, the same)", self.before))
        width = max(len(name) for name, _ in rows)
        lines += [f"  {name:{width}}  {describe_row(row)}" for name, row in rows]
        return "\n".join([*lines, f"  {self.judged}"] if self.judged else lines)


def find_divergence(reference: str, phase: str, expected: Outcome, found: Outcome) -> Divergence | None:
    """Returns the first place where an outcome differs from the reference's: contacts, end, final state; but
    another end precedes the contacts that are missing because of it."""
    ends = [{"time": each.time, "ended": each.ended.partition(":")[0]} for each in (expected, found)]
    end = Divergence(reference, phase, "end", len(expected.contacts), expected=ends[0], found=ends[1])
    at = first_difference(expected.contacts, found.contacts)
    if at is not None:
        if at == min(len(expected.contacts), len(found.contacts)) and ends[0]["ended"] != ends[1]["ended"]:
            return end
        here, there = _row(expected.contacts, at), _row(found.contacts, at)
        return Divergence(reference, phase, "contact", at, here, there, _row(expected.contacts, at - 1))
    if ends[0] != ends[1]:
        return end
    states = [np.hstack([each.positions, each.velocities]).reshape(-1, 4) for each in (expected, found)]
    body = first_difference(*states)
    if body is None:
        return None
    here, there = (dict(zip(Plan._fields, state[body].tolist(), strict=True)) for state in states)
    return Divergence(reference, phase, "body", int(expected.bodies[body]), here, there)


def _row(contacts: Array, index: int) -> dict[str, Any] | None:
    if not 0 <= index < len(contacts):
        return None
    return dict(zip(contacts.dtype.names or (), contacts[index].item(), strict=True))


def describe_row(row: Mapping[str, Any] | None) -> str:
    """Returns a contact, another row of a log, an end or a body as text, numbers to the last digit."""
    if row is None:
        return "no such contact"
    if "tick" in row:
        b = f"the {WALLS[row['b']]} wall" if row["b"] in WALLS else f"body {row['b']}"
        b = "a command" if row["b"] < min(WALLS) else b
        return f"body {row['a']} with {b} at time {row['time']!r} (epoch {row['epoch']}, tick {row['tick']})"
    if "ended" in row:
        ran = row["ended"] == "ran"
        return f"ran to time {row['time']!r}" if ran else f"ended at time {row['time']!r} with {row['ended']}"
    values = {name: repr(value) if isinstance(value, float) else value for name, value in row.items()}
    return ", ".join(f"{name} {value}" for name, value in values.items())


@dataclass(frozen=True)
class PhaseOutcome:
    """The run of one broad phase in a comparison; ``fault`` is the error that ended it, or None."""

    phase: str
    broad_phase: str
    options: Mapping[str, Any]
    time: float
    contacts: int
    fingerprint: str
    events: int
    cpu_seconds: float
    fault: str | None


@dataclass(frozen=True)
class Comparison:
    """The result of ``compare``: an outcome of each phase, and a divergence of each unlike the first."""

    outcomes: tuple[PhaseOutcome, ...]
    divergences: tuple[Divergence, ...] = field(default=())

    @property
    def identical(self) -> bool:
        """True if all phases gave one answer."""
        return not self.divergences

    @property
    def fault(self) -> str | None:
        """The reference's fault, if every run ended in one; None if any run came to its end."""
        faults = [outcome.fault for outcome in self.outcomes]
        return faults[0] if faults and all(fault is not None for fault in faults) else None

    @property
    def first_divergence(self) -> Divergence | None:
        """The earliest divergence of all, or None."""
        order = "contact", "end", "body"
        return min(self.divergences, key=lambda d: (order.index(d.what), d.index), default=None)

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types, fit for JSON."""
        first = self.first_divergence
        return {
            "identical": self.identical,
            "phases": [vars(outcome) | {"options": dict(outcome.options)} for outcome in self.outcomes],
            "first_divergence": first and vars(first),
            "divergences": [vars(divergence) for divergence in self.divergences],
        }


def _judged(simulation: Simulation, lists: Mapping[str, Any], index: int) -> str:
    """Returns the sentence of the first judge that decides between two lists of contacts, or ""."""
    judges = (cast(Callable[..., str], plugin.load()) for plugin in installed(JUDGES_GROUP))
    verdicts = (judge(simulation.scene, lists, index, simulation.narrow_phases) for judge in judges)
    return next(filter(None, verdicts), "")


def _choices(
    scene: Scene, given: Sequence[Choice] | None, narrow: Any
) -> list[tuple[str, Mapping[str, Any]]]:
    """Returns the broad phases to compare, at least two, each with its options."""
    chosen = accepting(scene, narrow) if given is None else list(given)
    if len(chosen) < 2:
        raise BadOption(f"a comparison needs at least two broad phases; found {len(chosen)}")
    choices = [(choice, {}) if isinstance(choice, str) else choice for choice in chosen]
    for odd in (each for each in choices if not isinstance(each, tuple | list) or len(each) != 2):
        raise BadOption(f"broad_phases has {shown(odd)}; expected a name, or a pair (name, options)")
    return choices


@answering
def compare(
    scene: Scene,
    broad_phases: Sequence[Choice] | None = None,
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    narrow_phases: Sequence[str] | Named | None = None,
    start: Callable[[str, Simulation], Any] | None = None,
    finish: Callable[[PhaseOutcome], Any] | None = None,
    progress: Callable[[Any], None] | None = None,
) -> Comparison:
    """Runs a scene under each of at least two broad phases, and compares all with the first.

    Args:
        broad_phases: names, or pairs (name, options); None: all installed ones that accept the scene.
        until: the end; None: the scene's own, with ``max_contacts`` as well, or one time unit without both.
        narrow_phases: as for ``Simulation``.
        start: called with a label and the simulation before each run.
        finish: called with the outcome of each run after it.
        progress: as for ``Simulation.run``.

    A fault in a run (ZenoError, MissedContactError, PhaseError, AuditError) is part of its answer. Raises
    BadOption for fewer than two phases, and as ``Simulation`` for names and options.
    """
    choices = _choices(scene, broad_phases, narrow_phases)
    if until is None:
        until = scene.settings.until
    if until is None and max_contacts is None:
        until = scene.start + 1.0
    reference: Outcome | None = None
    outcomes: list[PhaseOutcome] = []
    divergences: list[Divergence] = []
    waiting = [Simulation(scene, name, options=of, narrow_phases=narrow_phases) for name, of in choices]
    waiting.reverse()
    for name, options in choices:
        label, simulation = write_phase(name, options), waiting.pop()
        if start is not None:
            start(label, simulation)
        ended = "ran"
        try:
            simulation.run(until, max_contacts=max_contacts, progress=progress)
        except FAULTS as error:
            ended = f"{type(error).__name__}: {error}"
        outcome = outcome_of(simulation, ended)
        run = (len(outcome.contacts), simulation.fingerprint, simulation.readings.events)
        fault, seconds = None if ended == "ran" else ended, simulation.readings.cpu_seconds
        phase = (label, simulation.broad_phase, dict(simulation.options))
        outcomes.append(PhaseOutcome(*phase, outcome.time, *run, seconds, fault))
        if finish is not None:
            finish(outcomes[-1])
        if reference is None:
            reference = outcome
            continue
        divergence = find_divergence(outcomes[0].phase, label, reference, outcome)
        if divergence is not None and divergence.what == "contact":
            lists = {outcomes[0].phase: reference.contacts, label: outcome.contacts}
            divergence = replace(divergence, judged=_judged(simulation, lists, divergence.index))
        divergences += [divergence] if divergence else []
    return Comparison(tuple(outcomes), tuple(divergences))
