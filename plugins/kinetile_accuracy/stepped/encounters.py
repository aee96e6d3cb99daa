"""First encounters: the contacts by which a method in steps can be judged without chaos having a part in it.

After a few contacts a disc, two runs that differ by a rounding have different contacts, so counting contacts
says little about a method: what it misses and what it makes up cancel. Here only contacts count in which
*neither of the two discs has touched anything before*, no disc and no wall: both have flown straight from the
scene's start, where all methods agree. A method has such an encounter if it, too, has it as the first contact
of both discs, at whatever time; to be a contact, it has to be acted on. Contacts found at the same snapshot
have no order, and each of them may be the first. Two weaker questions are asked as well: whether there is
such a contact at all, and whether at least an overlap was seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Missed", "first_encounters", "found", "missed_of"]

_NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True)
class Missed:
    """How many first encounters there are, and how many of them a method misses.

    Attributes:
        encounters: how many there are.
        missed: of them, those that are not the first contact of both discs.
        passed: those that are no contact at all: there is no impulse.
        unseen: those that are not even seen as an overlap.
    """

    encounters: int
    missed: int
    passed: int
    unseen: int

    @property
    def share(self) -> float:
        """The share that is missed; NaN without encounters."""
        return self.missed / self.encounters if self.encounters else math.nan

    @property
    def error(self) -> float:
        """The standard error of the share, encounters taken as independent."""
        return math.sqrt(self.share * (1.0 - self.share) / self.encounters) if self.encounters else math.nan

    def __add__(self, other: Missed) -> Missed:
        return Missed(
            self.encounters + other.encounters,
            self.missed + other.missed,
            self.passed + other.passed,
            self.unseen + other.unseen,
        )


def first_encounters(contacts: npt.NDArray[np.void], bodies: int) -> npt.NDArray[np.int64]:
    """Return which contacts (their numbers) are first encounters of two discs.

    ``contacts`` has fields ``a`` and ``b`` (negative for walls), and is in the order of time; ``bodies`` is
    how many there are.
    """
    first = _first(np.arange(len(contacts)), contacts, bodies)
    number = np.arange(len(contacts))
    pairs = contacts["b"] >= 0
    other = np.where(pairs, contacts["b"], contacts["a"])
    return np.flatnonzero(pairs & (first[contacts["a"]] == number) & (first[other] == number))


def missed_of(
    pairs: npt.NDArray[np.integer[Any]],
    bodies: int,
    contacts: npt.NDArray[np.void],
    step: npt.NDArray[np.int64],
    overlaps: npt.NDArray[np.void],
) -> Missed:
    """Return how many of the first encounters ``pairs``, (k, 2), a method misses.

    ``contacts`` are those that it acts on, each found at ``step``; ``overlaps`` all that it sees.
    """
    return Missed(
        encounters=len(pairs),
        missed=int((~found(pairs, contacts, bodies, step)).sum()),
        passed=int((~found(pairs, contacts, bodies)).sum()),
        unseen=int((~found(pairs, overlaps, bodies)).sum()),
    )


def found(
    pairs: npt.NDArray[np.integer[Any]],
    contacts: npt.NDArray[np.void],
    bodies: int,
    step: npt.NDArray[np.int64] | None = None,
) -> npt.NDArray[np.bool_]:
    """Return which of the ``pairs``, (k, 2), are among the contacts, (k,).

    ``contacts`` has fields ``a`` and ``b``. Where ``step`` says at which snapshot each was found, only those
    contacts count that are the first of both discs.
    """
    discs = contacts["b"] >= 0
    a, b = contacts["a"][discs].astype(np.int64), contacts["b"][discs].astype(np.int64)
    if step is not None:
        first = _first(step, contacts, bodies)
        when = step[discs]
        as_first = (first[a] == when) & (first[b] == when)
        a, b = a[as_first], b[as_first]
    asked = np.sort(np.asarray(pairs, dtype=np.int64).reshape(-1, 2), axis=1)
    return np.isin(asked[:, 0] * bodies + asked[:, 1], np.minimum(a, b) * bodies + np.maximum(a, b))


def _first(step: npt.NDArray[np.int64], contacts: npt.NDArray[np.void], bodies: int) -> npt.NDArray[np.int64]:
    """Return at which step each body has its first contact."""
    first = np.full(bodies, _NEVER)
    np.minimum.at(first, contacts["a"], step)
    discs = contacts["b"] >= 0
    np.minimum.at(first, contacts["b"][discs], step[discs])
    return first
