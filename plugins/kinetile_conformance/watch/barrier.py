"""The barrier: before and after each hook, all that the hook may not change is compared, byte for byte.

What a hook may change is its state, ``k.near``, and what the functions of the toolbox change on its behalf:
``offer``, ``add_pair`` and ``remove_pair`` the offers and the pair set, ``blame`` the fault, ``falls`` a
reading. ``schedule`` sets a certificate. Each time that it changes one it counts it, and, but for the body
whose hook is at work, it leaves the body among the offers to be settled. So a certificate that is another one
than before, and of which nothing was left there, was written by somebody else.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from kinetile.kernel.tables import NOBODY, Kernel
from kinetile.scene import Scene

__all__ = ["HOOKS", "Snapshot", "breaches"]

FAULT = {"fault", "fault_a", "fault_b"}
EVERYTHING: set[str] = set()
"""Stands for all fields of a table."""

TOOLBOX = {
    "queue": {"own"},
    "offers": EVERYTHING,
    "pairs": EVERYTHING,
    "lookup": EVERYTHING,
    "firsts": EVERYTHING,
    "clock": {"offered", "pairs", "free", "wanted", *FAULT},
    "counts": {"updated", "pairs_max", "late"},
}
ONLY_NAMES = {"near": EVERYTHING, "clock": FAULT, "counts": {"late"}}

HOOKS = {
    "build": {**TOOLBOX, "near": EVERYTHING},
    "repair": {**TOOLBOX, "near": EVERYTHING},
    "replan": TOOLBOX,
    "enter": {**TOOLBOX, "near": EVERYTHING},
    "leave": {**TOOLBOX, "near": EVERYTHING},
    "near": ONLY_NAMES,
    "arrange": ONLY_NAMES,
    "audit": ONLY_NAMES,
}
"""What each hook may change of the kernel's tables; of none but the state it may change anything else."""

ONLY_GROW = {"clock": ("offered", "wanted"), "counts": ("updated", "pairs_max", "late")}

OF_SCENE = ("position", "velocity", "radius", "mass")


class Snapshot(NamedTuple):
    """What was there before a hook: copies of the tables that it may not change in whole, as far as they are
    in use, of the scene's arrays, and, where it may not change that either, of its state."""

    tables: dict[str, Any]
    scene: dict[str, bytes]
    state: dict[str, Any]

    @classmethod
    def of(cls, hook: str, k: Kernel, s: Any, scene: Scene) -> Snapshot:
        """Take one before a hook is called."""
        may = HOOKS[hook]
        tables = {name: _copy(t) for name, t in k._asdict().items() if may.get(name) is not EVERYTHING}
        for name, used in (("offers", "offered"), ("met", "logged"), ("log", "written")):
            tables[name] = _copy(getattr(k, name)[: int(k.clock[0][used])])
        state = {name: array.copy() for name, array in s._asdict().items()} if hook == "audit" else {}
        return cls(tables, bytes_of(scene), state)


def bytes_of(scene: Scene) -> dict[str, bytes]:
    """Return the arrays of a scene as they are now."""
    return {name: getattr(scene, name).tobytes() for name in OF_SCENE}


def breaches(hook: str, before: Snapshot, k: Kernel, s: Any, scene: Scene) -> Iterator[str]:
    """Yield what a hook has changed and may not, now that it has returned."""
    may = HOOKS[hook]
    for name, was in before.tables.items():
        table = _plain(getattr(k, name))[: len(was)]
        if was.tobytes() != table.tobytes():
            yield from _changed(name, was, table, may.get(name, set()) if name != "offers" else set())
    for name, fields in ONLY_GROW.items():
        was, is_now = before.tables[name][0], getattr(k, name)[0]
        yield from (f"{name}.{field} (it has become less)" for field in fields if is_now[field] < was[field])
    if "queue" in may:
        yield from _not_scheduled(before, k)
    for name, held in bytes_of(scene).items():
        if held != before.scene[name]:
            yield f"the scene's {name}"
    for name, was in before.state.items():
        if was.tobytes() != getattr(s, name).tobytes():
            yield f"s.{name}"


def _plain(table: Any) -> Any:
    """Return a table without the attributes of its columns, which take time."""
    return table.view(np.ndarray)


def _copy(table: Any) -> Any:
    """Return what is in a table, at once: NumPy would copy records with gaps field by field."""
    return np.frombuffer(table.tobytes(), table.view(np.ndarray).dtype)


def _changed(name: str, was: Any, table: Any, may: set[str]) -> Iterator[str]:
    """Yield the first row in which each field that may not change is another one than before."""
    for field in table.dtype.names or (None,):
        if field in may:
            continue
        old, new = (was, table) if field is None else (was[field], table[field])
        if old.tobytes() != new.tobytes():
            row = next(row for row in range(len(new)) if old[row].tobytes() != new[row].tobytes())
            which = name if name in ("clock", "counts") else f"{name}[{row}]"
            which += f".{field}" if field else ""
            yield f"{which} ({new[row].item()!r}, where {old[row].item()!r} stood)"


def _not_scheduled(before: Snapshot, k: Kernel) -> Iterator[str]:
    """Yield certificates that are other ones than before, and not by ``schedule``."""
    clock = k.clock[0]
    first, last, hand = len(before.tables["offers"]), int(clock.offered), int(clock.hand)
    if not first <= last <= len(k.offers):
        return  # every body is asked anew, and nothing was left
    left = _plain(k.offers)[first:last]
    settled = left["a"][left["b"] == NOBODY].tolist()
    set_anew = int(k.counts[0].updated) - int(before.tables["counts"][0]["updated"])
    own, was = _plain(k.queue)["own"], before.tables["queue"]["own"]
    changed = np.flatnonzero(own != was).tolist()
    for body in changed:
        if body != hand and body not in settled:
            yield f"queue[{body}].own, the certificate of body {body}, other than by schedule"
    of_hand = set_anew - len(settled)
    if hand in changed and of_hand == 0:
        yield f"queue[{hand}].own, the certificate of body {hand}, other than by schedule"
    elif of_hand < 0 or (of_hand > 0 and hand < 0):
        yield f"counts.updated ({set_anew} more, where {len(settled)} certificates were scheduled)"
