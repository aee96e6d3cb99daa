"""Scenes drawn freshly from a seed: every second one on a torus, with sides of 1:1 to 20:1; about half have
bodies that pass, some of them on top of each other at the start or at an insertion; bodies turn, are inserted
and removed. Commands are given by hand under ``naive`` and recorded, so each is one that happens."""

import random
from contextlib import suppress

import kinetile as kt
from kinetile.errors import Refused, SceneError
from kinetile.kernel.log import INSERTED, REMOVED, TURNED, WALLS

KINDS = ("ball", "wisp")


def fresh(seed: int, contacts: int = 15) -> tuple[kt.Scene, float]:
    """Returns a scene with its recorded commands, and a time after some contacts, or after 4 time units."""
    rng = random.Random(f"fresh {seed}")
    scene = _start(rng, rng.choice(("x", "y", "xy")) if seed % 2 else "")
    sim = kt.Simulation(scene, "naive", live=True)
    for _ in range(rng.choice((0, 2, 5))):
        sim.run(until=sim.time + rng.choice((0.0, 0.125, rng.random())), max_contacts=contacts // 5)
        with suppress(Refused, ValueError):
            _command(rng, sim, scene)
    sim.run(until=sim.time + 4.0, max_contacts=contacts)
    return sim.recorded().replace(settings=kt.Settings()), sim.time


def _start(rng: random.Random, periodic: str) -> kt.Scene:
    """Returns a scene without commands, on a lattice (with exact ties) or anywhere."""
    sides = [1.0, rng.choice((1.0, 1.5, 4.0, 20.0))]
    rng.shuffle(sides)
    frame = {"arena": tuple(sides), "periodic": periodic, "kinds": KINDS}
    if rng.random() < 0.6:
        frame["responses"] = dict.fromkeys(rng.sample([("wisp", "wisp"), ("ball", "wisp")], 1), "pass")
        if rng.random() < 0.5:
            frame["responses"] = {("wisp", "*"): "pass"}
    lattice, n = rng.random() < 0.4, rng.randrange(2, 7)
    bodies: dict[str, list[object]] = {name: [] for name in ("position", "velocity", "radius", "kind")}
    made = None
    for _ in range(60):
        body = _body(rng, sides, lattice)
        if bodies["position"] and rng.random() < 0.4:  # on top of another one
            body["position"] = bodies["position"][-1]
        more = {name: [*column, body[name]] for name, column in bodies.items()}
        with suppress(SceneError):
            made = kt.Scene(**more, **frame)
            bodies = more
        if len(bodies["radius"]) == n:
            break
    return made or _start(rng, periodic)


def _body(rng: random.Random, sides: list[float], lattice: bool) -> dict[str, object]:
    if lattice:
        position = [rng.randrange(1, int(16 * side)) / 16 for side in sides]
        velocity = [rng.randrange(-2, 3) / 2 for _ in sides]
        return {"position": position, "velocity": velocity, "radius": 1 / 16, "kind": rng.choice(KINDS)}
    return {
        "position": [rng.uniform(0.0, side) for side in sides],
        "velocity": [rng.gauss(0.0, rng.choice((0.1, 1.0, 8.0))) for _ in sides],
        "radius": rng.choice((0.02, 0.1, 0.3)) * rng.uniform(0.5, 1.0),
        "kind": rng.choice(KINDS),
    }


def _command(rng: random.Random, sim: kt.Simulation, scene: kt.Scene) -> None:
    """Turns, removes or inserts a body; one that passes may be inserted on top of another one."""
    assert scene.arena is not None
    there, what = sim.bodies.tolist(), rng.random()
    if what < 0.3:
        sim.set_velocity(rng.choice(there), (rng.gauss(0.0, 1.0), rng.choice((0.0, -1.0, 1.5))))
    elif what < 0.45 and len(there) > 1:
        sim.remove(rng.choice(there))
    else:
        body = _body(rng, list(scene.arena), what < 0.6)
        if rng.random() < 0.6:
            body["position"] = sim.positions()[rng.randrange(len(there))].tolist()
        sim.insert(**body)  # type: ignore[arg-type]


def row_of(event: kt.Event) -> tuple[int, ...]:
    """Returns the first fields of an event's row in a log: epoch, tick, a, b; for a structural event a is the
    body whose certificate fails, and b is -1."""
    codes = {"turn": TURNED, "insert": INSERTED, "remove": REMOVED, "structural": -1}
    codes |= {name: number for number, name in WALLS.items()}
    bodies = event.bodies if event.certificate is None else (event.certificate,)
    bodies += tuple(codes[name] for name in (event.wall, event.kind) if name in codes)
    return event.epoch, event.tick, *(bodies[::-1] if event.kind == "part" else bodies)


__all__ = ["fresh", "row_of"]
