"""What has to be the same for a run to go on bit for bit: how the tables are laid out, and the versions."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from typing import Any

from kinetile.kernel.compiled.fingerprint import fingerprint
from kinetile.kernel.log import CONTACT, LOG
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import allocate
from kinetile.plugin.discovery import Kind
from kinetile.plugin.registry import registry
from kinetile.run.composition import Composition
from kinetile.run.composition.rules import Rules
from kinetile.run.engine import Command
from kinetile.run.saving.held import elements

__all__ = ["differences", "layout", "versions_of"]


@cache
def layout() -> str:
    """Return a digest of how all that is saved is laid out: the kernel's tables, field by field."""
    tables = allocate(1, 1, 1)
    said = [f"{name} {elements(table.dtype)}" for name, table in zip(tables._fields, tables, strict=True)]
    said += [elements(CONTACT), elements(LOG), *Command._fields, *Skin._fields]
    return hashlib.sha256("\n".join(said).encode()).hexdigest()


def versions_of(composition: Composition) -> dict[str, str]:
    """Return the versions of kinetile and of the phases; what has none, a phase that was added in this
    process, goes by its code."""
    from kinetile import __version__

    found = {"kinetile": __version__}
    found |= _version("broad phase", composition.broad_phase, composition.broad)
    parts = [composition.pair, composition.wall]
    for name in composition.narrow_phases:
        found |= _version("narrow phase", name, parts)
    for name in composition.rules.names if composition.rules is not None else ():
        found |= _version("response", name, composition.rules)
    return found


def differences(saved: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Return what is another version now, in words; "" where nothing is."""
    names = [*saved, *(name for name in now if name not in saved)]
    odd = [name for name in names if saved.get(name) != now.get(name)]
    return "; ".join(
        f"{name} was {saved.get(name, 'not there')}, is {now.get(name, 'not there')}" for name in odd
    )


def _version(kind: Kind, name: str, parts: Any) -> dict[str, str]:
    provided = registry().provided(kind, name)
    if provided.distribution is not None and provided.version is not None:
        said = f"{provided.distribution} {provided.version}"
    else:
        said = f"of the code {_code(parts)}"
    return {f"{kind} {provided.spec.name}": said}


def _hooks_of(part: Any) -> list[Any]:
    """Return the hooks of a part; of rules, those that respond."""
    return (
        [*part.hooks] if isinstance(part, Rules) else [hook for hook in vars(part).values() if callable(hook)]
    )


def _code(parts: Any) -> str:
    """Return a digest of the hooks among the parts of a phase."""
    each = parts if isinstance(parts, list) else [parts]
    hooks = [hook for part in each if part is not None for hook in _hooks_of(part)]
    found = [fingerprint(getattr(hook, "py_func", hook), type(parts))[0] for hook in hooks]
    return hashlib.sha256("".join(found).encode()).hexdigest()[:16]
