"""Readings in words: what the command line and a notebook say of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

__all__ = ["reading_lines"]


def reading_lines(found: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield readings (``Readings.as_dict``) line by line, each with the word that stands in front of it."""
    contacts = found["contacts_disc"] + found["contacts_wall"]
    asked, exact = (found[name] / max(contacts, 1) for name in ("partners_asked", "contacts_computed"))
    yield (
        "contacts",
        f"{contacts:,} ({found['contacts_disc']:,} of discs, {found['contacts_wall']:,} with walls)",
    )
    if found["passings"]:
        yield "passings", f"{found['passings']:,} begun; begin and end count as contacts of discs"
    turns = f", {found['turns']:,} turns" if found["turns"] else ""
    yield "events", f"{found['events']:,} ({found['structural_events']:,} structural{turns})"
    yield "certificates", f"{found['certificates_updated']:,} times set anew"
    yield "queue", f"at most {found['queue_max']:,} long"
    yield "candidate pairs", f"{found['newcomers']:,} came after the start"
    yield (
        "contact times",
        f"{found['partners_asked']:,} partners asked, {found['contacts_computed']:,} times worked out exactly"
        + (f" ({asked:.3g} and {exact:.3g} a contact)" if contacts else ""),
    )
    yield "deepest overlap", f"{found['deepest_overlap']:.2g} radii"
    yield "energy drift", f"{found['energy_drift']:.2g} (relative)"
    yield "lateness", f"{found['lateness']:.2g} time units"
    if found["audits"]:
        yield "audits", f"{found['audits']:,}: nothing was found"
    yield (
        "CPU time",
        f"{found['cpu_seconds']:.4g} s in the loop, {found['compile_seconds']:.3g} s to make it ready",
    )
    yield (
        "speed",
        f"{found['events_per_cpu_second'] / 1e6:.3g} million events, "
        f"{found['contacts_per_cpu_second'] / 1e3:,.4g} thousand contacts a CPU second",
    )
    yield "fingerprint", found["fingerprint"]
