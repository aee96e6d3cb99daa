"""axe-core, the checker of accessibility, for pages in a browser.

It is installed by name into a temporary folder, and is not a part of kinetile.
"""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from chromium import Browser
from programs import program

AXE = "axe-core@4"


def install_axe(folder: Path) -> str:
    """Installs axe-core into a folder, and returns its script; skips the test if that fails."""
    command = [program("npm"), "install", "--silent", "--no-audit", "--no-fund", "--prefix", str(folder), AXE]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    except subprocess.TimeoutExpired:
        pytest.skip(f"{AXE} looks at the page, and npm has not installed it within two minutes")
    script = folder / "node_modules" / "axe-core" / "axe.min.js"
    if done.returncode or not script.is_file():
        pytest.skip(f"{AXE} looks at the page, and npm has not installed it: {done.stderr.strip()[-200:]}")
    return script.read_text(encoding="utf-8")


def violations(browser: Browser, axe: str) -> list[Any]:
    """Returns the faults that axe finds in the present page: [rule, impact, the elements]."""
    browser.settle()
    browser.ask("Runtime.evaluate", expression=axe)
    told = """axe.run().then(({violations, passes}) => JSON.stringify([passes.length,
        violations.map(({id, impact, nodes}) => [id, impact, nodes.map((node) => node.html)])]))"""
    passes, found = json.loads(browser.value(told))
    assert passes > 15, "axe has looked at next to nothing"
    return list(found)
