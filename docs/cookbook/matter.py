"""Matter measured and compared with published numbers: ``python docs/cookbook/matter.py [NAME ...]``.

Each function measures a system, prints its result beside the published or exact value, and fails if the two
differ by more than four standard errors. Units: the diameter of a disc (of the larger in a mixture), its mass
(of the smaller), and kT; in the Lorentz gas the radius of a scatterer and the speed. ``rho`` is the reduced
density, discs a squared diameter. ``draw.py`` draws the pictures of these systems from longer runs.
"""

from __future__ import annotations

import math
import sys

import numpy as np

import kinetile as kt

Z = {0.2: 1.411834, 0.3: 1.723373, 0.4: 2.151444, 0.5: 2.760124, 0.6: 3.663698, 0.8: 7.476513}
"""P/(rho kT) by rho: Kolafa and Rottner, Mol. Phys. 104, 3435, 2006, a fit to the infinite fluid."""


def fluid(bodies: int, rho: float, seed: int = 1) -> kt.Scene:
    """Returns equal discs of diameter 1 on a torus."""
    packing = rho * math.pi / 4
    return kt.make_scene("mixture", bodies=bodies, radii=(0.5,), density=packing, periodic="xy", seed=seed)


def equation_of_state() -> None:
    """Z of 1,600 discs; and the pressure of 72, which is known to seven digits at area fraction 0.65 (Li,
    Nishikawa, Höllmer, Carillo, Maggs and Krauth, J. Chem. Phys. 157, 234111, 2022)."""
    for rho in (0.2, 0.4, 0.6, 0.8):
        sim = kt.Simulation(fluid(1600, rho), keep_contacts=False)
        sim.run(max_contacts=40_000)  # 50 contacts a disc: to equilibrium
        sim.run(max_contacts=320_000, observe=["pressure"])
        z = sim.observed["pressure"]["Z"]
        print(f"rho {rho}: Z = {z.mean:.4f} +- {z.error:.4f}, published {Z[rho]}")
        assert abs(z.mean - Z[rho]) < 4 * z.error
        assert z.error < 2e-3 * Z[rho]
    rho = 0.65 * 4 / math.pi
    sim = kt.Simulation(fluid(72, rho, seed=4), keep_contacts=False)
    sim.run(max_contacts=10_000)
    sim.run(max_contacts=2_000_000, observe=["pressure"])
    z = sim.observed["pressure"]["Z"]
    print(f"72 discs: P = {rho * z.mean:.4f} +- {rho * z.error:.4f}, published 6.901074(71)")
    assert abs(rho * z.mean - 6.901074) < 4 * rho * z.error
    assert rho * z.error < 0.02


def diffusion() -> None:
    """The slope of the velocity autocorrelation C at time 0: C'(0)/C(0) = -Gamma exactly, since a disc
    keeps its energy on average; Gamma = 4 (Z - 1)/sqrt(pi). And msd'' = 2 C, so at first msd is 2 kT t^2/m.

    The slope is taken from a polynomial fit of C at short times, in 16 consecutive runs.
    """
    sim = kt.Simulation(fluid(1600, 0.5), keep_contacts=False)
    sim.run(20.0)  # 80 contacts a disc: to equilibrium
    slopes, rates = [], []
    for _ in range(16):
        sim.run(sim.time + 3.0, observe=["vacf:every=0.02,lags=12", "msd:every=0.02,lags=12", "rates"])
        c = sim.observed["vacf:every=0.02,lags=12"]["vacf"]
        logarithm = np.log(c.mean / c.mean[0])  # 0 at 0
        slopes.append(np.polynomial.polynomial.polyfit(c.at, logarithm, [1, 2, 3])[1])
        rates.append(sim.observed["rates"]["Gamma"].mean)
    slope, error = np.mean(slopes), np.std(slopes, ddof=1) / 4
    rate, its_error = np.mean(rates), np.std(rates, ddof=1) / 4
    expected = 4 * (Z[0.5] - 1) / math.sqrt(math.pi)
    print(f"C'(0)/C(0) = {slope:.3f} +- {error:.3f}, Gamma = {rate:.4f} +- {its_error:.4f}, {expected:.4f}")
    assert abs(slope + rate) < 4 * math.hypot(error, its_error)
    assert error < 0.02 * rate
    assert abs(rate - expected) < 4 * its_error
    msd = sim.observed["msd:every=0.02,lags=12"]["msd"]
    assert 1.8 < msd.mean[1] / msd.at[1] ** 2 < 2.0


def pair_correlation() -> None:
    """The value of g at contact gives the pressure again: Z = 1 + 2 eta g(1) (N - 1)/N on a torus of N.

    The histogram is extrapolated to r = 1 by a cubic, in eight runs, and compared with counted contacts.
    """
    bodies, eta = 1600, 0.5 * math.pi / 4
    sim = kt.Simulation(fluid(bodies, 0.5), keep_contacts=False)
    sim.run(20.0)
    contact, factors = [], []
    for _ in range(8):
        sim.run(sim.time + 20.0, observe=["g:bins=150,to=1.5,every=1", "pressure"])
        g = sim.observed["g:bins=150,to=1.5,every=1"]["g"]
        near = (g.at > 1.0) & (g.at < 1.3)
        contact.append(np.polynomial.Polynomial.fit(g.at[near], g.mean[near], 3)(1.0))
        factors.append(sim.observed["pressure"]["Z"].mean)
    assert (g.mean[g.at < 1.0] == 0).all()
    by_g = 1 + 2 * eta * np.array(contact) * (bodies - 1) / bodies
    z, error = by_g.mean(), by_g.std(ddof=1) / math.sqrt(8)
    counted, its_error = np.mean(factors), np.std(factors, ddof=1) / math.sqrt(8)
    print(
        f"Z = {z:.3f} +- {error:.3f} by g, {counted:.4f} +- {its_error:.4f} by contacts, published {Z[0.5]}"
    )
    assert abs(z - counted) < 4 * math.hypot(error, its_error)
    assert error < 0.03
    assert abs(z - Z[0.5]) < 4 * error


def mixture() -> None:
    """Diameters 0.5 and 1, masses 1 and 4; at first the light discs have all the energy.

    In equilibrium each kind has the same kT, exactly: m v^2 is kT (1 - m/M) with the total mass M. The rate
    of contacts of kinds i and j is n s g sqrt(2 pi kT/mu)/A with the number of pairs n, the sum of radii s,
    the reduced mass mu and the contact value g. An approximation of g is by Santos, Yuste and López
    de Haro (Mol. Phys. 96, 1, 1999): f + (g1 - f) z, with f = 1/(1 - eta), g1 of equal discs at the same
    area fraction eta, z = (d_i d_j/s) m1/m2, and the means m1 of diameters and m2 of their squares. It gives
    Z = (1 - xi) f + xi Z1 with xi = m1^2/m2. The tolerances are 2 % of g and 1 % of Z for its error.
    """
    eta = 0.4 * math.pi / 4
    scene = kt.make_scene(
        "mixture", bodies=400, radii=(0.25, 0.5), masses=(1.0, 4.0), density=eta, periodic="xy"
    )
    light = scene.mass == 1.0
    velocity = scene.velocity * light[:, None]  # heavy discs are at rest
    velocity[light] -= velocity[light].mean(axis=0)  # total momentum 0
    scene = scene.replace(velocity=velocity, kind=np.where(light, "small", "big").tolist())
    sim = kt.Simulation(scene, keep_contacts=False)
    sim.run(20.0)
    sim.run(500.0, observe=["temperature", "rates", "pressure"])
    heat, rates = sim.observed["temperature"], sim.observed["rates"]
    kT = heat["kT"].mean
    for kind in ("small", "big"):
        found = heat[f"kT of {kind}"]
        print(f"kT of {kind}: {found.mean / kT:.4f} +- {found.error / kT:.4f}, exact 1")
        assert abs(found.mean / kT - 1) < 4 * found.error / kT < 0.04
    free, one = 1 / (1 - eta), (Z[0.4] - 1) / (2 * eta)
    kinds = {"small-small": (0.5, 0.5, 0.6, 19_900), "small-big": (0.75, 0.8, 0.8, 40_000)}
    kinds["big-big"] = (1.0, 2.0, 1.2, 19_900)  # sum of radii, reduced mass, z, number of pairs
    for name, (apart, reduced, z, pairs) in kinds.items():
        unit = pairs * apart * math.sqrt(2 * math.pi * kT / reduced) / math.prod(scene.arena or ())
        g, error, expected = rates[name].mean / unit, rates[name].error / unit, free + (one - free) * z
        print(f"g {name}: {g:.4f} +- {error:.4f}, approximation {expected:.4f}")
        assert abs(g - expected) < 4 * error + 0.02 * expected
        assert error < 0.02 * g
    xi = 0.75**2 / 0.625
    total, expected = sim.observed["pressure"]["Z"], (1 - xi) * free + xi * Z[0.4]
    print(f"Z = {total.mean:.4f} +- {total.error:.4f}, approximation {expected:.4f}")
    assert abs(total.mean - expected) < 4 * total.error + 0.01 * expected


def cooling_granular_gas() -> None:
    """Four gases of restitution e cool from equilibrium by Haff's law (J. Fluid Mech. 134, 401, 1983):
    T = T0/(1 + (1 - e^2) Gamma0 t/4)^2, as long as they are uniform."""
    e, gamma = 0.99, 4 * (Z[0.3] - 1) / math.sqrt(math.pi)
    rule = kt.Response("restitution", e=e, contact_time=1e-4 / gamma)
    times, ratios = np.linspace(2.0, 12.0, 6), []
    for seed in range(4):
        scene = fluid(1600, 0.3, seed=seed)
        before = kt.Simulation(scene, keep_contacts=False)
        before.run(10.0)  # elastic: to equilibrium
        start = before.velocities()
        cooling = scene.replace(position=before.positions(), velocity=start, responses=rule)
        gas = kt.Simulation(cooling, keep_contacts=False)
        course = []
        for t in times:
            gas.run(until=t)
            course.append((gas.velocities() ** 2).mean() / (start**2).mean())
        contacts = 2 * gas.readings.contacts_disc / 1600
        ratios.append(np.array(course) * (1 + (1 - e**2) * gamma * times / 4) ** 2)
    mean, error = np.mean(ratios, axis=0), np.std(ratios, axis=0, ddof=1) / 2
    print(f"T/T of Haff up to {contacts:.0f} contacts a disc: {mean.round(4)}, errors {error.round(4)}")
    assert contacts < 20
    assert abs(mean - 1).max() < 0.02


def lattice(w: float, small: float = 0.005) -> kt.Scene:
    """Returns two scatterers at rest and a disc between three of them and their images: a triangular lattice
    with the sum of radii 1 and the gap w between neighbours."""
    wide, high = 2 + w, (2 + w) * math.sqrt(3)
    position = [(0.0, 0.0), (wide / 2, high / 2), (wide / 2, high / 6)]
    velocity = [(0.0, 0.0), (0.0, 0.0), (0.8, 0.6)]
    radius, mass = [1 - small, 1 - small, small], [math.inf, math.inf, 1.0]
    return kt.Scene(position, velocity, radius, mass, arena=(wide, high), periodic="xy")


def lorentz_gas() -> None:
    """The mean free path in a box of free area A around scatterers of perimeter P is pi A/P, exactly
    (Santaló; Chernov, J. Stat. Phys. 88, 1, 1997).

    For narrow gaps a disc diffuses by hops (Machta and Zwanzig, Phys. Rev. Lett. 50, 1959, 1983):
    D = w (2 + w)^2/(pi (sqrt(3) (2 + w)^2 - 2 pi)). D is the slope between two late lags of msd.
    """
    for w in (0.05, 0.3):
        sim = kt.Simulation(lattice(w), keep_contacts=False)
        sim.run(max_contacts=300_000, observe=["rates"])
        rate = sim.observed["rates"]["pairs"]  # contacts a unit of time, and so of length
        exact = (math.prod(sim.scene.arena or ()) - 2 * math.pi) * math.pi / (4 * math.pi)
        path, error = 1 / rate.mean, rate.error / rate.mean**2
        print(f"gap {w}: mean free path {path:.5f} +- {error:.5f}, exact {exact:.5f}")
        assert abs(path - exact) < 4 * error
        assert error < 0.01 * exact
    w = 0.1
    sim = kt.Simulation(lattice(w), keep_contacts=False)
    sim.run(100_000.0, observe=["msd:every=20,lags=10"])
    msd = sim.observed["msd:every=20,lags=10"]["msd"]
    D, error = (msd.mean[10] - msd.mean[5]) / 400, math.hypot(msd.error[10], msd.error[5]) / 400
    hops = w * (2 + w) ** 2 / (math.pi * (math.sqrt(3) * (2 + w) ** 2 - 2 * math.pi))
    print(f"gap {w}: D = {D:.4f} +- {error:.4f}, by hops {hops:.4f}")
    assert abs(D - hops) < 4 * error
    assert error < 0.1 * hops


SYSTEMS = {
    each.__name__.replace("_", "-"): each
    for each in (equation_of_state, diffusion, pair_correlation, mixture, cooling_granular_gas, lorentz_gas)
}

if __name__ == "__main__":
    for name in sys.argv[1:] or SYSTEMS:
        print(f"{name}:")
        SYSTEMS[name]()
