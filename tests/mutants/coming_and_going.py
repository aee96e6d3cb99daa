"""Faults in the hooks that take a body in and let one go."""

from __future__ import annotations

from phase_mutants import Mutant, instead

__all__ = ["CHECKS", "MUTANTS"]

CHECKS = (
    "same-contacts-as-bodies-come-and-go",
    "its-structure-is-true-as-bodies-come-and-go",
    "same-contacts-when-commanded-by-hand",
)
"""The checks in which bodies come and go."""


def _mutant(name: str, base: str, old: str, new: str, module: str, why: str) -> Mutant:
    return Mutant(name, base, [instead(old, new, module)], why, family="coming and going")


MUTANTS = [
    _mutant(
        "does not watch who comes",
        "cells",
        "    come_home(k, s, body, 0)\n    watch(k, s, body)\n",
        "    come_home(k, s, body, 0)\n",
        "uniform",
        "enter leaves the certificate of the newcomer out",
    ),
    _mutant(
        "keeps who has gone",
        "cells",
        "    move_out(s, body, s.homes[body].cell)\n",
        "    pass\n",
        "uniform",
        "leave does nothing: near names a body that is no more",
    ),
    _mutant(
        "makes cells as wide as those who are there",
        "cells",
        "    least = least_side(levels.widest, k.clock[0].limits.skin)\n",
        "    least = np.zeros(len(levels))\n"
        "    np.maximum.at(least, level, least_side(np.asarray(k.bodies.radius), k.clock[0].limits.skin))\n",
        "layout",
        "a wider one who comes is far from whom it touches: it has happened",
    ),
    _mutant(
        "pairs who comes with elder slots only",
        "sap-1d",
        "        if overlaps and other != body and is_there(k, other):\n",
        "        if overlaps and other < body and is_there(k, other):\n",
        "",
        "a slot that was left is taken again, and those behind it are overlooked",
    ),
    _mutant(
        "watches one bound of who comes",
        "sap-1d",
        "    for bound in range(lower, upper + 1):\n        watch_left",
        "    for bound in range(lower, upper):\n        watch_left",
        "",
        "enter leaves a certificate of the newcomer out",
    ),
    _mutant(
        "does not watch the gap that closes",
        "sap-1d",
        "        if before != END:\n"
        "            watch(k, s, before, s.order[s.bounds[before + PLACE] + 1])\n"
        "\n\n@unchecked\n@hook\ndef near",
        "\n\n@unchecked\n@hook\ndef near",
        "",
        "leave leaves out the certificate of two that have become neighbours",
    ),
    _mutant(
        "keeps a pair of who has gone",
        "sap-1d",
        "    for other in range(pairs_of(k, body)):\n        remove_pair",
        "    for other in range(1, pairs_of(k, body)):\n        remove_pair",
        "",
        "near names a body that is no more",
    ),
    _mutant(
        "offers nobody when one goes",
        "sweep-tiling",
        "            offer(k, one, other)\n        above = facing",
        "            pass\n        above = facing",
        "events",
        "those who see each other now that nobody is between them are not told",
    ),
]
