"""What the rows come to: for each scene and phase a mean, for each phase a ratio, exponents, crossovers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

from kinetile.errors import BadOption, one_of
from kinetile_bench.choices import phase_label
from kinetile_bench.study.file.schema import AXES
from kinetile_bench.study.results.fits import Estimate, crossover, exponent, mean_of, ratio_of
from kinetile_bench.study.store.columns import FIXED, parameter_column

if TYPE_CHECKING:
    from kinetile_bench.study.study import Study

__all__ = ["Rows", "table", "take_rows"]

Scene = tuple[Any, ...]
"""The values of the varied parameters, in their order."""


@dataclass(frozen=True)
class Rows:
    """A quantity of a study's rows, by scene, phase and seed.

    Attributes:
        y: the column.
        parameters: the columns that vary, the seed apart.
        phases: the phases, in the order of the study.
        values: of each scene and phase, the values by their seeds; of repeats the mean.
        contacts: of each scene and phase, the contacts of all rows.
        odd: of each scene and phase, the statuses of the rows that are not done.
    """

    y: str
    parameters: tuple[str, ...]
    phases: tuple[str, ...]
    values: Mapping[tuple[Scene, str], Mapping[int, float]]
    contacts: Mapping[tuple[Scene, str], Sequence[int]]
    odd: Mapping[tuple[Scene, str], Sequence[str]]

    @property
    def scenes(self) -> list[Scene]:
        """All scenes, in the order of the study."""
        return list(dict.fromkeys(scene for scene, _ in self.values))

    def over(self, x: str) -> dict[tuple[Scene, str], dict[int, dict[float, float]]]:
        """Return, for each choice of the other parameters and phase, x and y of each seed."""
        at = self.parameters.index(x)
        found: dict[tuple[Scene, str], dict[int, dict[float, float]]] = {}
        for (scene, phase), values in self.values.items():
            rest = scene[:at] + scene[at + 1 :]
            points = found.setdefault((rest, phase), {})
            for seed, y in values.items():
                points.setdefault(seed, {})[float(scene[at])] = y
        return found

    def numeric(self) -> list[str]:
        """Return the parameters that vary and are numbers."""
        values = {name: [scene[k] for scene in self.scenes] for k, name in enumerate(self.parameters)}
        return [
            name
            for name, found in values.items()
            if len(set(found)) > 1
            and all(isinstance(each, int | float) and not isinstance(each, bool) for each in found)
        ]


def take_rows(study: Study, y: str | None, rows: Any = None) -> Rows:
    """Return a quantity of the rows of a study. Raises BadOption for a column that is no number."""
    rows = study.rows() if rows is None else rows
    y = y or (
        "cpu_seconds_per_time" if any(s.until is not None for s in study.plan.scenes) else "cpu_seconds"
    )
    numbers = [f.name for f in rows.schema if str(f.type) in ("int64", "double", "bool")]
    if y not in numbers:
        raise BadOption(f"no column {y!r} of numbers: expected {one_of(y, numbers)}")
    parameters = _varied(study, rows.column_names)
    phases = tuple(phase_label(*each) for each in study.plan.phases)
    names = [
        *parameters,
        "phase",
        "status",
        "contacts",
        y,
        *(["seed"] if "seed" in rows.column_names else []),
    ]
    columns = [rows[name].to_pylist() for name in names]
    seeds = columns[-1] if len(columns) == len(parameters) + 5 else [None] * rows.num_rows
    found: dict[tuple[Scene, str], dict[int, list[float]]] = defaultdict(dict)
    contacts: dict[tuple[Scene, str], list[int]] = defaultdict(list)
    odd: dict[tuple[Scene, str], list[str]] = defaultdict(list)
    width = len(parameters)
    for seed, *row in zip(seeds, *columns[: width + 4], strict=True):
        group = tuple(row[:width]), row[width]
        by_seed = found[group]
        if row[width + 1] != "done":
            odd[group].append(row[width + 1])
        elif row[width + 3] is not None:
            by_seed.setdefault(seed or 0, []).append(float(row[width + 3]))
            contacts[group].append(row[width + 2])
    values = {
        group: {seed: sum(each) / len(each) for seed, each in by_seed.items()}
        for group, by_seed in found.items()
    }
    return Rows(y, parameters, phases, values, contacts, odd)


def table(study: Study, y: str | None, x: str | None) -> dict[str, Any]:
    """Return everything that the rows of a study come to, in plain types. Raises BadOption."""
    rows = take_rows(study, y)
    axis = choose_axis(rows, x)
    return {
        "results": str(study.results),
        "y": rows.y,
        "x": axis,
        "base": rows.phases[0],
        "parameters": list(rows.parameters),
        "groups": list(_groups(rows)),
        "exponents": list(_exponents(rows, axis)) if axis is not None else [],
        "crossovers": [
            {"over": name, "found": found}
            for name in rows.numeric()
            if (found := list(_crossovers(rows, name)))
        ],
    }


def choose_axis(rows: Rows, x: str | None) -> str | None:
    """Return the parameter over which something is looked at: ``x``, or the likeliest; None for none."""
    numeric = rows.numeric()
    if x is None:
        return next((name for name in (*AXES, *numeric) if name in numeric), None)
    if x not in numeric:
        raise BadOption(f"{x!r} is no parameter with several numbers: expected {one_of(x, numeric)}")
    return x


def _varied(study: Study, columns: Sequence[str]) -> tuple[str, ...]:
    names = ["recipe"] if len({each.recipe for each in study.plan.scenes}) > 1 else []
    several = len(study.plan.scenes) > 1
    for scenes in study.plan.scenes:
        names += [name for name in (scenes.combinations[0] if several else scenes.varied) if name != "seed"]
    found = [name if name == "recipe" else parameter_column(name) for name in dict.fromkeys(names)]
    return tuple(name for name in found if name in columns and (name == "recipe" or name not in FIXED))


def _groups(rows: Rows) -> Iterator[dict[str, Any]]:
    for scene in rows.scenes:
        base = rows.values.get((scene, rows.phases[0]), {})
        for phase in rows.phases:
            values, odd = rows.values.get((scene, phase), {}), rows.odd.get((scene, phase), [])
            if not values and not odd:
                continue
            contacts = rows.contacts.get((scene, phase), [])
            found = mean_of(list(values.values())) if values else None
            ratio = ratio_of(values, base) if phase != rows.phases[0] else None
            yield {
                "scene": dict(zip(rows.parameters, scene, strict=True)),
                "phase": phase,
                "rows": len(contacts) + len(odd),
                "odd": ", ".join(f"{odd.count(each)} {each}" for each in dict.fromkeys(odd)),
                "contacts": sum(contacts) / len(contacts) if contacts else None,
                **_said(found, "mean", "interval"),
                **_said(ratio, "ratio", "ratio_interval"),
            }


def _exponents(rows: Rows, x: str) -> Iterator[dict[str, Any]]:
    for (rest, phase), points in rows.over(x).items():
        found = exponent(points)
        every = sorted({each for of_seed in points.values() for each in of_seed})
        if len(every) > 1:
            yield {
                "scene": _scene(rows, rest, x),
                "phase": phase,
                "range": [every[0], every[-1]],
                "seeds": found.seeds if found else 0,
                **_said(found, "exponent", "interval"),
            }


def _crossovers(rows: Rows, x: str) -> Iterator[dict[str, Any]]:
    points = rows.over(x)
    for rest in dict.fromkeys(rest for rest, _ in points):
        for one, other in combinations(rows.phases, 2):
            found = crossover(points.get((rest, one), {}), points.get((rest, other), {}))
            if found is not None:
                estimate, first_below = found
                below, above = (one, other) if first_below else (other, one)
                yield {
                    "scene": _scene(rows, rest, x),
                    "below": below,
                    "above": above,
                    "seeds": estimate.seeds,
                    **_said(estimate, "at", "interval"),
                }


def _scene(rows: Rows, rest: Scene, x: str) -> dict[str, Any]:
    return dict(zip([name for name in rows.parameters if name != x], rest, strict=True))


def _said(estimate: Estimate | None, value: str, interval: str) -> dict[str, Any]:
    if estimate is None:
        return {value: None, interval: None}
    return {value: estimate.value, interval: estimate.interval}
