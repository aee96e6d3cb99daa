"""The thesis's figures 23 and 24 from the cells of a run, and the cells as a table for other programs.

Both figures have a panel for each density, as in the thesis, on one sheet that fits a page: figure 23 the CPU
time, double logarithmic, with the extremes over the seeds; figure 24 the shares of bound, wall and collision
events, with the standard error of the bound events' share. Colours are told apart by the colour-blind, and in
grey by markers and hatches.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from kinetile.accuracy.drawing import house_style, new_figure, save_figure
from kinetile.bench.measures import mean, spread
from kinetile.bench.thesis import Cell, ThesisBench

__all__ = ["KINDS", "OTHER_LOOKS", "PHASE_LOOKS", "SHORT", "draw_figures", "write_cells"]

PHASE_LOOKS = {
    "naive": ("#000000", "s", "--"),
    "sap-1d": ("#D55E00", "^", "-"),
    "sap-2d": ("#E69F00", "v", ":"),
    "sweep-tiling": ("#0072B2", "o", "-"),
}
OTHER_LOOKS = (("#009E73", "D", "-."), ("#CC79A7", "P", "-."), ("#56B4E9", "X", "-."))
KINDS = (
    ("bound_events", "bound events", "#56B4E9", ""),
    ("contacts_wall", "wall events", "#F0E442", "...."),
    ("contacts_disc", "collision events", "#D55E00", "////"),
)
SHORT = {"sweep-tiling": "tiling"}


def write_cells(bench: ThesisBench, folder: Path) -> Path:
    """Write all cells to cells.csv, a row for each phase, scene and seed; return its path."""
    path = folder / "cells.csv"
    names = [name for name in vars(bench.cells[0]) if name != "cpu_seconds"]
    timed = ["rounds", "cpu_seconds_median", "cpu_seconds_min", "cpu_seconds_max"]
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow([*names, *timed, "cpu_seconds_per_time", "unrest"])
        for cell in bench.cells:
            times = [len(cell.cpu_seconds), *spread(cell.cpu_seconds), cell.cost, cell.unrest]
            table.writerow([*(getattr(cell, name) for name in names), *times])
    return path


def draw_figures(bench: ThesisBench, folder: Path) -> list[Path]:
    """Draw figures 23 and 24, each as SVG and PNG; return their paths.

    Raises MissingExtra without matplotlib.
    """
    written = []
    rows = (len(bench.densities) + 1) // 2
    with house_style():
        for name, draw in (("figure-23", _draw_times), ("figure-24", _draw_shares)):
            figure, panels = new_figure(2, 0.6 + 2.4 * rows, rows=rows, sharey=True)
            draw(bench, figure, panels)
            written += save_figure(figure, folder / name)
    return written


def _draw_times(bench: ThesisBench, figure: Any, panels: Any) -> None:
    others = iter(OTHER_LOOKS * len(bench.phases))
    looks = {phase: PHASE_LOOKS.get(phase) or next(others) for phase in bench.phases}
    for panel, density in _used(panels, bench):
        panel.set(xscale="log", yscale="log", title=f"density {density:g}")
        for phase, (colour, marker, line) in looks.items():
            found = {n: spread(_costs(bench, density, n, phase)) for n in _sizes(bench, density, phase)}
            middle = [each.median for each in found.values()]
            below = [each.median - each.low for each in found.values()]
            above = [each.high - each.median for each in found.values()]
            panel.errorbar(
                list(found),
                middle,
                yerr=[below, above],
                label=phase,
                color=colour,
                marker=marker,
                linestyle=line,
                markersize=4,
                linewidth=1.2,
                capsize=2,
            )
        panel.set_xticks(bench.bodies, [str(n) for n in bench.bodies])
        panel.minorticks_off()
        panel.grid(True, which="major", axis="y")
    figure.supxlabel(f"number of discs (points: median over {_seeds(bench)}; bars: the extremes)", fontsize=8)
    figure.supylabel("CPU seconds for one unit of simulated time", fontsize=8)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))


def _draw_shares(bench: ThesisBench, figure: Any, panels: Any) -> None:
    wide = len(bench.phases) + 1.0
    for panel, density in _used(panels, bench):
        panel.set(title=f"density {density:g}", ylim=(0.0, 100.0))
        places, names = [], []
        for group, n in enumerate(bench.bodies):
            for k, phase in enumerate(bench.phases):
                cells = bench.of(density, n, phase)
                if cells:
                    _draw_bar(panel, group * wide + k, cells)
                    places.append(group * wide + k)
                    names.append(SHORT.get(phase, phase))
            middle = group * wide + (len(bench.phases) - 1) / 2
            panel.text(middle, -0.3, f"n = {n}", transform=panel.get_xaxis_transform(), ha="center", va="top")
        panel.set_xticks(places, names, rotation=90)
        panel.tick_params(axis="x", length=0)
        panel.grid(True, axis="y")
    figure.supylabel("share of all events (%)", fontsize=8)
    figure.supxlabel(f"means over {_seeds(bench)}; error bars: standard error of bound events", fontsize=8)
    handles, labels = panels[0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="outside upper center", ncols=len(unique))


def _draw_bar(panel: Any, place: float, cells: tuple[Cell, ...]) -> None:
    bottom = 0.0
    for kind, label, colour, hatch in KINDS:
        share = mean([100.0 * getattr(cell, kind) / max(cell.events, 1) for cell in cells])
        panel.bar(
            place,
            share.mean,
            0.85,
            bottom=bottom,
            color=colour,
            hatch=hatch,
            edgecolor="black",
            linewidth=0.4,
            label=label,
        )
        bottom += share.mean
        if kind == "bound_events" and share.mean > 0.0 and share.error:
            panel.errorbar(
                place, share.mean, yerr=share.error, color="black", capsize=1.5, linewidth=0.8, capthick=0.8
            )


def _used(panels: Any, bench: ThesisBench) -> list[tuple[Any, float]]:
    """Return each panel with its density; a panel that is left over is taken away."""
    for panel in panels[len(bench.densities) :]:
        panel.remove()
    return list(zip(panels, bench.densities, strict=False))


def _seeds(bench: ThesisBench) -> str:
    count = len({cell.seed for cell in bench.cells})
    return f"{count} seed{'s' if count != 1 else ''}"


def _sizes(bench: ThesisBench, density: float, phase: str) -> list[int]:
    return [n for n in bench.bodies if bench.of(density, n, phase)]


def _costs(bench: ThesisBench, density: float, bodies: int, phase: str) -> list[float]:
    return [cell.cost for cell in bench.of(density, bodies, phase)]
