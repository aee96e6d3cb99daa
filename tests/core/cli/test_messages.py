"""Commands that cannot be done: one message, exit code 2, and all files as they were."""

import os
import sys
from pathlib import Path

import pytest

import kinetile as kt
from command_line import left_alone, printed
from kinetile.scene.files import dumps_scene
from messages import table

DISCS = dumps_scene(kt.make_scene("two-discs"))
BAD = '[[bodies]]\nposition = [0, 0]\nvelocity = [1, "x"]\nradius = -1\ncolour = "red"\n'
FILES = {
    **dict.fromkeys(("mine.txt", "there.gif", "there.html", "there.parquet", "there.svg"), b"mine"),
    "there.toml": DISCS.encode(),
    "latin.toml": b"# \xff\n" + DISCS.encode(),
    "bad.toml": BAD.encode(),
}


@pytest.fixture
def saved():
    printed("run grid -s bodies=16 -s seed=2 --broad-phase sap-1d --until 0.2 --checkpoint c.kt")


@pytest.fixture
def pipes():
    if not hasattr(os, "mkfifo"):
        pytest.skip("needs pipes with names")
    os.mkfifo("pipe.parquet")
    os.mkfifo("pipe.toml")


def refused_here(line, *_):
    """Runs a command that cannot be done, where some files are; returns its message."""
    if ".parquet" in line and "pyarrow" not in sys.modules:
        pytest.importorskip("pyarrow")
    for name, content in FILES.items():
        Path(name).write_bytes(content)
    Path("link.toml").symlink_to("there.toml")
    return left_alone(line)


def without(line):
    module, _, rest = line.partition(" ")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, module, None)
        return refused_here(rest)


test_message = table(globals())
