"""Packages for tests: installed as by ``pip install -e``, without a build backend or a network."""

import importlib.util
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import kinetile
import kinetile_plugins
from kinetile.plugin.new_plugin import new_plugin

OWN = tuple(str(Path(str(module.__file__)).parents[1]) for module in (kinetile, kinetile_plugins))
"""The folders of this process's kinetile: a child has the same, wherever else one is installed."""


def install(folder: Path, site: Path) -> list[str]:
    """Writes the metadata of a folder's package into a site folder; returns the entries of PYTHONPATH."""
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    write_metadata(site, project["name"], project["version"], project["entry-points"])
    return [str(site), str(folder)]


def write_metadata(site: Path, name: str, version: str, groups: Mapping[str, Mapping[str, str]]) -> None:
    """Writes the metadata of a distribution that is installed in a folder."""
    info = site / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n", "utf-8")
    text = ""
    for group, points in groups.items():
        text += f"[{group}]\n" + "".join(f"{point} = {target}\n" for point, target in points.items())
    (info / "entry_points.txt").write_text(text, "utf-8")


@contextmanager
def loaded(path: Path) -> Iterator[ModuleType]:
    """Within this context a file is a module, which Numba can import by its name."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = sys.modules[path.stem] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        yield module
    finally:
        del sys.modules[path.stem]


def run(
    *words: object,
    folder: Path,
    paths: Sequence[str] = (),
    interpreted: bool = True,
    module: str = "kinetile",
) -> subprocess.CompletedProcess[str]:
    """Runs ``python -m module words`` in a folder, with the packages of ``install``."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment |= {
        "PYTHONPATH": os.pathsep.join([*paths, *OWN]),
        "NUMBA_DISABLE_JIT": "1" if interpreted else "0",
    }
    return subprocess.run(
        [sys.executable, "-m", module, *map(str, words)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=1200,  # a guard against a hanging one: a busy machine is not a failure
    )


BLIND = '''"""A broad phase that is wrong: it looks once, at the start, who is near."""

from typing import NamedTuple

import kinetile as kt
import numpy as np
from kinetile.toolbox import BroadPhaseParts, Kernel, Records, hook, positions_now


class State(NamedTuple):
    place: Records


def arrange(k: Kernel, s: State) -> None:
    s.place[:] = positions_now(k)


@hook
def near(k: Kernel, s: State, body: int) -> int:
    count = 0
    for other in range(len(s.place)):
        if np.hypot(s.place[body, 0] - s.place[other, 0], s.place[body, 1] - s.place[other, 1]) <= 2.5:
            k.near[count] = other
            count += 1
    return count


class BlindPhase:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(near, State(np.zeros((len(scene), 2))), arrange=arrange)
'''


def install_blind(folder: Path) -> list[str]:
    """Writes and installs kinetile-blind, which misses contacts; returns the entries of PYTHONPATH."""
    package = new_plugin("blind", folder)
    (package / "kinetile_blind" / "phase.py").write_text(BLIND, encoding="utf-8")
    return install(package, folder / "site")
