"""Faults in memory that nobody looks at: hooks that write what is not theirs, with no effect on a contact,
or hardly any."""

from __future__ import annotations

from functools import partial

from mutants.scenes import gas
from mutants.witnesses import Differs, Tampers
from phase_mutant_table import EXCHANGE, NO_AUDIT, replanning
from phase_mutants import Mutant, before

__all__ = ["MUTANTS"]

GAS = partial(gas, 25, 0.25)
BASES = {
    "sap-1d": (EXCHANGE, ""),
    "sap-2d": (EXCHANGE, ""),
    "cells": ("    home = s.homes[body]\n    grid = s.levels[0]\n    step", "uniform"),
}


def _writes(name: str, base: str, line: str, table: str, field: str, why: str) -> Mutant:
    """Return the mutant that has a line more in ``repair``, or in ``replan`` where there is no structure."""
    words = BASES.get(base)
    changes = [before(words[0], f"    {line}\n", words[1])] if words else replanning(line)
    return Mutant(name, base, changes, why, family="memory", witness=Tampers(GAS, base, table, field, 0.25))


MUTANTS = [
    _writes(
        "counts its own events back",
        "sap-1d",
        "k.counts[0].structural -= 1",
        "counts",
        "structural",
        "a phase that looks better than it is",
    ),
    _writes(
        "takes credit for newcomers",
        "cells",
        "k.counts[0].newcomers += 1",
        "counts",
        "newcomers",
        "a count that is another's",
    ),
    _writes(
        "hides how late it is",
        "sap-2d",
        "k.counts[0].late = -1",
        "counts",
        "late",
        "the reading from which one would see it",
    ),
    _writes(
        "writes into the energy of turns",
        "naive",
        "k.counts[0].commanded_energy += 1.0",
        "counts",
        "commanded_energy",
        "a sum that nobody compares",
    ),
    _writes(
        "forgets whom a body met last",
        "sap-1d",
        "k.bodies[body].last = -1",
        "bodies",
        "last",
        "two that have just met may be asked again",
    ),
    _writes(
        "tolerates more at each event",
        "cells",
        "k.clock[0].limits.tolerance *= 1.5",
        "clock",
        "limits.tolerance",
        "a missed contact would no longer be seen",
    ),
    _writes(
        "resets the guard against jams",
        "cells",
        "k.clock[0].jam.window = 0",
        "clock",
        "jam.window",
        "a jam would have no end",
    ),
    _writes(
        "widens the window of the guard against jams",
        "naive",
        "k.clock[0].jam.window_size = 1 << 40",
        "clock",
        "jam.window_size",
        "a jam would have no end",
    ),
    _writes(
        "makes lower bounds tight",
        "naive",
        "k.clock[0].limits.fat = 0.0",
        "clock",
        "limits.fat",
        "a contact may come before its bound, by a rounding",
    ),
    _writes(
        "allows itself any number of events",
        "sap-2d",
        "k.clock[0].jam.spin_limit += 1",
        "clock",
        "jam.spin_limit",
        "an endless repair would not be noticed",
    ),
    _writes(
        "writes into a record of the queue",
        "cells",
        "k.queue[body].spare += 1",
        "queue",
        "spare",
        "what is spare today is used tomorrow",
    ),
    _writes(
        "says that a body has a new plan",
        "sap-1d",
        "k.bodies[body].stamp += 1",
        "bodies",
        "stamp",
        "whoever waits for it asks again, for nothing",
    ),
    _writes(
        "leaves a mark behind those that are near",
        "naive",
        "k.near[len(k.bodies) + 9] = 7",
        "near",
        "",
        "more than eight numbers beyond those that count",
    ),
    Mutant(
        "writes past its own array",
        "sap-1d",
        [before(EXCHANGE, "    s.order[len(s.order)] = END\n"), NO_AUDIT],
        "an index by one: whose memory that is, is up to chance",
        family="memory",
        witness=Differs(GAS, 0.1),
    ),
]
