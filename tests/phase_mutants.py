"""Mutants: a built-in broad phase with one thing wrong each, to see whether the kit notices.

A mutant is the source of a built-in phase with a few words replaced, loaded as a module of its own and added
to the registry under its own name. ``judge`` has the kit judge it until a check fails. They are listed in
``phase_mutant_table``.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import kinetile as kt
import kinetile_plugins
from kinetile_conformance import Result, check_broad_phase

ROOM = Path(str(kinetile_plugins.__file__)).parent
BASES = {
    "naive": ("naive.py", "Naive"),
    "sap-1d": ("sweep_and_prune.py", "SweepAndPrune"),
    "sap-2d": ("sweep_and_prune_matrix.py", "SweepAndPruneMatrix"),
    "sweep-tiling": ("sweep_tiling", "SweepTiling"),
    "cells": ("cells", "Cells"),
}

KILLED, CONFORMS, EQUIVALENT = "killed", "it conforms", "it is equivalent"
UNSEEN = "the default budget does not see it"


@dataclass(frozen=True)
class Change:
    """Words of a source, there exactly once, and what stands there instead; ``module`` names it in a
    package."""

    old: str
    new: str
    module: str = ""


def instead(old: str, new: str, module: str = "") -> Change:
    """Return the change that replaces words."""
    return Change(old, new, module)


def before(old: str, new: str, module: str = "") -> Change:
    """Return the change that puts words before others."""
    return Change(old, new + old, module)


def after(old: str, new: str, module: str = "") -> Change:
    """Return the change that puts words after others."""
    return Change(old, old + new, module)


@dataclass(frozen=True)
class Mutant:
    """A built-in phase with one thing wrong.

    Attributes:
        name: what is wrong, in words.
        base: the phase that it is made from.
        changes: what is changed.
        why: what it stands for, and why it is not killed where it is not.
        fate: KILLED; CONFORMS, for what a broad phase may do; EQUIVALENT, for what changes nothing;
            UNSEEN, for what is wrong, and is not found out.
        features: the features that it declares.
        family: what kind of fault it is, where it belongs to one.
        witness: shows that it is wrong, without the kit: given the label, it returns what is wrong, or
            nothing.
    """

    name: str
    base: str
    changes: Sequence[Change]
    why: str
    fate: str = KILLED
    features: Sequence[str] = ()
    family: str = ""
    witness: Callable[[str], str] | None = None

    @property
    def label(self) -> str:
        """The name under which it is registered."""
        return f"{self.base}-{re.sub('[^a-z0-9]+', '-', self.name.lower()).strip('-')}"

    def load(self, folder: Path) -> None:
        """Write its source into a folder, and add it to the registry, where that has not been done."""
        if self.label in kt.registry().names("broad phase"):
            return
        file, class_name = BASES[self.base]
        name = f"mutant_{self.label.replace('-', '_')}"
        source = ROOM / file
        room = folder / name if source.is_dir() else folder
        room.mkdir(exist_ok=True)
        for path in source.glob("*.py") if source.is_dir() else [source]:
            text = path.read_text(encoding="utf-8")
            if source.is_dir():
                text = text.replace(f"from kinetile_plugins.{file}", f"from {name}")
            else:
                text = text.replace("\nfrom .", "\nfrom kinetile_plugins.")
            for change in self.changes:
                if change.module in ("", path.stem):
                    text = _changed(text, change)
            written = room / (path.name if source.is_dir() else f"{name}.py")
            written.write_text(text, encoding="utf-8")
        if str(folder) not in sys.path:
            sys.path.insert(0, str(folder))
        importlib.invalidate_caches()
        spec = kt.BroadPhaseSpec(self.label, f"{name}:{class_name}", features=frozenset(self.features))

        class Plugin:
            @kt.hookimpl
            def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
                return [spec]

        kt.registry().add(Plugin())


def _changed(text: str, change: Change) -> str:
    if text.count(change.old) != 1:
        raise LookupError(f"the source has {text.count(change.old)} times, not once: {change.old!r}")
    return text.replace(change.old, change.new)


class _Found(Exception):
    """A check has failed: that is enough."""


def judge(mutant: Mutant, folder: Path, checks: Sequence[str] | None = None) -> Result | None:
    """Judge a mutant as ``kinetile conform`` does, in a process of its own and with the default budget.

    Returns the first check that fails or is not judged, of all or of those named; None if all pass.
    """
    mutant.load(folder)

    def stop(result: Result) -> None:
        if not result.ok:
            raise _Found(result)

    try:
        check_broad_phase(mutant.label, checks=checks, on_result=stop)
    except _Found as found:
        (result,) = found.args
        assert isinstance(result, Result)
        return result
    return None
