"""What a result depends on beside its task: the versions of kinetile and of the plugins.

A package that is being worked on keeps its version while its code changes. So what is not kinetile's own goes
by its version and by a digest of its sources: a row of yesterday's code is not taken for one of today's.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Mapping
from functools import lru_cache
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from kinetile import __version__
from kinetile.errors import KinetileError, UnknownName
from kinetile.kernel.log import ANSWER
from kinetile.plugin.registry import Kind, registry

__all__ = ["ANSWERED", "VersionsDiffer", "check_versions", "source_of", "versions_here"]

ANSWERED = f"{__version__}, answer {ANSWER}"
"""The version of kinetile, and of the specification that its contacts follow."""


class VersionsDiffer(KinetileError, RuntimeError):
    """A worker has other versions than those that the study was begun with."""

    def __init__(self, differences: str, where: str) -> None:
        super().__init__(
            f"{where} has other versions than this process: {differences}. Rows of different code would be "
            "mixed up; install the same there, or take this worker away",
        )


def source_of(kind: Kind, name: str) -> str:
    """Return the package and version that a phase or recipe comes from. Raises UnknownName."""
    provided = registry().provided(kind, name)
    if provided.distribution == "kinetile":
        return f"kinetile {provided.version}"
    digest = _digest_of(provided.spec.target)
    if provided.distribution is None:
        return f"added in this process, sources {digest}"
    return f"{provided.distribution} {provided.version or 'of unknown version'}, sources {digest}"


def versions_here(wanted: Mapping[str, str]) -> dict[str, str]:
    """Return the versions that this process has of what a task wants: kinetile, phases, recipes."""
    found = {}
    for name in wanted:
        kind, _, of = name.rpartition(" ")
        if kind not in ("broad phase", "scene"):
            found[name] = ANSWERED
            continue
        try:
            found[name] = source_of("broad phase" if kind == "broad phase" else "scene", of)
        except UnknownName:
            found[name] = "not there"
    return found


def check_versions(wanted: Mapping[str, str], found: Mapping[str, str], where: str) -> None:
    """Raise VersionsDiffer where a process has other versions than those that are wanted."""
    odd = [name for name in wanted if found.get(name) != wanted[name]]
    if odd:
        said = "; ".join(
            f"{name} is {found.get(name, 'not there')} there, {wanted[name]} here" for name in odd
        )
        raise VersionsDiffer(said, where)


def _digest_of(target: Any) -> str:
    """Return a digest of the sources of the package, or of the file, that a target stands in."""
    if isinstance(target, str):
        return _package_digest(target.partition(":")[0].partition(".")[0])
    try:
        file = inspect.getsourcefile(inspect.unwrap(target))
        text = Path(file).read_bytes() if file else b""
    except (OSError, TypeError):
        text = b""
    return _short(text)


@lru_cache
def _package_digest(package: str) -> str:
    spec = PathFinder.find_spec(package)
    if spec is None:
        return "unknown"
    files = [Path(spec.origin)] if spec.origin and not spec.submodule_search_locations else []
    for folder in spec.submodule_search_locations or ():
        files += sorted(Path(folder).rglob("*.py"))
    total = hashlib.sha256()
    for file in files:
        total.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return total.hexdigest()[:12]


def _short(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:12]
