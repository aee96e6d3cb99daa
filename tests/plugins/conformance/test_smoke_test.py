"""What does not load or compile is said once, with the author's file and line."""

import re
from pathlib import Path

import pytest

from installing import run, write_metadata
from kinetile.kernel.compiled.composer import brief
from lanes import first

HEAD = """
import kinetile as kt
from kinetile.toolbox import BroadPhaseParts, hook


def helper(k):
    k.near[: len(k.bodies)] = range(len(k.bodies))
    return len(k.bodies)


@hook
def near(k, s, body):
"""
TAIL = """

class Faulty:
    def prepare(self, scene):
        return BroadPhaseParts(near)


@kt.hookimpl
def kinetile_broad_phases():
    return [kt.BroadPhaseSpec("faulty", "faulty_phase:Faulty")]
"""


def installed(folder: Path, body: str) -> list[str]:
    """Writes a phase of this body as a distribution; returns what PYTHONPATH must have."""
    (folder / "faulty_phase.py").write_text(f"{HEAD}    {body}\n{TAIL}", encoding="utf-8")
    (folder / "faulty_plugin.py").write_text(
        "import kinetile as kt\n\n\n@kt.hookimpl\ndef kinetile_broad_phases():\n"
        '    return [kt.BroadPhaseSpec("faulty", "faulty_phase:Faulty")]\n',
        encoding="utf-8",
    )
    write_metadata(folder, "faulty", "0.1", {"kinetile": {"faulty": "faulty_plugin"}})
    return [str(folder)]


SAID = [
    ("return 0 0", r"SyntaxError.*faulty_phase\.py, line 13"),
    ("return int(k.bodies[0].vz)", r"vz.*faulty_phase\.py, line 13\)"),
    ("return helper(k)", r"helper is a plain function, .*toolbox\.hook \(.*faulty_phase\.py, line 6\)"),
    ("k.near[: len(k.bodies)] = range(len(k.bodies)); return eval('len(k.bodies)')", r"eval.* line 13\)"),
]
"""The body of ``near``, and the message: without compiling, but for the last, which is right as Python."""


@pytest.mark.parametrize(("body", "said"), first(2, SAID))
def test_it_is_exit_code_2_and_nothing_is_judged(body: str, said: str, tmp_path: Path) -> None:
    paths = installed(tmp_path, body)
    done = run("conform", "faulty", folder=tmp_path, paths=paths, interpreted=False)
    assert done.returncode == 2, done.stdout
    assert "failed" not in done.stdout
    assert re.search(said, done.stderr, re.DOTALL), done.stderr
    assert len(done.stderr.strip().splitlines()) <= 3


def test_the_compiler_is_brief() -> None:
    message = (
        "Failed in nopython mode pipeline (step: nopython frontend)\n"
        "Unknown attribute 'vz' of type Record(x[type=float64;offset=0];64;True)\n"
        "\n"
        'File "mine.py", line 11:\n'
        "def near(k, s, body):\n"
        "    n = k.bodies.vz[0]\n"
        "    ^\n"
        "\n"
        "During: Pass nopython_type_inference\n"
        'File "loop.py", line 170:\n'
    )
    assert brief(message) == "Unknown attribute 'vz' of type records (mine.py, line 11): n = k.bodies.vz[0]"
    assert brief("no place") == "no place"
    long = message.replace(
        "Unknown", "No function >>> f(int64) There are 16 candidates: File: x.py: 9. Unknown"
    )
    assert brief(long) == "No function >>> f(int64) (mine.py, line 11): n = k.bodies.vz[0]"
    assert "is a constant for it" in brief(
        message.replace("Unknown", "Cannot modify readonly array: Unknown")
    )
