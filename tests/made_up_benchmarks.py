"""Made-up results of the benchmark: worlds where statements hold or not, machines that are quiet or not."""

from collections.abc import Callable

from kinetile_bench.event_rates import BODIES, DENSITIES
from kinetile_bench.thesis import PHASES, Cell, ThesisBench

EXPONENT = {0.5: 1.7, 0.25: 1.8, 0.125: 1.88, 0.01: 1.98}


def as_the_thesis_says(density: float, n: int, phase: str) -> dict:
    """Returns what a cell has in a world where all is as the thesis says."""
    contacts = int(8.0 * density * n**1.5)
    bound = {"naive": 0.0, "sap-1d": 12.0 * n**2, "sap-2d": 24.0 * n**2}.get(
        phase, 9.0 * n ** EXPONENT[density]
    )
    cost_of_one = {"naive": 1.4 * n, "sweep-tiling": 1.2}.get(phase, 1.0)
    return {"contacts": contacts, "bound": int(bound), "cost": cost_of_one * (contacts + 1 + int(bound))}


World = Callable[[float, int, str], dict]

Times = Callable[[float, int, str, int, int], float]
"""What a machine makes of the time of a run: density, discs, phase, seed and round give a factor."""


def quiet(density: float, n: int, phase: str, seed: int, number: int) -> float:
    """A machine that does nothing besides: the same run takes the same time within 1 %."""
    return 1.0 + 0.002 * ((5 * seed + 3 * number) % 6)


def restless(density: float, n: int, phase: str, seed: int, number: int) -> float:
    """Beside another process: each run takes up to 1.6 times as long, whichever phase it is of."""
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
