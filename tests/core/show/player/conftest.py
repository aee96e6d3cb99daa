"""What tests of the player in a browser share: the browser, and a page of 16 discs under sweep-tiling."""

from pathlib import Path

import pytest

from chromium import Browser
from kinetile.show.player import view_scene
from player_pages import SCENES


@pytest.fixture(scope="session")
def browser():
    """One browser for all tests that do not change its window: each opens a page of its own in it."""
    with Browser() as opened:
        yield opened


@pytest.fixture(scope="session")
def saved(tmp_path_factory) -> Path:
    view = view_scene(SCENES["grid"], [("sweep-tiling", {})], until=0.5)
    return view.save(tmp_path_factory.mktemp("page") / "page.html")
