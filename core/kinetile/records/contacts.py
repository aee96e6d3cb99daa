"""Lists of contacts as plain text, from any program: one line each, "epoch tick a b" (rule 10 of
docs/specification.md). Optional last lines are "fingerprint" with 64 hexadecimal digits, the digest of the
contacts, and "unit U start S" of the clock: a time is S + (epoch + tick * 2**-52) * U."""

import os
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import BadOption
from kinetile.scene.checks import shown
from kinetile.targets import replacing

CONTACT_LINE = np.dtype([(name, "i8") for name in ("epoch", "tick", "a", "b")])
"""A line of such a list; it need not be a real contact."""

_PRINT = re.compile(r"fingerprint\s+([0-9a-f]{64})")
_AT_ONCE = 1 << 16  # writing by columns takes half the time of writing by rows


class ContactLines(NamedTuple):
    """Contents of a list: its rows (dtype CONTACT_LINE), and the fingerprint in its last line, or None."""

    rows: Array
    fingerprint: str | None


def read_contacts(lines: Iterable[str], source: str) -> ContactLines:
    """Reads a list of contacts; BadOption, with ``source`` and the line, for an invalid one."""
    fingerprint: str | None = None

    def contacts() -> Iterator[tuple[int, ...]]:
        nonlocal fingerprint
        blank = 0
        for number, text in enumerate(map(str.strip, lines), 1):
            if not text:
                blank = blank or number
            elif blank:
                raise BadOption(f"{source}, line {blank}: found nothing; expected a contact, epoch tick a b")
            elif text.startswith("unit "):  # for readers who compute times
                continue
            elif fingerprint is not None:
                raise BadOption(
                    f"{source}, line {number}: found {shown(text)} after the fingerprint; expected nothing"
                )
            elif found := _PRINT.fullmatch(text):
                fingerprint = found[1]
            else:
                yield _numbers(text, source, number)

    return ContactLines(np.fromiter(contacts(), CONTACT_LINE), fingerprint)


def _numbers(text: str, source: str, number: int) -> tuple[int, ...]:
    try:
        found = tuple(map(int, text.split()))
    except ValueError:
        found = ()
    if len(found) != 4 or any(not -(2**63) <= each < 2**63 for each in found):
        raise BadOption(
            f"{source}, line {number}: found {shown(text)}; expected epoch, tick, a and b, four whole "
            "numbers of 64 bits, or as the last line 'fingerprint' and 64 hexadecimal digits"
        )
    return found


UnitAndStart = tuple[float, float]
"""The unit and the start of a clock."""


def write_contacts(path: str | os.PathLike[str], contacts: Array, digest: str, clock: UnitAndStart) -> None:
    """Writes the text of ``contact_lines``. Raises OSError if impossible; then an existing file stays."""
    with replacing(path) as file:
        file.writelines(text.encode() for text in contact_lines(contacts, digest, clock))


def contact_lines(contacts: Array, digest: str, clock: UnitAndStart) -> Iterator[str]:
    """Yields the text of a list of contacts (rows with the fields epoch, tick, a, b), many lines at once,
    then the fingerprint and the clock."""
    for first in range(0, len(contacts), _AT_ONCE):
        some = contacts[first : first + _AT_ONCE]
        columns = [some[name].tolist() for name in ("epoch", "tick", "a", "b")]
        yield "".join(f"{e} {t} {a} {b}\n" for e, t, a, b in zip(*columns, strict=True))
    yield f"fingerprint {digest}\nunit {clock[0]!r} start {clock[1]!r}\n"
