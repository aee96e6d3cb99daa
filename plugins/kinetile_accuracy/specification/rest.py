"""Rest: rules 9r and 9h of docs/specification.md, of bodies that are held, in doubles."""

from __future__ import annotations

from typing import NamedTuple

from kinetile_accuracy.specification.arithmetic import Vector, Whole
from kinetile_accuracy.specification.shapes import Face


class Support(NamedTuple):
    """What may hold a body: a wall, or a body, through an image and on a face of their difference (None: on
    no face); ``out`` is the unit normal from it to the body."""

    number: int
    out: Vector
    image: Whole = (0, 0)
    face: Face | None = None


def part(vector: Vector, out: Vector) -> float:
    """Returns how much of a vector is along a unit normal."""
    return vector[0] * out[0] + vector[1] * out[1]


def across(vector: Vector, out: Vector) -> Vector:
    """Returns what is left of a vector without that."""
    less = part(vector, out)
    return vector[0] - less * out[0], vector[1] - less * out[1]


def both_hold(pull: Vector, one: Support, two: Support) -> bool:
    """Returns whether each of two supports presses a body with this acceleration on the other (rule 9r)."""
    return part(across(pull, one.out), two.out) < 0 and part(across(pull, two.out), one.out) < 0
