"""Photograph the player for the documents: the pictures ``player*.png`` of this folder.

To take them anew: ``PYTHONPATH=tests python docs/figures/photograph.py``. Each is taken in a headless
chromium after keys were pressed, as a reader would press them.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import kinetile as kt
from chromium import Browser
from kinetile.show.player import view_scene

HERE = Path(__file__).parent
STEP = "ArrowRight"
TO_A_MEETING = ("3", *[STEP] * 54, "c")

PHOTOGRAPHS = {
    "player.png": (1280, 800, False, ("sweep-tiling",), ("3", STEP, STEP, STEP, "n", "n", "n")),
    "player-phone.png": (390, 844, True, ("sweep-tiling", "cells"), ("3", STEP, STEP, STEP)),
    "player-matrix.png": (1280, 640, False, ("sap-2d",), ("3", STEP, STEP, STEP, STEP)),
    "player-before.png": (900, 720, False, ("sweep-tiling",), (*TO_A_MEETING, "1", "ArrowLeft")),
    "player-after.png": (900, 720, False, ("sweep-tiling",), TO_A_MEETING),
}
"""Of each picture: width and height, whether it is dark, the broad phases, and the keys."""


def photograph(folder: Path) -> None:
    """Take all photographs; the pages are made in a folder."""
    scene = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4.0, seed=4)
    for name, (width, height, dark, phases, keys) in PHOTOGRAPHS.items():
        path = folder / f"{'-'.join(phases)}.html"
        if not path.exists():
            view_scene(scene, [(phase, {}) for phase in phases], until=0.12).save(path)
        with Browser(width, height, dark=dark) as browser:
            browser.open(path)
            browser.press(*keys)
            (HERE / name).write_bytes(browser.photograph())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        photograph(Path(place))
