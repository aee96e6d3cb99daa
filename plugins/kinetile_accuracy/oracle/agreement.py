"""The agreement of a run with the certified oracle, contact by contact, in order and in time.

The order is defined in docs/one-answer.md, with ties at one exact time. A contact multiplies the roundings
before it, so after some ten contacts a disc a run in doubles and the oracle have nothing in common. The run's
horizon is the number of contacts that agree. The first contact of bodies on the plans that the scene gives
them must be at its time rounded down to its tick; later times have growing errors, which are measured.

Contacts per disc: (2 x contacts of two discs + contacts with walls) / discs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from kinetile import Scene, Simulation
from kinetile.arrays import Floats, Integers, Rows
from kinetile.errors import Refused
from kinetile.toolbox import WALLS
from kinetile_accuracy.oracle.oracle import CertifiedContact, CertifiedRun, Oracle, check_scope
from kinetile_accuracy.specification.arithmetic import SPAN, UNIT_TICKS

SLACK = 2
"""The greatest error in ticks of the first contact of bodies, or the last of a run: times are rounded."""


@dataclass(frozen=True)
class FirstDifference:
    """The first contact that differs between a run and the oracle, after ``index`` that agree.

    ``run`` is the run's contact, (time, a, b), None: no further contact up to its end; ``oracle`` is the
    certified contact, None: no further contact up to the end of the run. ``ticks_apart`` is the time of the
    run's contact, or of its end, less the oracle's: a tick or two if rounding exchanged two contacts.
    """

    index: int
    run: tuple[float, int, int] | None
    oracle: CertifiedContact | None
    ticks_apart: float

    def __str__(self) -> str:
        found = certain = "nothing more up to there"
        if self.run is not None:
            found = f"{_bodies_met(*self.run[1:])} at time {self.run[0]!r}"
        if self.oracle is not None:
            certain = f"{_bodies_met(self.oracle.a, self.oracle.b)} at time {self.oracle.time.decimal()}"
            if self.oracle.head_on < 2.0**-20:
                certain += f", a graze: {self.oracle.head_on:.1e} of the speed is head-on"
            certain += f"; {abs(self.ticks_apart):.4g} ticks apart"
        return f"contact {self.index}: the run has {found}, the oracle {certain}"


@dataclass(frozen=True, eq=False)
class Agreement:
    """The result of comparing a run of some bodies with the oracle.

    This many ``contacts`` of those ``compared`` agree, from the first on, in order; ``b`` is the second body
    or the wall of each, and ``ticks`` the delay of the run's contact after the oracle's. ``disagreement`` is
    the first contact that differs; None: all compared contacts agree.
    """

    bodies: int
    contacts: int
    compared: int
    b: Integers
    ticks: Floats
    disagreement: FirstDifference | None
    oracle: CertifiedRun

    @property
    def complete(self) -> bool:
        """Returns True if all contacts up to the given end agree and no contact is missing."""
        return self.disagreement is None and self.contacts == self.compared and self.oracle.complete

    @property
    def paces(self) -> Floats:
        """Contacts per disc up to and with each contact, (contacts,)."""
        return np.cumsum(np.where(self.b >= 0, 2.0, 1.0)) / max(self.bodies, 1)

    @property
    def contacts_per_disc(self) -> float:
        """Contacts per disc that agree, with the contacts with walls."""
        return float(self.paces[-1]) if self.contacts else 0.0

    @property
    def worst_ticks(self) -> float:
        """The largest error of a time, in ticks."""
        return float(np.abs(self.ticks).max(initial=0.0))

    @property
    def median_ticks(self) -> float:
        """The median of the errors of times, in ticks."""
        return float(np.median(np.abs(self.ticks))) if self.contacts else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Returns the agreement in plain types."""
        differs = self.disagreement
        certain = None if differs is None else differs.oracle
        first = differs and {
            "index": differs.index,
            "run": differs.run and dict(zip(("time", "a", "b"), differs.run, strict=True)),
            "oracle": certain and {"time": certain.time.decimal(), "a": certain.a, "b": certain.b},
            "ticks_apart": differs.ticks_apart,
        }
        oracle = {"bits": self.oracle.bits, "contacts": len(self.oracle.contacts)}
        return {
            "agrees": self.complete,
            "contacts": self.contacts,
            "compared": self.compared,
            "contacts_per_disc": self.contacts_per_disc,
            "time_error_ticks": {"max": self.worst_ticks, "median": self.median_ticks},
            "first_disagreement": first,
            "oracle": oracle | {"ended": self.oracle.ended, "why": self.oracle.ending},
        }

    def __str__(self) -> str:
        pace = f"{self.contacts_per_disc:.1f} contacts a disc"
        lines = [f"{self.contacts:,} of {self.compared:,} contacts agree in order ({pace})"]
        if self.contacts:
            lines.append(
                f"their times are off by up to {self.worst_ticks:.3g} ticks, "
                f"half of them by no more than {self.median_ticks:.3g}"
            )
        if self.disagreement is not None:
            lines.append(str(self.disagreement))
        elif not self.oracle.complete:
            lines.append(f"the oracle goes no further: {self.oracle.ending}")
        return "\n".join(lines)


def certify(
    sim: Simulation,
    *,
    until: float | None = None,
    max_contacts: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Agreement:
    """Compares a run with the certified oracle, up to the first contact that differs.

    The simulation must keep its contacts. If ``until`` (by default its time) or ``max_contacts`` are beyond
    the present run, it is continued, and a fault of the run is raised. Calls ``progress`` with the number of
    certified contacts and the number of compared contacts.

    Raises MissingExtra and Refused as ``Oracle``; also Refused if bodies were turned, inserted or removed by
    hand, and ValueError if the simulation keeps no contacts, ``until`` is not a finite time from the scene's
    start on, or ``max_contacts`` is negative.
    """
    scene = sim.scene
    if until is not None and not scene.start <= until < math.inf:
        raise ValueError(
            f"until must be a finite time from the scene's start on, {scene.start}; found {until}"
        )
    if max_contacts is not None and max_contacts < 0:
        raise ValueError(f"max_contacts must not be negative; found {max_contacts}")
    _ = sim.contacts  # raises without kept contacts, before anything is run
    check_scope(scene, sim.narrow_phases)
    more = None if max_contacts is None else max_contacts - len(sim.contacts)
    if (more is None or more > 0) and (more is not None if until is None else until > sim.time):
        sim.run(until, max_contacts=more)
    done = sim.readings
    if done.inserted or done.removed or done.turns > sum(each.time <= sim.time for each in scene.turns):
        raise Refused(
            "bodies were turned, inserted or removed by hand, and the oracle follows the turns of the scene "
            "alone: put the turns into the scene, or judge the contacts by certify-log"
        )
    end = sim.time if until is None else min(until, sim.time)
    contacts = sim.contacts
    contacts = contacts[: np.searchsorted(contacts["time"], end, side="right")][:max_contacts]
    # The oracle continues a little beyond the end: the run may have a contact just after it, as its times are
    # rounded down to ticks. If the oracle has one more contact before the end, the run lacks it.
    given = len(contacts) == max_contacts
    oracle = Oracle(scene, None if given else end + 2.0**-20 * (end - scene.start))
    pairs = contacts[["a", "b"]].tolist()
    for number, met in enumerate(() if given and not pairs else oracle, 1):
        if progress is not None:
            progress(number, len(pairs))
        if number > len(pairs) or (met.a, met.b) != pairs[number - 1] or (given and number == len(pairs)):
            break
    return agreement(contacts, oracle.certified, scene=scene, time_unit=sim.time_unit, end=end)


def agreement(
    contacts: Rows, oracle: CertifiedRun, *, scene: Scene, time_unit: float, end: float
) -> Agreement:
    """Compares contacts up to ``end``, in ticks of 2^-52 ``time_unit``, with certified ones."""
    rows = contacts[["epoch", "tick", "a", "b"]].tolist()
    tick = Fraction(time_unit) / UNIT_TICKS
    start = Fraction(scene.start)
    times = [start + (epoch * UNIT_TICKS + at) * tick for epoch, at, _, _ in rows]
    # The time until which each body flies on the plan that the scene gives it: its first turn or contact, or
    # the time when the clock anchors it.
    first_plan = [start + SPAN * tick] * len(scene)
    for turn in scene.turns:
        first_plan[turn.body] = min(first_plan[turn.body], Fraction(turn.time))
    errors: list[Fraction] = []
    for (_, _, *bodies), time, certain in zip(rows, times, oracle.contacts, strict=False):
        if bodies != [certain.a, certain.b]:
            break
        error, exact = time - certain.time.middle, certain.time.middle
        discs = [body for body in bodies if body >= 0]
        is_first = all(exact < first_plan[disc] for disc in discs)
        if is_first and abs(error) > SLACK * tick + certain.time.radius:
            break
        errors.append(error)
        for disc in discs:
            first_plan[disc] = start
    agree = len(errors)
    # At the end one of the two may have one more contact, within twice the errors of the times before.
    slack = max(SLACK * tick, Fraction(math.ulp(end))) + 2 * max(map(abs, errors), default=Fraction(0))
    found = None if agree == len(rows) else (float(contacts["time"][agree]), *rows[agree][2:])
    due = None if agree == len(oracle.contacts) else oracle.contacts[agree]
    last = Fraction(end) if found is None else times[agree]
    apart = Fraction(0) if due is None else last - due.time.middle
    if found is None:
        differ = due is not None and apart > slack
    else:
        differ = due is not None or (oracle.ended in ("until", "quiet") and Fraction(end) - last > slack)
    return Agreement(
        bodies=len(scene),
        contacts=agree,
        compared=len(rows),
        b=contacts["b"][:agree].astype(np.int64),
        ticks=np.array([float(error / tick) for error in errors]),
        disagreement=FirstDifference(agree, found, due, float(apart / tick)) if differ else None,
        oracle=oracle,
    )


def _bodies_met(a: int, b: int) -> str:
    return f"disc {a} with the {WALLS[b]} wall" if b in WALLS else f"discs {a} and {b}"
