"""Observables of sampled moments: energy, temperature, momentum, diffusion, structure."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile import Moment, Observable, Scene
from kinetile.arrays import Floats
from kinetile.errors import BadOption, Refused
from kinetile_observables.geometry import axes_with_walls, inner_motion, movable, narrowest, neighbours, parts
from kinetile_observables.power_cells import cells_of


def _whole(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise BadOption(f"{name} is {value!r}; expected a whole number, at least 1")
    return value


class Energy(Observable):
    """``E``: the kinetic energy of all movable bodies; with accelerations ``U``, their potential
    energy, the sum of -m a.r, each with its own acceleration a."""

    keeps = ()

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns the energies."""
        mass, velocity = movable(moment)
        found = {"E": float((mass * velocity**2).sum()) / 2}
        if moment.scene.accelerated:
            heights = (moment.positions() * moment.whole_accelerations()).sum(axis=1)
            found["U"] = -float(mass[:, 0] @ heights[np.isfinite(moment.masses())])
        return found


class Momentum(Observable):
    """``px`` and ``py``: the momentum of all movable bodies."""

    keeps = ()

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns both components."""
        mass, velocity = movable(moment)
        each = mass * velocity
        kept = np.abs(each.sum(axis=0)) <= 2.0**-40 * np.abs(each).sum(axis=0)  # 0, except for rounding
        x, y = np.where(kept, 0.0, each.sum(axis=0)).tolist()
        return {"px": x, "py": y}


class Temperature(Observable):
    """``kT``: the energy m v^2 of the movable bodies' motion about their centre of mass, over its degrees of
    freedom: two a body, less m/M for each axis that conserves the momentum of all, of mass M: an axis without
    walls, unless some are immovable. With several kinds, or masses, also for each, as ``kT of big``."""

    keeps = ()

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns the temperatures."""
        mass, velocity, degrees = inner_motion(moment)
        energies = (mass * velocity**2).sum(axis=1)
        sums = {name: (energies[its].sum(), degrees[its].sum()) for name, its in parts(moment, "kT").items()}
        # No bodies have no degrees of freedom, nor has one body alone on a torus.
        return {name: float(energy / many) for name, (energy, many) in sums.items() if many > 0.0}


class _Lagged(Observable):
    """Averages over movable bodies and pairs of moments, by the time between them: 0 to ``lags``; with
    several kinds, or masses, also for each, as ``msd of big``."""

    name = ""
    keeps = ("kept", "times", "bodies")
    read: Any  # returns the compared vectors of a moment, (n, 2)
    compare: Any  # returns their terms for an earlier and a later moment, (n, 2)

    def __init__(self, lags: int = 50) -> None:
        self.lags = np.arange(_whole("lags", lags) + 1)
        self.kept: list[Floats] = []
        self.times: list[float] = []
        self.bodies: dict[str, list[int]] = {}

    def sample(self, moment: Moment) -> dict[str, Floats]:
        """Returns the means with this moment as the later one; NaN for lags before the first."""
        self.times = [*self.times, moment.time][:2]
        moves, which = np.isfinite(moment.masses()), parts(moment, self.name)
        now, bodies = self.read(moment)[moves], moment.bodies[moves]
        before, self.bodies = self.bodies, {name: bodies[its].tolist() for name, its in which.items()}
        if before != self.bodies:
            self.kept = []  # bodies were inserted, removed, or given another kind
        self.kept = [now, *self.kept][: len(self.lags)]
        found = {name: np.full(len(self.lags), math.nan) for name in which}
        for lag, then in enumerate(self.kept):
            each = self.compare(then, now).sum(axis=1)
            for name, its in which.items():
                found[name][lag] = each[its].sum() / max(np.count_nonzero(its), 1)
        return found

    @property
    def axes(self) -> Mapping[str, tuple[str, npt.ArrayLike]]:  # type: ignore[override]
        interval = self.times[1] - self.times[0] if len(self.times) > 1 else math.nan
        return dict.fromkeys(self.bodies, ("time", self.lags * interval))


class MeanSquaredDisplacement(_Lagged):
    """``msd``: the mean of |r(t) - r(0)|^2 over movable bodies and moments 0, t up to ``lags`` intervals."""

    name = "msd"
    read = staticmethod(Moment.unwrapped)  # positions that do not jump at a periodic border
    compare = staticmethod(lambda then, now: (now - then) ** 2)


class VelocityAutocorrelation(_Lagged):
    """``vacf``: the mean of v(t) . v(0) over movable bodies and moments 0, t up to ``lags`` intervals."""

    name = "vacf"
    read = staticmethod(Moment.velocities)
    compare = staticmethod(np.multiply)


class _InArena(Observable):
    """An observable of places in an arena."""

    name = ""
    keeps = ()

    def prepare(self, scene: Scene) -> None:
        if scene.arena is None:
            raise Refused(f"observable {self.name!r} needs an arena: in the open plane there is no density")
        self.scene = scene
        self.sides = np.array(scene.arena)


class PairCorrelation(_InArena):
    """``g``: the number of pairs by the distance r of their centres, over that number for as many points at
    random places, from the places that centres can have. ``bins`` of equal width reach from 0 to ``to``, by
    default half the shorter side of the arena, and at most five of the largest diameters."""

    name = "g"

    def __init__(self, bins: int = 100, to: float | None = None) -> None:
        self.bins, self.to = _whole("bins", bins), to

    def prepare(self, scene: Scene) -> None:
        """Computes the probability of each bin for points at random places."""
        super().prepare(scene)
        walls = np.array([axis in axes_with_walls(scene) for axis in "xy"])
        a, b = self.sides - narrowest(scene) * walls
        most = float(np.where(walls, (a, b), self.sides / 2).min())
        to = self.to or min(float(self.sides.min()) / 2, 10.0 * float(scene.radius.max(initial=0.0)), most)
        if not 0.0 < to <= most:
            raise BadOption(f"observable 'g': to is {self.to!r}; expected a distance up to {most!r}")
        self.edges = np.linspace(0.0, to, self.bins + 1)
        # For two points in a rectangle of sides a and b with difference d: along an axis with walls d_x
        # has a density in proportion to a - |d_x|, along a periodic axis a uniform one. Over all directions:
        r = self.edges
        within = math.pi * a * b * r**2 - (4.0 / 3.0) * (b * walls[0] + a * walls[1]) * r**3
        within += walls.all() * r**4 / 2.0
        self.expected = np.diff(within / (a * b) ** 2)
        self.axes = {"g": ("r", (r[1:] + r[:-1]) / 2)}

    def sample(self, moment: Moment) -> dict[str, Floats]:
        """Returns g of this moment."""
        n = len(moment.bodies)
        found = np.zeros(self.bins)
        for _, _, apart in neighbours(self.scene, moment.positions(), self.edges[-1]):
            found += np.histogram(np.hypot(*apart.T), self.bins, (0.0, self.edges[-1]))[0]
        return {"g": found / (self.expected * (n * (n - 1) / 2))} if n > 1 else {}


class StructureFactor(_InArena):
    """``S``: |sum of exp(i k . r)|^2 / N for wave vectors 2 pi (i/W, j/H), i and j from 0 to ``modes``, as
    means over shells of |k| of equal width; without k = 0."""

    name = "S"

    def __init__(self, modes: int = 20) -> None:
        self.modes = _whole("modes", modes)

    def prepare(self, scene: Scene) -> None:
        """Sorts the wave vectors into shells."""
        super().prepare(scene)
        i = np.arange(-self.modes, self.modes + 1)
        kx, ky = 2.0 * math.pi * i[self.modes :] / self.sides[0], 2.0 * math.pi * i / self.sides[1]
        size = np.hypot(kx[:, None], ky).ravel()
        width = 2.0 * math.pi / float(self.sides.min())
        shell = np.rint(size / width).astype(int)
        self.waves = kx, ky
        self.inside = (shell > 0) & (shell <= self.modes)
        self.shells, self.which = np.unique(shell[self.inside], return_inverse=True)
        self.many = np.bincount(self.which)
        self.axes = {"S": ("k", np.bincount(self.which, size[self.inside]) / self.many)}

    def sample(self, moment: Moment) -> dict[str, Floats]:
        """Returns S of this moment."""
        places = moment.positions().T
        x, y = (np.exp(1j * np.outer(k, r)) for k, r in zip(self.waves, places, strict=True))
        power = np.abs(x @ y.T).ravel() ** 2 / max(places.shape[1], 1)
        return {"S": np.bincount(self.which, power[self.inside]) / self.many}


_FARTHEST = 1e300


class BondOrder(_InArena):
    """Order of bonds, from psi = mean of exp(6 i angle) over neighbours (0 without any): ``psi6``, the size
    of its mean over bodies, ``psi6_local``, its mean size. Neighbours are not further than ``cutoff`` sums of
    radii; with the cutoff "voronoi" their Voronoi cells adjoin."""

    name = "psi6"

    def __init__(self, cutoff: float | str = 1.5) -> None:
        if cutoff != "voronoi" and not (isinstance(cutoff, (int, float)) and 1.0 < cutoff <= _FARTHEST):
            raise BadOption(f"cutoff is {cutoff!r}; expected a number of sums of radii, above 1, or voronoi")
        self.cutoff = cutoff

    def prepare(self, scene: Scene) -> None:
        """Raises Refused for other shapes than discs: their contact distances are no sums of radii."""
        super().prepare(scene)
        if scene.shapes:
            raise Refused("observable 'psi6' is of discs alone, and this scene has bodies of other shapes")

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns both values of this moment."""
        places, radii = moment.positions(), moment.radii()
        if not len(radii):
            return {}
        if isinstance(self.cutoff, str):
            psi = cells_of(self.scene, places, 0.0 * radii).order
        else:
            psi, many = np.zeros(len(radii), dtype=complex), np.zeros(len(radii))
            for one, other, apart in neighbours(self.scene, places, 2.0 * self.cutoff * radii.max()):
                bonded = np.hypot(*apart.T) <= self.cutoff * (radii[one] + radii[other])
                turn = np.exp(6j * np.arctan2(apart[bonded, 1], apart[bonded, 0]))
                for ends in (one[bonded], other[bonded]):  # seen from the other end, six half turns more
                    np.add.at(psi, ends, turn)
                    np.add.at(many, ends, 1.0)
            psi /= np.maximum(many, 1.0)
        return {"psi6": float(abs(psi.mean())), "psi6_local": float(np.abs(psi).mean())}
