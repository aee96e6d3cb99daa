"""Basis of all benchmarks: phases with their options, and results with their conditions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kinetile import Simulation, registry

NamedPhase = tuple[str, Mapping[str, Any]]
Choice = str | NamedPhase


def phases_with_options(choices: Sequence[Choice] | None) -> list[tuple[str, dict[str, Any]]]:
    """Returns (name, options) for each choice of a broad phase; None: for all registered ones."""
    chosen = registry().names("broad phase") if choices is None else choices
    return [(each, {}) if isinstance(each, str) else (each[0], dict(each[1])) for each in chosen]


def prepared(scene: Any, phase: NamedPhase, start: Callable[[Any], Any] = Simulation.compile) -> Simulation:
    """Returns a simulation that keeps no contacts, compiled by ``start``."""
    simulation = Simulation(scene, phase[0], options=phase[1], keep_contacts=False)
    start(simulation)
    return simulation


@dataclass(frozen=True)
class PhasesMeasured:
    """Rows, each of one phase on one ``scene`` with the ``fingerprint`` of its contacts, and conditions."""

    rows: tuple[Any, ...]
    conditions: Mapping[str, Any]

    @property
    def identical(self) -> bool:
        """True if on each scene all phases that ran gave the same contacts."""
        ran = {(row.scene, row.fingerprint) for row in self.rows if row.fingerprint is not None}
        return len(ran) == len({scene for scene, _ in ran})

    def as_dict(self) -> dict[str, Any]:
        """Returns all fields in plain types, fit for JSON."""
        rows = [vars(row) for row in self.rows]
        return {"conditions": dict(self.conditions), "rows": rows, "identical": self.identical}
