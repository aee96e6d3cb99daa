"""What was probably meant: the known name nearest to one that is not known.

Edit distance alone misses the short forms that people type ("sap" for "sap-1d"), so names are compared with
case and the choice between ``_`` and ``-`` folded away, and a beginning that only one name has counts too.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["nearest", "one_of"]


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that ``name`` was probably meant to be, or None if none is near."""
    folded = {_fold(each): each for each in known}
    wanted = _fold(name)
    if wanted in folded:
        return folded[wanted]
    begun = [each for each in folded if wanted and each.startswith(wanted)]
    if len(begun) == 1:
        return folded[begun[0]]
    close = get_close_matches(wanted, folded, n=1, cutoff=0.6)
    return folded[close[0]] if close else None


def one_of(name: str, known: Iterable[str]) -> str:
    """Return what stands after "expected" where ``name`` is not one of the known names."""
    names = list(known)
    if not names:
        return "nothing here"
    choice = f"one of {', '.join(names)}" if len(names) > 1 else names[0]
    meant = nearest(name, names)
    return f"{choice}; did you mean {meant!r}?" if meant else choice


def _fold(name: str) -> str:
    return name.casefold().replace("_", "-")
