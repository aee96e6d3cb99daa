"""The skin: by how much bodies are fattened for the broad phase, so that no rounding can change an answer.

A structural event is found with an error of at most ``eta``, as a length. A chain of neighbours in a sorted
list can add up 2n such errors, and a contact can lie ``eta`` off its prediction. A skin ``delta`` of 4 (n +
2) eta covers both with room: a pair is a candidate from a gap of 2 delta on, so it is there when its contact
comes, ties included, and it is still there while they touch. Contact times never see the skin. The derivation
is in docs/one-answer.md.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Skin", "too_thick"]

ULP = 2.0**-53


class Skin(NamedTuple):
    """Lengths, all in the scene's unit.

    Attributes:
        eta: error bound of one structural event.
        delta: the skin itself; a body's reach is its radius plus this.
        theta: an inversion deeper than this is repaired whatever its rate.
        tolerance: an overlap deeper than this (and 1e-9 of the radii) is a missed contact.
    """

    eta: float
    delta: float
    theta: float
    tolerance: float

    @classmethod
    def of(cls, bodies: int, extent: float, speed: float, tick: float) -> Skin:
        """Return the skin for so many bodies within ``extent`` of the origin, never faster than ``speed``."""
        eta = 16.0 * ULP * extent + 2.0 * speed * tick
        return cls(eta=eta, delta=4.0 * (bodies + 2) * eta, theta=2.0 * eta, tolerance=64.0 * eta)


def too_thick(broad_phase: str, delta: float, limit: float) -> str:
    """Return the sentence with which a broad phase is refused that cannot bear the skin."""
    return (
        f"{broad_phase} is right only while the skin around bodies is thin, at most {limit:.3g} here, and "
        f"rounding asks for {delta:.3g}: choose sap-1d, sap-2d or naive, or a scene with less range in size, "
        "mass or speed"
    )
