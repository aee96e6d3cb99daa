"""Photograph the player for the documents (the pictures ``player*.png`` of this folder), and the preview.

To take them again: ``PYTHONPATH=tests python docs/figures/photograph.py``, only some with their names behind
it. Each is taken in a headless chromium, of the player after keys were pressed, as a reader would press them.
The preview is what other programs show beside a link to the site: the first sentence of the documentation and
a figure.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import kinetile as kt
from chromium import Browser
from kinetile.show.player import view_scene

HERE = Path(__file__).parent
STEP = "ArrowRight"
TRIED = (*["n"] * 4, "b", *["PageDown"] * 14)

PHOTOGRAPHS = {
    "player.png": (1280, 800, False, ("sweep-tiling",), ("3", STEP, STEP, STEP, "n", "n", "n")),
    "player-phone.png": (390, 844, True, ("sweep-tiling", "cells"), ("3", STEP, STEP, STEP)),
    "player-try.png": (900, 720, False, ("sweep-tiling",), TRIED),
}
"""Of each picture: width and height, whether it is dark, the broad phases, and the keys."""

PREVIEW = "preview.png"

CARD = """<!doctype html><meta charset="utf-8">
<style>body {{ margin: 0; display: flex; align-items: center; gap: 50px; padding: 0 50px; height: 630px;
  font: 32px/1.35 system-ui, sans-serif; color: #1a1a1a }}
  h1 {{ margin: 0; font-size: 88px; line-height: 1.1 }}
  svg {{ flex: none; width: 540px; height: auto }} </style>
<div><h1>kinetile</h1><p>{sentence}</p></div>{figure}"""


def photograph(folder: Path, names: list[str]) -> None:
    """Take the photographs of these names, or all; the pages are made in a folder."""
    if PREVIEW in names or not names:
        preview(folder / "preview.html")
    scene = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4.0, seed=4)
    for name, (width, height, dark, phases, keys) in PHOTOGRAPHS.items():
        if names and name not in names:
            continue
        path = folder / f"{'-'.join(phases)}.html"
        if not path.exists():
            view_scene(scene, [(phase, {}) for phase in phases], until=0.12).save(path)
        with Browser(width, height, dark=dark) as browser:
            browser.open(path)
            browser.press(*keys)
            (HERE / name).write_bytes(browser.photograph())


def preview(path: Path) -> None:
    """Take the preview, of the size for which such programs ask."""
    sentence = (HERE.parent / "index.md").read_text(encoding="utf-8").split("\n\n")[1]
    figure = (HERE / "sweep-tiling.svg").read_text(encoding="utf-8")
    path.write_text(CARD.format(sentence=sentence, figure=figure), encoding="utf-8")
    with Browser(1200, 630) as browser:
        browser.visit(path)
        (HERE.parent / "_static" / PREVIEW).write_bytes(browser.photograph())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        photograph(Path(place), sys.argv[1:])
