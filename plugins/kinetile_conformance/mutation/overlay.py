"""The author's own tests on a mutant: a command, run where one module's source is another.

The command runs in the installed package itself. A ``sitecustomize`` on its path sees to it that every
interpreter that it starts compiles the changed text in place of the file's.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

from kinetile.errors import BadOption
from kinetile_conformance.mutation.mutants import Mutant
from kinetile_conformance.mutation.sources import PhaseSource, place_in
from kinetile_conformance.mutation.writing import changed

__all__ = ["passes", "try_tests"]

_HOOK = """\
import importlib.machinery, importlib.util, sys

MODULE, FILE, TEXT, PACKAGE = {found!r}


class Loader(importlib.machinery.SourceFileLoader):
    def get_code(self, name):
        with open(TEXT, "rb") as text:
            return compile(text.read(), FILE, "exec", dont_inherit=True)


class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == MODULE:
            loader = Loader(name, FILE)
            return importlib.util.spec_from_file_location(
                name, FILE, loader=loader, submodule_search_locations=PACKAGE
            )


sys.meta_path.insert(0, Finder)
"""


def try_tests(command: str) -> None:
    """Run a command on the phase as it is; raise BadOption where it does not end with exit code 0."""
    code = _run(command, dict(os.environ), None)
    if code != 0:
        raise BadOption(f"--also {command!r} ends with exit code {code} on the phase as it is; expected 0")


def passes(phase: PhaseSource, mutant: Mutant, command: str, seconds: float | None = None) -> bool:
    """Return whether a command ends with exit code 0 on a mutant, and in so many seconds."""
    source = next(each for each in phase.modules if place_in(phase, each) == mutant.place)
    with tempfile.TemporaryDirectory(prefix="kinetile-mutant-") as folder:
        text = Path(folder) / "changed"
        text.write_text(changed(source.text, mutant.change), encoding="utf-8")
        path = str(source.path.absolute())
        inner = [str(source.path.parent.absolute())] if source.is_package else None
        found = (source.module, path, str(text), inner)
        (Path(folder) / "sitecustomize.py").write_text(_HOOK.format(found=found), encoding="utf-8")
        paths = filter(None, [folder, os.environ.get("PYTHONPATH")])
        return _run(command, {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}, seconds) == 0


def _run(command: str, environment: dict[str, str], seconds: float | None) -> int | None:
    """Return the exit code of a command; None where it took too long."""
    process = subprocess.Popen(
        command,
        shell=True,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        return None
    finally:
        if process.poll() is None:
            os.killpg(process.pid, 9)
            process.wait()
