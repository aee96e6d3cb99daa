"""Observables of contacts: pressure and contact rates.

P A = N kT + (sum of d . J) / (2 t), with the area A, and for each contact in the time t the momentum J and
the vector d from centre to centre, or from the centre to the wall. kT = 2 K / n follows from the kinetic
energy K of n degrees of freedom (``Temperature``). The sum has two exact estimators. *Impulses* are added
directly: right for any scene, but they need the velocities before a contact. *Counts*: while all contacts are
elastic, the velocities in equilibrium, in units of 1/sqrt(mass), are a point on a sphere of n dimensions. So
the mean of J at a contact follows from the masses alone:

    <J>/kT = 2 F sqrt(mu), F = sqrt(pi) Gamma((n + 1)/2) / Gamma(n/2) / sqrt(2 K)

with the reduced mass mu, at a wall the body's mass. For equal discs, the estimators of Li et al., J. Chem.
Phys. 157, 234111 (2022), for walls, are the same, also on a torus. Before equilibrium counts are wrong.
"""

import math

import numpy as np

from kinetile import Collisions, Moment, Observable, Scene
from kinetile.arrays import Array, Floats
from kinetile.errors import BadOption, Refused
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP, WALLS
from kinetile_observables.geometry import axes_with_walls, displacement, inner_motion


class Pressure(Observable):
    """``P`` by the virial of all contacts, the mean over the arena, ``kT`` beside it, ``P/kT``, ``Z`` =
    P A / (N kT), and the pressure on each wall, such as ``P_bottom``.

    ``by`` is "counts" or "impulses" (see the module); by default counts, if all bodies are discs
    and all contacts are elastic, else impulses.
    """

    keeps = ("virial", "at_walls", "energy", "bodies", "movable", "last")

    def __init__(self, by: str | None = None) -> None:
        if by not in (None, "counts", "impulses"):
            raise BadOption(f"observable 'pressure': by is {by!r}; expected counts or impulses")
        self.by = by

    def prepare(self, scene: Scene) -> None:
        """Chooses the estimator. Raises Refused in the open plane."""
        if scene.arena is None:
            raise Refused("observable 'pressure' needs an arena: in the open plane there is no area")
        equilibrium = not any(
            [scene.responses, scene.commands, scene.accelerated, np.isinf(scene.mass).any()]
        )
        equilibrium = equilibrium and not scene.shapes  # d . J of discs alone is the sum of radii times J
        if self.by == "counts" and not equilibrium:
            raise Refused(
                "observable 'pressure:by=counts' needs a scene of discs with elastic contacts alone, and "
                "without commands and accelerations: choose by=impulses"
            )
        self.by = self.by or ("counts" if equilibrium else "impulses")
        self.needs = "contacts" if self.by == "counts" else "velocities"
        self.scene, self.area = scene, math.prod(scene.arena)
        width, height = scene.arena
        axes, lengths = axes_with_walls(scene), {LEFT: height, RIGHT: height, BOTTOM: width, TOP: width}
        self.lengths = {wall: each for wall, each in lengths.items() if "xy"[wall < RIGHT] in axes}
        if not self.lengths and not np.isfinite(scene.mass).all():
            raise Refused(
                "observable 'pressure' needs walls where some bodies are immovable, and this scene is "
                "periodic along both axes: what is immovable takes up momentum at every contact"
            )
        # A wall is an immovable body of radius 0; numbers from -4 to -1 find it at the end.
        self.radius = np.append(scene.radius, np.zeros(4))
        self.inverse_mass = np.append(1.0 / scene.mass, np.zeros(4))
        self.alike = bool((scene.radius == scene.radius[:1]).all() and (scene.mass == scene.mass[:1]).all())
        self.virial = self.energy = 0.0
        self.at_walls = np.zeros(len(WALLS))
        self.bodies = self.movable = 0
        self.last: float | None = None

    def collect(self, collisions: Collisions) -> None:
        """Adds d . J of contacts, and J of contacts with walls; by counts in units of 2 kT F."""
        a, b = collisions.a, collisions.b
        walls = b < 0
        if self.by == "impulses":
            width, height = self.scene.arena or (0.0, 0.0)
            place = collisions.position[:, 0]
            x, y = place.T
            apart = displacement(self.scene, collisions.position[:, 1] - place)
            to_wall = np.choose(np.where(walls, -b - 1, 0), [x, width - x, y, height - y])
            pushes = np.hypot(*collisions.impulse.T)
            terms = np.where(walls, to_wall * pushes, (apart * collisions.impulse).sum(axis=1))
        elif max(a.max(initial=0), b.max(initial=0)) >= len(self.radius) - 4:
            raise Refused(
                "a body was inserted by hand, and pressure by counts is of the bodies of the scene: expected "
                "pressure:by=impulses"
            )
        elif self.alike:  # counted; a weight for all of them is in sample
            pushes, terms = np.ones(len(b)), np.where(walls, 0.0, 1.0)
        else:
            pushes = 1.0 / np.sqrt(self.inverse_mass[a] + self.inverse_mass[b])
            terms = (self.radius[a] + self.radius[b]) * pushes
        self.virial = _added(self.virial, terms)
        np.add.at(self.at_walls, -1 - b[walls], pushes[walls])  # one by one, as ``_added``

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns the pressures of the time since the last sample."""
        if self.by == "counts" and any(moment.pull):
            raise Refused(
                "a body was accelerated by hand, and pressure by counts is of bodies that fly straight: "
                "expected pressure:by=impulses"
            )
        found: dict[str, float] = {}
        last, self.last = self.last, moment.time
        energy, masses = self.energy, moment.masses()
        mass, velocity, each = inner_motion(moment)
        self.energy, degrees = float((mass * velocity**2).sum()) / 2, float(each.sum())
        self.bodies, self.movable = len(masses), int(np.isfinite(masses).sum())
        virial, at_walls = self.virial, self.at_walls
        self.virial, self.at_walls = 0.0, np.zeros(len(WALLS))
        if self.by == "counts" and self.alike and len(self.radius) > 4:
            at_walls *= 1.0 / math.sqrt(self.inverse_mass[0])
            pairs = virial * math.sqrt(2.0 / self.inverse_mass[0])
            virial = float(self.radius[0]) * (float(at_walls.sum()) + pairs)
        if last is not None:
            time = moment.time - last
            if degrees <= 0 or energy + self.energy <= 0.0:
                return {}  # one body alone on a torus, or none
            heat = (energy + self.energy) / degrees  # kT
            unit = 1.0
            if self.by == "counts":
                ratio = math.exp(math.lgamma((degrees + 1) / 2) - math.lgamma(degrees / 2))
                unit = 2.0 * ratio * math.sqrt(math.pi * heat / degrees)  # 2 kT F
            if self.movable == self.bodies:
                virial = self.bodies * heat + unit * virial / (2.0 * time)
                found["P"] = virial / self.area
                found |= {"kT": heat, "P/kT": found["P"] / heat, "Z": virial / (self.bodies * heat)}
            forces = {wall: unit * float(at_walls[-1 - wall]) / time for wall in self.lengths}
            found |= {f"P_{WALLS[wall]}": force / self.lengths[wall] for wall, force in forces.items()}
        return found


def _added(total: float, terms: Floats) -> float:
    """Returns a sum and further terms that are not NaN, added one by one: unlike with ``numpy.sum``, the bits
    do not depend on the division of the terms into calls."""
    return float(np.cumsum(np.append(total, np.where(np.isnan(terms), 0.0, terms)))[-1])


class Rates(Observable):
    """Contacts in a unit of time: of ``pairs`` and with ``walls``, of pairs for each body (``Gamma``, each
    contact counts for both), and of each two kinds, such as ``big-small``, ``big-wall``. The kinds are those
    at the time of the sample; a passing counts once, at its beginning."""

    needs = "contacts"
    keeps = ("met", "last")

    def prepare(self, scene: Scene) -> None:
        """Notes the kinds of the scene."""
        self.kinds = scene.kinds
        self.met: list[Array] = []
        self.last: float | None = None

    def collect(self, collisions: Collisions) -> None:
        """Keeps the numbers of the bodies."""
        self.met.append(np.stack([collisions.a, collisions.b]))

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns the rates of the time since the last sample."""
        last, self.last = self.last, moment.time
        a, b = np.concatenate([np.zeros((2, 0), dtype=int), *self.met], axis=1)
        self.met = []
        if last is None:
            return {}
        time, begins = moment.time - last, (b < 0) | (b > a)
        walls = np.count_nonzero(b < 0)
        pairs = np.count_nonzero(begins) - walls
        found: dict[str, float] = {"pairs": pairs / time, "walls": walls / time}
        found["Gamma"] = 2.0 * found["pairs"] / max(len(moment.bodies), 1)
        if len(self.kinds) > 1:
            one, other = moment.kinds_of(np.stack([a[begins], b[begins]]))
            for k, kind in enumerate(self.kinds):
                for its in (*self.kinds[k:], "wall"):
                    both = (one == kind) & (other == its) | (one == its) & (other == kind)
                    found[f"{kind}-{its}"] = np.count_nonzero(both) / time
        return found
