"""Where two runs differ: the one place that finds it: for checks, the player and the command.

A broad phase may change how long a run takes, never its answer. So nothing is compared with a tolerance: rows
are the same bits, or they differ, and -0.0 is not 0.0. ``first_difference`` finds the row; ``difference``
says in a sentence where the outcome of a case differs from the reference's; ``compare`` runs one scene under
several broad phases and keeps each divergence with its exact ticks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import AuditError, BadOption, MissedContactError, PhaseError, ZenoError
from kinetile.kernel.log import WALLS
from kinetile.plugin.choices import write_phase
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile_accuracy.specification.certify import explain_difference
from kinetile_conformance.cases import REFERENCE, RunOutcome, Tables

Choice = str | tuple[str, Mapping[str, Any]]


def first_difference(one: NDArray[Any], other: NDArray[Any]) -> int | None:
    """Return the index of the first row in which two arrays are not the same bits; None: there is none.

    Where one array goes on after the end of the other, that is its first further row.
    """
    shared = min(len(one), len(other))
    unlike = np.flatnonzero((_bits(one[:shared]) != _bits(other[:shared])).any(axis=1))
    if len(unlike):
        return int(unlike[0])
    return None if len(one) == len(other) else shared


def _bits(rows: NDArray[Any]) -> NDArray[np.uint8]:
    """Return rows as their bytes, (n, size)."""
    size = rows.dtype.itemsize * (rows.shape[1] if rows.ndim == 2 else 1)
    return np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), size)


def difference(found: RunOutcome, expected: RunOutcome, name: str) -> str | None:
    """Return where the outcome of phase ``name`` first differs from the expected one, in a sentence; None:
    nowhere.

    A run that ended otherwise is reported before contacts that are missing for that reason.
    """
    at = first_difference(found.contacts, expected.contacts)
    both = min(len(found.contacts), len(expected.contacts))
    if at is not None and at < both:
        return f"contact {at} is {_contact(found, at)}, and should be {_contact(expected, at)}"
    if found.ended.partition(":")[0] != expected.ended.partition(":")[0]:
        return f"{name} ended with {found.ended}; {REFERENCE} {expected.ended}"
    if at is not None and both == len(found.contacts):
        return f"contact {at} is missing: {_contact(expected, at)}"
    if at is not None:
        return f"contact {at} is one too many: {_contact(found, at)}"
    for which in ("positions", "velocities"):
        mine, right = getattr(found, which), getattr(expected, which)
        body = first_difference(mine, right)
        if body is not None:
            return (
                f"at the end the {which} of body {body} are {mine[body].tolist()}, not {right[body].tolist()}"
            )
    if found.time != expected.time:
        return f"the run ended at time {found.time!r}, and should have at {expected.time!r}"
    return table_difference(found.tables, expected.tables)


def table_difference(found: Tables, expected: Tables) -> str | None:
    """Return the first table entry that one run left otherwise than another, in a sentence; None: there is
    none."""
    for name, right in expected.items():
        mine = found.get(name, right)
        at = first_difference(mine, right)
        if at is None:
            continue
        if at >= min(len(mine), len(right)):
            return f"at the end {name} has {len(mine)} entries, not {len(right)}"
        whose = f" of body {at}" if len(right) > 1 or not name.startswith(("clock", "counts")) else ""
        return f"at the end {name}{whose} is {mine[at].item()!r}, not {right[at].item()!r}"
    return None


def _contact(result: RunOutcome, at: int) -> str:
    row = result.contacts[at]
    partner = f"the {WALLS[int(row['b'])]} wall" if row["b"] < 0 else f"body {row['b']}"
    return f"body {row['a']} with {partner} at time {float(row['time'])!r}"


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
class Divergence:
    """The first place where a phase's answer differs from the reference's.

    ``what`` is "contact" (``index`` counts contacts from 0), "end" or "body" (``index`` is the body, at the
    end); ``expected`` and ``found`` are rows with exact ticks, or None where there is no such contact;
    ``before`` is the last contact on which both agree; ``judged`` says whose contact is right by the
    specification, where that can be computed (``kinetile_accuracy.specification``).
    """

    reference: str
    phase: str
    what: str
    index: int
    expected: Mapping[str, Any] | None
    found: Mapping[str, Any] | None
    before: Mapping[str, Any] | None = None
    judged: str = ""

    def __str__(self) -> str:
        place = {
            "contact": f"contact {self.index}",
            "end": "the end",
            "body": f"body {self.index} at the end",
        }
        lines = [f"{self.phase} differs from {self.reference} at {place[self.what]}:"]
        names = [self.reference, self.phase]
        rows = [self.expected, self.found]
        if self.before is not None:
            names, rows = ["(before, the same)", *names], [self.before, *rows]
        width = max(map(len, names))
        lines += [f"  {name:{width}}  {describe_row(row)}" for name, row in zip(names, rows, strict=True)]
        return "\n".join([*lines, f"  {self.judged}"] if self.judged else lines)


@dataclass(frozen=True)
class Comparison:
    """The result of ``compare``: an outcome for each phase, and a divergence for each that differs from the
    first."""

    outcomes: tuple[PhaseOutcome, ...]
    divergences: tuple[Divergence, ...] = field(default=())

    @property
    def identical(self) -> bool:
        """Whether all phases gave one answer."""
        return not self.divergences

    @property
    def fault(self) -> str | None:
        """The reference's fault, if every run ended in one; None if any run came to its end."""
        faults = [outcome.fault for outcome in self.outcomes]
        return faults[0] if faults and all(fault is not None for fault in faults) else None

    @property
    def first_divergence(self) -> Divergence | None:
        """The earliest divergence of all, or None."""
        order = {"contact": 0, "end": 1, "body": 2}
        return min(self.divergences, key=lambda d: (order[d.what], d.index), default=None)

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, fit for JSON."""
        first = self.first_divergence
        return {
            "identical": self.identical,
            "phases": [vars(outcome) | {"options": dict(outcome.options)} for outcome in self.outcomes],
            "first_divergence": first and vars(first),
            "divergences": [vars(divergence) for divergence in self.divergences],
        }


class _Answer(NamedTuple):
    """Everything in which two phases must agree."""

    contacts: NDArray[Any]
    end: dict[str, Any]
    state: NDArray[np.float64]
    bodies: NDArray[np.int32]  # the number of the body in each row of the state


def compare(
    scene: Scene,
    broad_phases: Sequence[Choice],
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    narrow_phases: Sequence[str] | Mapping[str, Mapping[str, Any]] | None = None,
    start: Callable[[str, Simulation], Any] | None = None,
    finish: Callable[[PhaseOutcome], Any] | None = None,
    progress: Callable[[Any], None] | None = None,
) -> Comparison:
    """Run a scene under each of at least two broad phases, and compare all with the first.

    A phase is a name, or a pair (name, options). Without ``until`` the scene's own holds, with
    ``max_contacts`` as well; where there is none of the three, one time unit. ``start`` is called with a
    label and the simulation before each run, ``finish`` with its outcome after it; ``progress`` is the
    argument of that name of ``Simulation.run``.

    A fault in a run (ZenoError, MissedContactError, PhaseError, AuditError) is part of its answer. Raises
    BadOption for fewer than two phases, and what ``Simulation`` raises for names and options that there are
    not.
    """
    if len(broad_phases) < 2:
        raise BadOption(f"a comparison needs at least two broad phases; found {len(broad_phases)}")
    if until is None:
        until = scene.settings.until
    if until is None and max_contacts is None:
        until = scene.start + 1.0
    reference: _Answer | None = None
    outcomes: list[PhaseOutcome] = []
    divergences: list[Divergence] = []
    choices = [(choice, {}) if isinstance(choice, str) else choice for choice in broad_phases]
    simulations = [
        Simulation(scene, name, options=options, narrow_phases=narrow_phases) for name, options in choices
    ]
    simulations.reverse()
    for name, options in choices:
        label = write_phase(name, options)
        simulation = simulations.pop()
        if start is not None:
            start(label, simulation)
        fault: str | None = None
        try:
            simulation.run(until, max_contacts=max_contacts, progress=progress)
        except (ZenoError, MissedContactError, PhaseError, AuditError) as error:
            fault = f"{type(error).__name__}: {error}"
        answer = _answer(simulation, fault)
        outcomes.append(_outcome(label, simulation, answer, fault))
        if finish is not None:
            finish(outcomes[-1])
        if reference is None:
            reference = answer
        else:
            divergence = find_divergence(outcomes[0].phase, label, reference, answer)
            if divergence is not None and divergence.what == "contact":
                lists = {outcomes[0].phase: reference.contacts, label: answer.contacts}
                who = explain_difference(scene, lists, divergence.index, simulation.narrow_phases)
                divergence = replace(divergence, judged=who)
            divergences += [divergence] if divergence else []
    return Comparison(tuple(outcomes), tuple(divergences))


def describe_row(row: Mapping[str, Any] | None) -> str:
    """Return a contact, an end or a body of a divergence as text, numbers to the last digit."""
    if row is None:
        return "no such contact"
    if "tick" in row:
        b = f"wall {WALLS[row['b']]}" if row["b"] in WALLS else f"disc {row['b']}"
        return f"disc {row['a']} with {b} at time {row['time']!r} (epoch {row['epoch']}, tick {row['tick']})"
    return ", ".join(
        f"{name} {value!r}" if isinstance(value, float) else f"{name} {value}" for name, value in row.items()
    )


def _answer(simulation: Simulation, fault: str | None) -> _Answer:
    end = {"time": simulation.time, "fault": (fault or "none").partition(":")[0]}
    state = np.hstack([simulation.positions(), simulation.velocities()]).reshape(-1, 4)
    return _Answer(simulation.contacts, end, state, simulation.bodies)


def _outcome(label: str, simulation: Simulation, answer: _Answer, fault: str | None) -> PhaseOutcome:
    readings = simulation.readings
    return PhaseOutcome(
        phase=label,
        broad_phase=simulation.broad_phase,
        options=dict(simulation.options),
        time=simulation.time,
        contacts=len(answer.contacts),
        fingerprint=simulation.fingerprint,
        events=readings.events,
        cpu_seconds=readings.cpu_seconds,
        fault=fault,
    )


def find_divergence(reference: str, phase: str, expected: _Answer, found: _Answer) -> Divergence | None:
    """Return the first place where an answer differs from the reference's: contacts, end, final state."""
    at = first_difference(expected.contacts, found.contacts)
    if at is not None:
        here, there = _row(expected.contacts, at), _row(found.contacts, at)
        before = _row(expected.contacts, at - 1)
        return Divergence(reference, phase, "contact", at, here, there, before=before)
    if expected.end != found.end:
        return Divergence(reference, phase, "end", len(expected.contacts), expected.end, found.end)
    row = first_difference(expected.state, found.state)
    if row is not None:
        here, there = _body(expected.state, row), _body(found.state, row)
        return Divergence(reference, phase, "body", int(expected.bodies[row]), here, there)
    return None


def _row(contacts: NDArray[Any], index: int) -> dict[str, Any] | None:
    if not 0 <= index < len(contacts):
        return None
    return dict(zip(contacts.dtype.names or (), contacts[index].item(), strict=True))


def _body(state: NDArray[np.float64], body: int) -> dict[str, Any]:
    return dict(zip(("x", "y", "vx", "vy"), state[body].tolist(), strict=True))
