"""How each role looks: colours that colour-blind people tell apart (Okabe and Ito), and what lies over what.

A role is told from others by more than its colour: by where it lies, by the width of its line, by dashes.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["DARK", "FRESH", "LIGHT", "LOOKS", "NEXT", "ORDER", "Look", "Paper", "arrow_scale"]


class Look(NamedTuple):
    """How a role looks: colour of line and filling, opacity of the filling, width and dashes of the line in
    points, and whether it lies over the discs."""

    colour: str
    filled: float
    width: float
    dashes: tuple[float, ...] = ()
    over: bool = False


LOOKS = {
    "cell": Look("#009E73", 0.10, 0.8, (4.0, 2.0)),
    "tile": Look("#56B4E9", 0.16, 0.5),
    "axis": Look("#808080", 0.0, 4.0),
    "bound": Look("#0072B2", 0.0, 1.1),
    "pair": Look("#CC79A7", 0.0, 1.4, (), True),
    "certificate": Look("#D55E00", 0.0, 2.0, (), True),
}
"""The roles, those below first."""

ORDER = tuple(LOOKS)

NEXT = Look("#D55E00", 0.30, 2.2)
"""What fails next, whatever its role is."""

FRESH = Look("#E69F00", 0.40, 2.2, (6.0, 3.0))
"""What has come with the last event, where events are seen: dashed, to be told from what fails next."""


class Paper(NamedTuple):
    """What a picture is on: the paper, what is written on it, a disc and its edge."""

    back: str
    ink: str
    disc: str
    edge: str


LIGHT = Paper("#ffffff", "#000000", "#e6e6e6", "#404040")
DARK = Paper("#14181d", "#f0f0f0", "#39424c", "#c0c6cc")


def arrow_scale(speeds: list[float], radii: list[float]) -> float:
    """Return the time by which velocities are multiplied to be arrows: the fastest is as long as two middling
    radii; 0 where nobody moves."""
    fastest = max(speeds, default=0.0)
    if fastest == 0.0:
        return 0.0
    return 2.0 * sorted(radii)[len(radii) // 2] / fastest
