"""The bits of every recipe: as a program, prints hashes of its scenes and fingerprints of runs as JSON.

``python tests/recipe_bits.py`` prints the scenes' hashes, and with ``run`` as its argument the runs' too.
"""

import hashlib
import json
import sys
from typing import Any, NamedTuple

import kinetile as kt


class Case(NamedTuple):
    """A recipe and its parameters, and the beginnings of its scene's digest and of a run's fingerprint."""

    recipe: str
    parameters: dict[str, Any]
    scene: str
    run: str


CASES = {
    "grid": Case("grid", {}, "10c6511924f0c72e", "211385ba4400670e"),
    "grid of 2,500": Case(
        "grid", {"bodies": 2500, "seed": 3, "speed": 0.7}, "e9e621299cb1cab3", "c21a1e8c47427498"
    ),
    "random": Case("random", {}, "659a4e89c2bdf6f0", "7ef1caf31aafc508"),
    "random of many sizes": Case(
        "random",
        {"bodies": 300, "radius_ratio": 10.0, "mass_ratio": 1000.0},
        "72c91125cbb04b9c",
        "fc3e16a7fbb90414",
    ),
    "random from a lattice": Case("random", {"density": 0.75}, "1db61aeed2e1d976", "1d5f468642e6a9d1"),
    "lattice": Case("lattice", {}, "8f712f68bc0bfd68", "42f2cf4a2f69cba7"),
    "lattice with turns": Case(
        "lattice", {"bodies": 40, "turns": 30, "seed": 2}, "26993d93b191ab04", "776c1a106c870a01"
    ),
    "non-dyadic lattice": Case(
        "lattice", {"bodies": 40, "kind": "non-dyadic", "seed": 3}, "b45de67e87641891", "a5c797959f39690c"
    ),
    "lattice with jitter": Case(
        "lattice",
        {"bodies": 40, "kind": "non-dyadic", "jitter": 1e-09, "seed": 4},
        "61a0d5280bbef605",
        "a8fb99ed42f445a0",
    ),
    "figure-10": Case("figure-10", {}, "df09e95ede82b0ec", "e156abf856878b1d"),
    "figure-11": Case("figure-11", {}, "62c87f9e09861352", "ce89c9f2b65c30a3"),
    "figure-16": Case("figure-16", {}, "f6fd726eabc43f18", "c38d213e0b9a432e"),
    "cradle": Case("cradle", {}, "d2f9cd18dff579b2", "0e69ca2e45b86a0a"),
    "break": Case("break", {}, "52c48ca4c7aa9a45", "fd8fd302ec028e1c"),
    "break with an aim": Case("break", {"aim": 0.1}, "31016116e5d4786f", "3f2fbb4efc4889f3"),
    "two-discs": Case("two-discs", {}, "12aa53997fae240d", "05f0dfd461b8756d"),
    "grid of 12 at a temperature": Case(
        "grid", {"bodies": 12, "temperature": 2.0}, "e9618a992314d51c", "1ab4dc4a42632dd7"
    ),
    "random at a temperature": Case(
        "random", {"mass_ratio": 10.0, "temperature": 2.0}, "76ddb2b2c2abbedf", "56e595575064a022"
    ),
    "mixture": Case("mixture", {}, "6998b2edc575c2af", "0b251062c688864e"),
    "mixture from a lattice": Case(
        "mixture", {"density": 0.59, "mass": "area"}, "a9ddb09b83d9fd7a", "0e1707d6ded95684"
    ),
    "grown": Case("grown", {"bodies": 20, "density": 0.7}, "1860b1434891475b", "2eb600534361f4e4"),
    "hexagonal": Case("hexagonal", {"columns": 9, "rows": 8}, "320d49bcc8d925e8", "07dd9bec8ec32dbe"),
    "hexagonal without walls": Case(
        "hexagonal", {"walls": False, "vacancies": 10}, "0fe52814e1fca9c0", "045a07420d983a41"
    ),
    "square": Case("square", {"density": 0.6, "vacancies": 7}, "397f484dcb27c393", "cb2b44a682a869db"),
    "galton": Case("galton", {}, "fe2971f70f79ecfe", "8005788c212139a0"),
    "heap": Case("heap", {"bodies": 30, "columns": 6}, "3e09a359edbf2b74", "ca47143f4dc66c89"),
}
README_RUN = "bda21636e7388a18"
"""The fingerprint of the run that the README shows."""

MOST_CONTACTS = 300


def scene_hash(scene: kt.Scene) -> str:
    """Returns the beginning of a digest of all simulated values in a scene."""
    arrays = (scene.position, scene.velocity, scene.radius, scene.mass)
    turns = repr(scene.turns).replace(", at=None)", ")")  # a field that came later
    rest = f"({scene.arena!r}, {turns}, {scene.start!r})".encode()
    return hashlib.sha256(b"".join([*(array.tobytes() for array in arrays), rest])).hexdigest()[:16]


def scene_hashes(grown: bool = True) -> dict[str, str]:
    """Returns the beginnings of the digests of all scenes; ``grown``: also scenes that are made by a run."""
    return {
        name: scene_hash(kt.make_scene(case.recipe, **case.parameters))
        for name, case in CASES.items()
        if grown or case.recipe != "grown"
    }


WIDEST = {"disc": {"general": True}, "wall": {"general": True}}
"""Narrow phases of one loop for all scenes with walls, with commands of all kinds in it."""


def fingerprints(in_one_loop: bool = False) -> dict[str, str]:
    """Returns the beginnings of the fingerprints of short runs, and of the run that the README shows.

    Under ``cells``, which has most vectors in it; other tests compare the phases. ``in_one_loop``: for the
    scenes with walls alone, with all features that a loop of discs may have.
    """
    found = {}
    for name, case in CASES.items():
        scene = kt.make_scene(case.recipe, **case.parameters)
        if in_one_loop and (scene.arena is None or scene.accelerated or case.recipe == "grown"):
            continue
        sim = kt.Simulation(scene, "cells", narrow_phases=WIDEST if in_one_loop else None, live=in_one_loop)
        sim.run(4.0, max_contacts=MOST_CONTACTS)
        found[name] = sim.fingerprint[:16]
    general = ["disc:general=true", "wall"] if in_one_loop else None  # another loop, which other tests have
    sim = kt.Simulation(kt.make_scene("grid"), "sweep-tiling", narrow_phases=general)
    sim.run(1.0)
    return found | {"kinetile run": sim.fingerprint[:16]}


if __name__ == "__main__":
    runs = fingerprints() if "run" in sys.argv else {}
    print(json.dumps({"scenes": scene_hashes(grown=False), "runs": runs}, indent=4))
