"""Made-up results of the benchmark: worlds like and unlike the thesis says, and quiet or busy machines."""

from collections.abc import Callable

from kinetile_bench.event_rates import BODIES, DENSITIES
from kinetile_bench.thesis import PHASES, Cell, ThesisBench

EXPONENT = {0.5: 1.7, 0.25: 1.8, 0.125: 1.88, 0.01: 1.98}


def as_the_thesis_says(density: float, n: int, phase: str) -> dict:
    """Returns the values of a cell in a world that follows the thesis."""
    contacts = int(8.0 * density * n**1.5)
    bound = {"naive": 0.0, "sap-1d": 12.0 * n**2, "sap-2d": 24.0 * n**2}.get(
        phase, 9.0 * n ** EXPONENT[density]
    )
    cost_of_one = {"naive": 1.4 * n, "sweep-tiling": 1.2}.get(phase, 1.0)
    return {"contacts": contacts, "bound": int(bound), "cost": cost_of_one * (contacts + 1 + int(bound))}


World = Callable[[float, int, str], dict]

Times = Callable[[float, int, str, int, int], float]
"""A machine's factor on the time of a run, by density, discs, phase, seed and round."""


def quiet(density: float, n: int, phase: str, seed: int, number: int) -> float:
    """A machine without other load: the same run takes the same time within 1 %."""
    return 1.0 + 0.002 * ((5 * seed + 3 * number) % 6)


def restless(density: float, n: int, phase: str, seed: int, number: int) -> float:
    """A machine with another process: each run takes up to 1.6 times as long, under any phase."""
    return quiet(density, n, phase, seed, number) * (1.0 + 0.2 * ((seed + 2 * number + len(phase)) % 4))


def bench_of(
    world: World, phases: tuple[str, ...] = PHASES, machine: Times = quiet, rounds: int = 5
) -> ThesisBench:
    """Returns the results of a world on a machine."""
    cells = []
    for seed in range(1, 7):
        for density in DENSITIES:
            for n in BODIES:
                for phase in phases:
                    found = world(density, n, phase)
                    times = (found["cost"] * machine(density, n, phase, seed, k) for k in range(rounds))
                    contacts, walls = found["contacts"], found.get("walls", 1)
                    counts = {
                        "contacts_disc": contacts,
                        "contacts_wall": walls,
                        "contacts": contacts + walls,
                        "structural_events": found["bound"],
                        "events": contacts + walls + found["bound"],
                        **dict.fromkeys(("certificates_updated", "partners_asked", "contacts_computed"), 5),
                        **dict.fromkeys(("queue_max", "candidate_pairs"), 5),
                        "fingerprint": found.get("fingerprint", "same"),
                    }
                    cells.append(Cell(density, n, seed, phase, 1.0, tuple(times), counts))
    where = {"processor": "none", "seeds": 6, "until": 1.0, "repeats": rounds, "seconds": 0.01}
    return ThesisBench(tuple(cells), where)


def changed(**changes: Callable[[float, int, str, dict], object]) -> World:
    """Returns the thesis's world with some values of some cells replaced."""

    def world(density: float, n: int, phase: str) -> dict:
        found = as_the_thesis_says(density, n, phase)
        return found | {name: change(density, n, phase, found) for name, change in changes.items()}

    return world


def times(factor: float, *cases: tuple) -> Callable[[float, int, str, dict], float]:
    """Returns a change that multiplies the cost of some cells."""
    return lambda density, n, phase, found: found["cost"] * (factor if (density, n, phase) in cases else 1.0)
