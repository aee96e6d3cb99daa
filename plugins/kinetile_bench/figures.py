"""Figures of a study: a quantity over a parameter, or shares of events; a panel for each scene.

Colours are distinct for the colour-blind, and markers and hatches are in grey.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption
from kinetile_accuracy.drawing import house_style, new_figure, save_figure
from kinetile_bench.plan import FigureTable, StudyPlan
from kinetile_bench.results import Quantity, choose_axis, take_rows

_LOOKS = {
    "naive": ("#000000", "s", "--"),
    "sap-1d": ("#D55E00", "^", "-"),
    "sap-2d": ("#E69F00", "v", ":"),
    "sweep-tiling": ("#0072B2", "o", "-"),
}
_OTHER_LOOKS = (("#009E73", "D", "-."), ("#CC79A7", "P", "-."), ("#56B4E9", "X", "-."))
_KINDS = (
    ("structural_events", "bound events", "#56B4E9", ""),
    ("contacts_wall", "wall events", "#F0E442", "...."),
    ("contacts_disc", "collision events", "#D55E00", "////"),
)
_SHORT = {"sweep-tiling": "tiling"}

_HEADS = {"cpu_seconds_per_time": "CPU seconds for one unit of simulated time", "cpu_seconds": "CPU seconds"}


def draw(plan: StudyPlan, table: Any, folder: Path) -> list[Path]:
    """Draws the figures of a study, or if it names none, one of CPU time; returns their paths.

    ``table`` is the rows. Raises MissingExtra without matplotlib, BadOption for what cannot be drawn of them.
    """
    written = []
    with house_style():
        folder.mkdir(parents=True, exist_ok=True)
        for wanted in plan.file.figures or (FigureTable(name="figure", y=""),):
            names = [kind for kind, *_ in _KINDS] if wanted.kind == "shares" else [wanted.y]
            quantities = [take_rows(plan, table, name or None) for name in names]
            x = choose_axis(quantities[0], wanted.x)
            if x is None:
                raise BadOption(f"figure {wanted.name!r}: no parameter has several numbers to be drawn over")
            panels = _panels(quantities[0], x)
            columns = min(len(panels), 2)
            lines = -(-len(panels) // columns)
            figure, axes = new_figure(columns, 0.8 + 2.4 * lines, rows=lines, sharey=True)
            each = _Figure(wanted, quantities, x, panels, figure, [axes] if len(panels) == 1 else list(axes))
            for unused in each.axes[len(panels) :]:
                unused.set_visible(False)
            if wanted.title:
                figure.suptitle(wanted.title)
            each.draw_lines() if wanted.kind == "lines" else each.draw_shares()
            written += save_figure(figure, folder / wanted.name)
    return written


def _panels(rows: Quantity, x: str) -> list[tuple[str, dict[str, Any]]]:
    """Returns the panels: their titles, and the parameters that have one value in each."""
    found = {}
    for scene in rows.scenes:
        fixed = {name: value for name, value in zip(rows.parameters, scene, strict=True) if name != x}
        found[", ".join(f"{name} {_text(value)}" for name, value in fixed.items())] = fixed
    return list(found.items())


@dataclass(frozen=True)
class _Figure:
    wanted: FigureTable
    quantities: list[Quantity]
    x: str
    panels: list[tuple[str, dict[str, Any]]]
    figure: Any
    axes: list[Any]

    @property
    def rows(self) -> Quantity:
        return self.quantities[0]

    def draw_lines(self) -> None:
        """Draws a quantity over a parameter: medians over seeds, with the extremes."""
        others = iter(_OTHER_LOOKS * len(self.rows.phases))
        looks = {phase: _LOOKS.get(phase) or next(others) for phase in self.rows.phases}
        scale = "log" if self.wanted.logarithmic else "linear"
        for axes, (title, fixed) in zip(self.axes, self.panels, strict=False):
            axes.set(xscale=scale, yscale=scale, title=title)
            ticks: set[float] = set()
            for phase, (colour, marker, line) in looks.items():
                found = dict(self._of(self.rows, fixed, phase))
                if not found:
                    continue
                ticks |= found.keys()
                middle = [statistics.median(values) for values in found.values()]
                bars = [
                    [m - min(values) for m, values in zip(middle, found.values(), strict=True)],
                    [max(values) - m for m, values in zip(middle, found.values(), strict=True)],
                ]
                look = {"color": colour, "marker": marker, "linestyle": line, "markersize": 4}
                axes.errorbar(list(found), middle, bars, label=phase, linewidth=1.2, capsize=2, **look)
            if len(ticks) <= 8:
                axes.set_xticks(sorted(ticks), [_text(each) for each in sorted(ticks)])
                axes.set_xticks([], minor=True)
            axes.grid(True, which="major", axis="y")
        self.figure.supxlabel(f"{self.x} (points: median over seeds; bars: the extremes)", fontsize=8)
        self.figure.supylabel(_HEADS.get(self.rows.y, self.rows.y), fontsize=8)
        self._legend()

    def draw_shares(self) -> None:
        """Draws the shares of bound, wall and collision events as bars, one for each phase and x."""
        wide = len(self.rows.phases) + 1.0
        for axes, (title, fixed) in zip(self.axes, self.panels, strict=False):
            axes.set(title=title, ylim=(0.0, 100.0))
            places, names = [], []
            every = sorted({x for phase in self.rows.phases for x, _ in self._of(self.rows, fixed, phase)})
            for group, x in enumerate(every):
                for k, phase in enumerate(self.rows.phases):
                    counts = [dict(self._of(each, fixed, phase)).get(x) for each in self.quantities]
                    if all(counts):
                        self._bar(axes, group * wide + k, [each or [] for each in counts])
                        places.append(group * wide + k)
                        names.append(_SHORT.get(phase, phase))
                middle = group * wide + (len(self.rows.phases) - 1) / 2
                where = axes.get_xaxis_transform()
                axes.text(middle, -0.3, f"{self.x} {_text(x)}", transform=where, ha="center", va="top")
            axes.set_xticks(places, names, rotation=90)
            axes.tick_params(axis="x", length=0)
            axes.grid(True, axis="y")
        self.figure.supylabel("share of all events (%)", fontsize=8)
        self.figure.supxlabel("means over seeds; error bars: standard error of bound events", fontsize=8)
        self._legend()

    def _bar(self, axes: Any, place: float, counts: list[list[float]]) -> None:
        bottom = 0.0
        totals = [sum(each) or 1.0 for each in zip(*counts, strict=True)]
        for (_, label, colour, hatch), values in zip(_KINDS, counts, strict=True):
            shares = [100.0 * a / b for a, b in zip(values, totals, strict=True)]
            share = statistics.fmean(shares)
            look = {"color": colour, "hatch": hatch, "edgecolor": "0.2", "linewidth": 0.5}
            axes.bar(place, share, 0.85, bottom=bottom, label=label, **look)
            bottom += share
            if values is counts[0] and len(shares) > 1 and share > 0.0:
                error = statistics.stdev(shares) / math.sqrt(len(shares))
                axes.errorbar(
                    place, share, yerr=error, color="black", capsize=1.5, linewidth=0.8, capthick=0.8
                )

    def _of(self, rows: Quantity, fixed: dict[str, Any], phase: str) -> Iterator[tuple[float, list[float]]]:
        """Yields x, in ascending order, with the values of the seeds there."""
        found = {}
        for (scene, of), values in rows.values.items():
            named = dict(zip(rows.parameters, scene, strict=True))
            if of == phase and values and all(named[name] == value for name, value in fixed.items()):
                found[named[self.x]] = [values[seed] for seed in sorted(values)]
        yield from sorted(found.items())

    def _legend(self) -> None:
        unique: dict[str, Any] = {}
        for axes in self.axes:
            handles, labels = axes.get_legend_handles_labels()
            unique |= dict(zip(labels, handles, strict=True))
        self.figure.legend(
            unique.values(), unique.keys(), loc="outside upper center", ncols=min(len(unique), 5)
        )


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
