"""From a fault of the compiled loop to a typed error with a sentence."""

from __future__ import annotations

from kinetile.errors import KinetileError, MissedContactError, PhaseError, StalledError, ZenoError
from kinetile.kernel.faults import (
    BAD_CERTIFICATE,
    BAD_PAIR,
    JAMMED,
    LATE_CONTACT,
    NOT_FINITE,
    STALLED,
    TOO_DEEP,
    UNKNOWN_PAIR,
)
from kinetile.kernel.log import WALLS
from kinetile.plugin.calling import described

__all__ = ["failure"]


def failure(fault: int, a: int, b: int, time: float, broad_phase: str, window: int) -> KinetileError:
    """Return the error for a fault of bodies ``a`` and ``b`` (or of certificate ``a``) at a time."""
    bodies = tuple(body for body in (a, b) if body >= 0)
    who = (
        f"bodies {a} and {b}" if b >= 0 else f"body {a}" + (f" and the {WALLS[b]} wall" if b in WALLS else "")
    )
    phase = described("broad phase", broad_phase)
    if fault == JAMMED:
        said = (
            f"at time {time!r} the bodies are jammed: {window} contacts took next to no time, "
            f"the last of them between {who}; nothing can move on from here"
        )
        return ZenoError(said, time=time, bodies=bodies)
    if fault == TOO_DEEP:
        said = f"at time {time!r} {who} overlap more than rounding explains: {phase} has missed their contact"
        return MissedContactError(said, time=time, bodies=bodies)
    if fault == LATE_CONTACT:
        said = (
            f"at time {time!r} a contact of {who} came up that lies in the past: "
            f"{phase} reported the pair too late"
        )
        return MissedContactError(said, time=time, bodies=bodies)
    if fault == NOT_FINITE:
        return PhaseError(
            f"at time {time!r} a contact of {who} left a place or velocity that is not a finite number"
        )
    if fault == STALLED:
        return StalledError(
            f"at time {time!r} {phase} does not get on: its certificates, the last of them number {a}, "
            "fail again and again at the same moment"
        )
    broken = {
        BAD_CERTIFICATE: f"scheduled certificate {a}, which is none of those that it declared",
        BAD_PAIR: f"reported the pair ({a}, {b}), which is not two bodies of the scene",
        UNKNOWN_PAIR: f"removed the pair ({a}, {b}), which was not a candidate pair",
    }
    return PhaseError(f"at time {time!r} {phase} {broken.get(fault, f'left fault {fault} ({a}, {b})')}")
