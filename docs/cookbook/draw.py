"""Draws the pictures of the cookbook: ``python docs/cookbook/draw.py [PAGE ...]``, by default all of them.

Units: the diameter of a disc (of the larger in a mixture), its mass (of the smaller), and kT; in the Lorentz
gas the radius of a scatterer and the speed; among obstacles the speed and half the height of the room. Error
bars are standard errors, if blocks give one (``error`` is not NaN); numbers are printed as well.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

import kinetile as kt
from kinetile.show.picture import take_picture

COLOURS, MARKERS, DASHES = ["#0072B2", "#D55E00", "#009E73"], "os^", ("-", "--", ":")
"""For the first, second and third series of a panel."""

Z = {0.2: 1.411834, 0.3: 1.723373, 0.4: 2.151444, 0.5: 2.760124, 0.6: 3.663698, 0.7: 5.082369, 0.8: 7.476513}
"""P/(rho kT) by the reduced density rho: Kolafa and Rottner (2006)."""


def fluid(bodies, density, **more):
    """Returns discs on a torus at a reduced density, of diameter 1 by default, after 100 contacts of each."""
    made = {"bodies": bodies, "density": density * math.pi / 4, "radii": (0.5,), "periodic": "xy"} | more
    sim = kt.Simulation(kt.make_scene("mixture", **made), keep_contacts=False)
    sim.run(max_contacts=50 * bodies)
    return sim


def again(sim, **changes):
    """Returns a simulation that begins at the state of another, with changes of the scene."""
    now = {"position": sim.positions(), "velocity": sim.velocities()} | changes
    return kt.Simulation(sim.scene.replace(**now), keep_contacts=False)


def panels(*names):
    """Returns a figure with a panel for each two titles of axes, and the panels."""
    figure = Figure((7.6, 3.1), dpi=100, layout="constrained", facecolor="white")
    axes = figure.subplots(1, len(names) // 2, squeeze=False)[0]
    for k, each in enumerate(axes):
        each.set(xlabel=names[2 * k], ylabel=names[2 * k + 1])
    return figure, *axes


def dots(axes, x, estimates, label, color=None):
    """Draws pairs of a mean and an error, and prints them."""
    mean, error = np.transpose([each[:2] for each in estimates])
    marker = MARKERS[len(axes.containers)]
    axes.errorbar(list(x), mean, error, fmt=marker, ms=3, lw=1, capsize=2, label=label, color=color)
    print(label, *(f"({at:.4g}: {m:.6g} +- {e:.2g})" for at, m, e in zip(x, mean, error, strict=True)))


def equation_of_state():
    """Draws deviations from the fluid's equation of state, and the pressure of 72 discs."""
    names = ("density", "1000 (Z / Z of Kolafa, Rottner - 1)", "packing fraction", "P s² / kT")
    figure, left, right = panels(*names)
    left.axhline(0, color="black", lw=0.8)
    for bodies in (64, 256, 1600):
        found = []
        for density, expected in Z.items():
            sim = fluid(bodies, density)
            sim.run(max_contacts=8_000_000, observe=["pressure"])
            z = sim.observed["pressure"]["Z"]
            found.append((1000 * (z.mean / expected - 1), 1000 * z.error / expected))
        dots(left, Z, found, f"{bodies} discs")
    table = {0.65: 6.901074, 0.66: 7.383221, 0.67: 7.85637, 0.68: 8.23631, 0.69: 8.41814, 0.70: 8.55170}
    found = []
    for packing in table:
        sim = fluid(72, packing * 4 / math.pi)
        sim.run(max_contacts=40_000_000, observe=["pressure"])
        found.append([packing * 4 / math.pi * each for each in sim.observed["pressure"]["Z"][:2]])
    right.plot(list(table), list(table.values()), "k_-", ms=14, lw=0.6, label="Li et al., 2022")
    dots(right, table, found, "72 discs", "C1")
    return figure


def diffusion():
    """Draws the mean squared displacement and the velocity autocorrelation."""
    figure, left, right = panels("t", "msd / 4t", "t", "C(t) / C(0)")
    sim = fluid(10_000, 0.5)
    sim.run(sim.time + 500.0, observe=["msd:every=0.1,lags=200", "vacf:every=0.1,lags=200"])
    msd, c = (curve for found in sim.observed.values() for curve in found.values())
    t = c.at[1:]
    dots(left, t, np.transpose([msd.mean[1:], msd.error[1:]]) / (4 * t[:, None]), "10,000 discs")
    dots(right, t, np.transpose([c.mean[1:], c.error[1:]]) / c.mean[0], "10,000 discs")
    gamma, chi, b = 4 * (Z[0.5] - 1) / math.sqrt(math.pi), (Z[0.5] - 1) / (math.pi / 4), math.pi / 4
    viscosity = 1.022 / (2 * math.sqrt(math.pi)) * (1 / chi + b + 0.8729 * chi * b**2)  # Enskog's
    tail = 1 / (8 * math.pi * (viscosity + 0.5 / gamma))
    left.plot(t, (1 - (1 - np.exp(-gamma * t)) / (gamma * t)) / gamma, "k--", lw=1, label="Enskog")
    right.plot(t, np.exp(-gamma * t), "k--", lw=1, label="Enskog: exp(-Gamma t)")
    right.plot(t[9:], tail / t[9:], "r-", lw=1, zorder=5, label=f"tail: {tail:.3f} / t")
    left.set(xscale="log")
    right.set(xscale="log", yscale="log", ylim=(1e-3, 1.2))
    return figure


def pair_correlation():
    """Draws g(r) at three reduced densities; at r = 1, dots are its extrapolation, lines the value from Z."""
    figure, axes = panels("r", "g(r)")
    for k, density in enumerate((0.3, 0.5, 0.7)):
        sim, contact = fluid(1600, density), []
        for _ in range(32):
            sim.run(math.floor(sim.time) + 100.0 * (1 - density), observe=["g:bins=400,to=4"])
            g = sim.observed["g:bins=400,to=4"]["g"]
            near = (g.at > 1) & (g.at < 1.3)
            contact.append(np.polynomial.Polynomial.fit(g.at[near], g.mean[near], 3)(1.0))
        axes.plot(g.at, g.mean, DASHES[k], color=f"C{k}", lw=1)
        found = [(np.mean(contact), np.std(contact, ddof=1) / math.sqrt(32))]
        dots(axes, [1.0], found, f"density {density}", f"C{k}")
        axes.plot([0.8, 1.0], [(Z[density] - 1) / (math.pi / 2 * density)] * 2, "k-", lw=0.8)
    axes.set(xlim=(0.8, 4))
    return figure


def mixture():
    """Draws contact values of two sizes from contact rates, over the values of Santos et al. (1999)."""
    figure, left, right = panels("packing fraction", "g at contact", "packing fraction", "g / approximation")
    density, Z1 = np.transpose(list(Z.items())[:-1])  # 0.8 is too dense for the recipe
    packing, kinds = density * math.pi / 4, ["small"] * 800 + ["big"] * 800
    one, free, found = (Z1 - 1) / (2 * packing), 1 / (1 - packing), []
    for eta in packing:
        sim = again(fluid(1600, eta * 4 / math.pi, radii=(0.25, 0.5), masses=(1.0, 4.0)), kind=kinds)
        sim.run(max_contacts=3_000_000, observe=["rates", "temperature"])
        unit = math.sqrt(2 * math.pi * sim.observed["temperature"]["kT"].mean) / math.prod(sim.scene.arena)
        found.append((sim.observed["rates"], unit))
    pairs = {
        "small-small": (0.5, 0.5, 319_600),
        "small-big": (0.75, 0.8, 640_000),
        "big-big": (1, 2, 319_600),
    }
    for (name, (apart, mass, number)), z in zip(pairs.items(), (0.6, 0.8, 1.2), strict=True):
        g = np.array([np.array(each[name][:2]) / unit for each, unit in found]) * math.sqrt(mass)
        expected = free + (one - free) * z  # z = s_i s_j <s> / (s_ij <s^2>)
        dots(left, packing, g / (apart * number), name)
        left.plot(packing, expected, "k-", lw=0.6)
        dots(right, packing, g / (apart * number * expected[:, None]), name)
    return figure


def cooling_granular_gas():
    """Draws temperature over time; lines are Haff's law."""
    figure, left, right = panels("Gamma0 t", "T / T0", "contacts of a disc", "T / T of Haff")
    gamma, times = 4 * (Z[0.3] - 1) / math.sqrt(math.pi), np.geomspace(1, 2000, 40)
    start = fluid(10_000, 0.3)
    for e, marker, dashes in zip((0.99, 0.95, 0.9), MARKERS, DASHES, strict=True):
        rule, heat, contacts = kt.Response("restitution", e=e, contact_time=1e-4 / gamma), [], []
        sim = again(start, responses=rule)
        for t in times / gamma:
            sim.run(until=t)
            heat.append((sim.velocities() ** 2).mean() / (start.velocities() ** 2).mean())
            contacts.append(2 * sim.readings.contacts_disc / 10_000)
        haff = 1 / (1 + (1 - e**2) * times / 4) ** 2
        left.loglog(times, heat, marker, ms=3, label=f"e = {e}")
        left.loglog(times, haff, "k-", lw=0.6)
        right.semilogx(contacts, heat / haff, marker + dashes, ms=3, lw=0.6, label=f"e = {e}")
        print(e, *(f"({c:.3g}: {r:.4f})" for c, r in zip(contacts, heat / haff, strict=True)))
    right.set(ylim=(0.9, 2))
    return figure


def lorentz_gas():
    """Draws mean free path and diffusion of a disc among scatterers of a triangular lattice."""
    figure, left, right = panels("gap", "1000 (path / exact - 1)", "gap", "D")
    gaps, paths, spreads = np.array([0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3]), [], []
    for w in gaps:
        wide, high = 2 + w, (2 + w) * math.sqrt(3)
        places, speeds = [(0, 0), (wide / 2, high / 2), (wide / 2, high / 6)], [(0, 0), (0, 0), (0.8, 0.6)]
        radii, masses = [0.995, 0.995, 0.005], [math.inf, math.inf, 1.0]
        scene = kt.Scene(places, speeds, radii, masses, (wide, high), periodic="xy")
        sim = kt.Simulation(scene, keep_contacts=False)
        sim.run(max_contacts=5_000_000, observe=["rates", "msd:every=20,lags=10"])
        rate, msd = sim.observed["rates"]["pairs"], sim.observed["msd:every=20,lags=10"]["msd"]
        exact = (wide * high - 2 * math.pi) / 4  # pi area / perimeter
        paths.append((1000 * (1 / (rate.mean * exact) - 1), 1000 * rate.error / rate.mean))
        spreads.append(((msd.mean[10] - msd.mean[5]) / 400, math.hypot(msd.error[5], msd.error[10]) / 400))
    left.axhline(0, color="black", lw=0.8)
    dots(left, gaps, paths, "measured")
    dots(right, gaps, spreads, "measured")
    hops = gaps * (2 + gaps) ** 2 / (math.pi * (math.sqrt(3) * (2 + gaps) ** 2 - 2 * math.pi))
    right.plot(gaps, hops, "k--", lw=1, label="Machta, Zwanzig, 1983")
    return figure


def obstacles():
    """Draws a path around a box, and the rate of a disc's contacts with boxes of five widths."""
    figure, left, right = panels("x", "y", "width of the box", "1000 (rate / exact - 1)")
    widths, found = (0.25, 0.5, 1.0, 1.5, 2.0), []
    for w in widths:
        scene = kt.Scene(
            [(1.5, 1.0), (0.4, 0.3)],
            [(0.0, 0.0), (math.cos(0.7), math.sin(0.7))],
            mass=[math.inf, 1.0],
            shape=[0, 1],
            shapes=[kt.box(w, 0.6), kt.disc(0.1)],
            arena=(3.0, 2.0),
        )
        sim, path = kt.Simulation(scene, keep_contacts=False), []
        while w == 1.0 and len(path) < 200:
            path.append(sim.positions()[1])
            sim.run(max_contacts=1)
        if path:
            left.fill([1.0, 2.0, 2.0, 1.0], [0.7, 0.7, 1.3, 1.3], color="0.75")
            left.plot(*np.transpose(path), lw=0.4, label="the middle of the disc, 200 contacts")
        sim.run(max_contacts=10_000_000, observe=["rates"])
        rate = sim.observed["rates"]["pairs"]
        free = 2.8 * 1.8 - (0.6 * w + 0.2 * (w + 0.6) + 0.01 * math.pi)
        exact = (2 * (w + 0.6) + 0.2 * math.pi) / (math.pi * free)
        found.append((1000 * (rate.mean / exact - 1), 1000 * rate.error / exact))
    left.set(xlim=(0, 3), ylim=(0, 2), aspect="equal")
    right.axhline(0, color="black", lw=0.8)
    dots(right, widths, found, "measured")
    return figure


def rooms():
    """Draws the scenes of the cookbook at a time, each with the paths of some discs until then."""
    figure = Figure((7.6, 5.4), dpi=100, layout="constrained", facecolor="white")
    shown = {"sinai": (40, [1]), "stadium": (60, [66]), "maze": (40, [38, 77, 117])}
    shown["brick-breaker"] = (30, [0])
    for axes, (name, (until, discs)) in zip(figure.subplots(2, 2).flat, shown.items(), strict=True):
        scene = kt.load_scene(Path(__file__).parents[1] / "scenes" / f"{name}.toml")
        sim, path = kt.Simulation(scene, "cells"), [scene.position[discs]]
        while sim.run(until=until, stop_at=kt.StopAt(bodies=discs)):
            path.append(sim.positions()[np.searchsorted(sim.bodies, discs)])
        path.append(sim.positions()[np.searchsorted(sim.bodies, discs)])
        for k, line in enumerate(np.swapaxes(path, 0, 1)):
            axes.plot(*line.T, DASHES[k], lw=0.5, color=f"C{k}")
        picture = take_picture(sim, structure=False)
        for body in picture.discs:
            fixed = scene.mass[body.number] == math.inf
            look = {"fc": "0.75" if fixed else "white", "ec": "black", "lw": 0.8, "zorder": 3}
            axes.add_patch(
                Polygon(body.outline, **look) if body.outline else Circle(body.at, body.radius, **look)
            )
        (left, low), (right, high) = picture.low, picture.high
        edge = 0.01 * (right - left)
        axes.set(xlim=(left - edge, right + edge), ylim=(low - edge, high + edge), aspect="equal")
        axes.set(title=f"{name}, {until} units of time", xticks=[], yticks=[])
        axes.spines[:].set_visible(picture.arena)
    return figure


PICTURES = [
    equation_of_state,
    diffusion,
    pair_correlation,
    mixture,
    cooling_granular_gas,
    lorentz_gas,
    obstacles,
    rooms,
]

if __name__ == "__main__":
    matplotlib.rcParams["axes.prop_cycle"] = matplotlib.cycler(color=COLOURS)
    for picture in PICTURES:
        name = picture.__name__.replace("_", "-")
        if name in (sys.argv[1:] or [name]):
            began, figure = time.process_time(), picture()
            for axes in figure.axes:
                if axes.get_legend_handles_labels()[0]:
                    axes.legend(fontsize=8)
            figure.savefig(Path(__file__).with_name(f"{name}.png"))
            print(f"{name}: {time.process_time() - began:.0f} s of CPU time", flush=True)
