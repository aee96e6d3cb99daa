"""Where the outcome of a case differs from the reference's, in a sentence."""

from __future__ import annotations

from kinetile.run.compare import describe_row, find_divergence, first_difference
from kinetile_conformance.cases import REFERENCE, RunOutcome, Tables


def difference(found: RunOutcome, expected: RunOutcome, name: str) -> str | None:
    """Return where the outcome of phase ``name`` first differs from the expected one, in a sentence; None:
    nowhere."""
    parted = find_divergence(REFERENCE, name, expected, found)
    if parted is None:
        return table_difference(found.tables, expected.tables)
    if parted.what == "end":
        ends = [f"{each.ended}, at time {each.time!r}" for each in (found, expected)]
        return f"{name} ended with {ends[0]}; {REFERENCE} with {ends[1]}"
    if parted.found is None:
        return f"{parted.place} is missing: {describe_row(parted.expected)}"
    if parted.expected is None:
        return f"{parted.place} is one too many: {describe_row(parted.found)}"
    return f"{parted.place} is {describe_row(parted.found)}, and should be {describe_row(parted.expected)}"


def table_difference(found: Tables, expected: Tables) -> str | None:
    """Return the first table entry that one run left otherwise than another, in a sentence; None: there is
    none."""
    for name, right in expected.items():
        mine = found.get(name, right)
        at = first_difference(mine, right)
        if at is None:
            continue
        if at >= min(len(mine), len(right)):
            return f"at the end {name} has {len(mine)} entries, not {len(right)}"
        whose = f" of body {at}" if len(right) > 1 or not name.startswith(("clock", "counts")) else ""
        return f"at the end {name}{whose} is {mine[at].item()!r}, not {right[at].item()!r}"
    return None
