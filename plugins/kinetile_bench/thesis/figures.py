"""Figures 23 and 24 of the thesis, from the cells of a run: CPU time over discs, and shares of events; and a
third, structural events a contact over discs, which are the same on every machine."""

import statistics
from operator import truediv
from pathlib import Path
from typing import Any

import numpy as np

from kinetile_accuracy.drawing import LOOKS, curve, house_style, legend_below, new_figure, save_figure
from kinetile_bench.thesis import ThesisBench, ThesisScene

_KINDS = (
    ("structural_events", "bound events", "#56B4E9", ""),
    ("contacts_wall", "wall events", "#F0E442", "...."),
    ("contacts_disc", "collision events", "#D55E00", "////"),
)


def draw(bench: ThesisBench, folder: Path) -> list[Path]:
    """Draws the figures as SVG and PNG; returns their paths. Raises MissingExtra without matplotlib."""
    groups, written = bench.by_density(), []
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    with house_style():
        drawn = {"figure-23": _draw_times, "figure-24": _draw_shares, "events-a-contact": _draw_events}
        for name, draw_panel in drawn.items():
            figure, panels = new_figure(columns, 0.8 + 2.4 * rows, rows=rows, sharey=True)
            for panel, (density, scenes) in zip(np.ravel(panels), groups.items(), strict=False):
                panel.set(title=f"density {density:g}")
                panel.grid(True, axis="y")
                draw_panel(panel, bench, scenes)
            legend_below(figure, 4)
            written += save_figure(figure, folder / name)
    return written


def _draw_times(panel: Any, bench: ThesisBench, scenes: list[ThesisScene]) -> None:
    sizes = _over_discs(panel, scenes, "CPU s a unit of time")
    for k, phase in enumerate(bench.phases):
        costs = [[cell.cost for cell in bench.of(scene, phase).values()] for scene in scenes]
        curve(panel, sizes, list(map(statistics.median, costs)), k % len(LOOKS), label=phase)
        panel.vlines(sizes, list(map(min, costs)), list(map(max, costs)), color="0.4")


def _over_discs(panel: Any, scenes: list[ThesisScene], label: str) -> list[int]:
    """Lays out a panel over the number of discs; returns these numbers."""
    sizes = [scene.bodies for scene in scenes]
    panel.set(xscale="log", yscale="log", xlabel="discs", ylabel=label)
    panel.set_xticks(sizes, list(map(str, sizes)))
    panel.set_xticks([], minor=True)
    return sizes


def _draw_events(panel: Any, bench: ThesisBench, scenes: list[ThesisScene]) -> None:
    sizes = _over_discs(panel, scenes, "structural events a contact")
    for k, phase in enumerate(bench.phases):
        events = [bench.mean(scene, phase, "structural_events") for scene in scenes]
        contacts = [max(bench.mean(scene, phase, "contacts_disc"), 1.0) for scene in scenes]
        if any(events):  # naive has no structural events
            curve(panel, sizes, list(map(truediv, events, contacts)), k % len(LOOKS), label=phase)


def _draw_shares(panel: Any, bench: ThesisBench, scenes: list[ThesisScene]) -> None:
    bars = [(scene, phase) for scene in scenes for phase in bench.phases]
    bottom = [0.0] * len(bars)
    for kind, label, colour, hatch in _KINDS:
        share = [100.0 * bench.mean(*bar, kind) / max(bench.mean(*bar, "events"), 1.0) for bar in bars]
        look = {"color": colour, "hatch": hatch, "edgecolor": "0.2", "linewidth": 0.5}
        panel.bar(range(len(bars)), share, 0.85, bottom=bottom, label=label, **look)
        bottom = [a + b for a, b in zip(bottom, share, strict=True)]
    panel.set_xticks(range(len(bars)), [f"{phase} {scene.bodies}" for scene, phase in bars], rotation=90)
    panel.set(ylabel="share of all events (%)", ylim=(0.0, 100.0))
