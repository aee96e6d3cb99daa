"""The broad phases that a benchmark runs: how they are chosen and written, and a simulation under one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["Choice", "contacts_of", "phase_label", "phases_with_options", "simulation_of"]

Choice = str | tuple[str, Mapping[str, Any]]
"""A broad phase by name, or its name and its options."""


def phases_with_options(choices: Sequence[Choice]) -> list[tuple[str, dict[str, Any]]]:
    """Return (name, options) for each choice of a broad phase."""
    return [(each, {}) if isinstance(each, str) else (each[0], dict(each[1])) for each in choices]


def phase_label(name: str, options: Mapping[str, Any]) -> str:
    """Return how a broad phase with its options is written: ``sap-1d:axis=y``."""
    written = ",".join(f"{key}={value}" for key, value in options.items())
    return f"{name}:{written}" if written else name


def contacts_of(simulation: Any) -> int:
    """Return how many contacts a simulation has had, of discs and with walls."""
    readings = simulation.readings
    return int(readings.contacts_disc + readings.contacts_wall)


def simulation_of(scene: Any, choice: tuple[str, Mapping[str, Any]]) -> Any:
    """Return a simulation that keeps no contacts, under a phase by name and options."""
    from kinetile.run.simulation import Simulation

    return Simulation(scene, choice[0], options=choice[1], keep_contacts=False)
