"""From a fault of the compiled loop to a typed error with a sentence."""

from __future__ import annotations

from kinetile.errors import KinetileError, MissedContactError, PhaseError, ZenoError
from kinetile.faults import BAD_PAIR, JAMMED, LATE_CONTACT, STALLED, TOO_DEEP, UNKNOWN_PAIR
from kinetile.log import WALLS

__all__ = ["failure"]


def failure(fault: int, a: int, b: int, time: float, broad_phase: str, window: int) -> KinetileError:
    """Return the error for a fault of bodies ``a`` and ``b`` (or of certificate ``a``) at a time."""
    bodies = tuple(body for body in (a, b) if body >= 0)
    who = f"bodies {a} and {b}" if b >= 0 else f"body {a} and the {WALLS[b]} wall" if b in WALLS else f"body {a}"
    if fault == JAMMED:
        return ZenoError(
            f"at time {time!r} the bodies are jammed: {window} contacts took next to no time, the last of them between "
            f"{who}; nothing can move on from here",
            time=time,
            bodies=bodies,
        )
    if fault == TOO_DEEP:
        return MissedContactError(
            f"at time {time!r} {who} overlap more than rounding explains: "
            f"broad phase {broad_phase!r} has missed their contact, or a turn sent a body into another",
            time=time,
            bodies=bodies,
        )
    if fault == LATE_CONTACT:
        return MissedContactError(
            f"at time {time!r} a contact of {who} came up that lies in the past: "
            f"broad phase {broad_phase!r} reported the pair too late",
            time=time,
            bodies=bodies,
        )
    if fault == BAD_PAIR:
        return PhaseError(
            f"at time {time!r} broad phase {broad_phase!r} reported the pair ({a}, {b}), which is not two bodies of the scene"
        )
    if fault == UNKNOWN_PAIR:
        return PhaseError(
            f"at time {time!r} broad phase {broad_phase!r} removed the pair ({a}, {b}), which was not a candidate pair"
        )
    if fault == STALLED:
        return PhaseError(
            f"at time {time!r} broad phase {broad_phase!r} does not get on: its certificates, the last of them number {a}, "
            "fail again and again at the same moment"
        )
    return PhaseError(f"at time {time!r} broad phase {broad_phase!r} left fault {fault} with {a} and {b}")
