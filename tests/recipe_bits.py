"""The bits of every recipe: as a program, prints hashes of its scenes and fingerprints of runs as JSON.

``python tests/recipe_bits.py`` prints the scenes' hashes, with ``run`` behind it the runs' as well.
"""

from __future__ import annotations

import hashlib
import json
import sys
from typing import Any

import kinetile as kt

CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "grid": ("grid", {}),
    "grid of 2,500": ("grid", {"bodies": 2500, "seed": 3, "speed": 0.7}),
    "random": ("random", {}),
    "random of many sizes": ("random", {"bodies": 300, "radius_ratio": 10.0, "mass_ratio": 1e3}),
    "random from a lattice": ("random", {"density": 0.75}),
    "lattice": ("lattice", {}),
    "lattice with turns": ("lattice", {"bodies": 40, "turns": 30, "seed": 2}),
    "non-dyadic lattice": ("lattice", {"bodies": 40, "kind": "non-dyadic", "seed": 3}),
    "lattice with jitter": ("lattice", {"bodies": 40, "kind": "non-dyadic", "jitter": 1e-9, "seed": 4}),
    "figure-10": ("figure-10", {}),
    "figure-11": ("figure-11", {}),
    "figure-16": ("figure-16", {}),
    "cradle": ("cradle", {}),
    "break": ("break", {}),
    "break with an aim": ("break", {"aim": 0.1}),
    "two-discs": ("two-discs", {}),
}
MOST_CONTACTS = 300


def scene_hash(scene: kt.Scene) -> str:
    """Return the beginning of a digest of everything in a scene that is simulated."""
    arrays = (scene.position, scene.velocity, scene.radius, scene.mass)
    turns = repr(scene.turns).replace(", at=None)", ")")  # a field that came later
    rest = f"({scene.arena!r}, {turns}, {scene.start!r})".encode()
    return hashlib.sha256(b"".join([*(array.tobytes() for array in arrays), rest])).hexdigest()[:16]


def scene_hashes() -> dict[str, str]:
    return {case: scene_hash(kt.make_scene(name, **given)) for case, (name, given) in CASES.items()}


def fingerprints() -> dict[str, str]:
    """Return the beginnings of the fingerprints of short runs, and of the run that the README shows.

    Under ``cells``, which has most vectors in it; that all phases have the same is for other tests.
    """
    found = {}
    for case, (name, given) in CASES.items():
        scene = kt.make_scene(name, **given)
        sim = kt.Simulation(scene, "cells")
        sim.run(4.0, max_contacts=MOST_CONTACTS)
        found[case] = sim.fingerprint[:16]
    sim = kt.Simulation(kt.make_scene("grid"), "sweep-tiling")
    sim.run(1.0)
    return found | {"kinetile run": sim.fingerprint[:16]}


if __name__ == "__main__":
    print(
        json.dumps({"scenes": scene_hashes(), "runs": fingerprints() if "run" in sys.argv else {}}, indent=4)
    )
