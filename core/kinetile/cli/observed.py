"""Observables on the command line: their choice, and their estimates as a table, a file or a figure."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from kinetile.cli.files import check_ending, check_new, file_errors
from kinetile.cli.options import option
from kinetile.cli.output import as_csv, rows_table
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_phases
from kinetile.targets import write_file

if TYPE_CHECKING:
    from rich.table import Table

    from kinetile.statistics import Observed

Observe = Annotated[str | None, option("Measure during the run: pressure, msd:every=0.1, ...", "NAME,...")]
ObserveTo = Annotated[
    Path | None,
    option("Write what --observe measures to a file: .csv, or a figure: .svg, .png, .pdf.", "FILE"),
]


def read_observables(
    observe: str | None, out: Path | None, overwrite: bool, *, saved: bool = False
) -> list[str]:
    """Returns the observables of ``--observe``. Raises BadOption and MissingExtra for a file that cannot be
    written, and, if ``saved``, for observables that cannot be saved."""
    if out is not None:
        if observe is None:
            raise BadOption("--observe-to is for observables, but found no observables: expected --observe")
        if check_ending("--observe-to", out, (".csv", ".svg", ".png", ".pdf")) != ".csv":
            from kinetile.show.printed import check_printing

            check_printing("Drawing observables")
        check_new("--observe-to", out, overwrite)
    wanted = read_phases(observe or "")
    if wanted:
        from kinetile.run.observing import check_observable

        for each in wanted:
            check_observable(each, saved=saved)
    return wanted


def observed_table(observed: Observed) -> Table:
    """Returns estimates as a table: numbers with their errors, and the length of each curve."""
    heads = ("> " * (1 < place < 5) + head for place, head in enumerate(observed.HEADS))
    return rows_table([*heads], observed.lines(), shared=1)


def write_observed(observed: Observed, path: Path) -> None:
    """Writes estimates to a file, in the form of its ending."""
    form = path.suffix.lower()
    content = as_csv(observed.rows()) if form == ".csv" else _figure(observed, form[1:])
    with file_errors(f"--observe-to {path}"):
        write_file(path, content)


def _figure(observed: Observed, form: str) -> bytes:
    from kinetile.show.printed import figure_bytes

    entries = [item for items in observed.values() for item in items.items()]
    curves = [item for item in entries if item[1].axis]
    numbers = [f"{q} = {e.mean:.6g} \N{PLUS-MINUS SIGN} {e.error:.2g}" for q, e in entries if not e.axis]
    height = 2.6 * len(curves) + 0.2 * len(numbers) + 0.2
    figure = import_module("matplotlib.figure").Figure((6.0, height), layout="constrained")
    figure.suptitle("\n".join(numbers), fontsize=9)
    for place, (quantity, estimate) in enumerate(curves, 1):
        axes = figure.add_subplot(len(curves), 1, place)
        axes.errorbar(estimate.at, estimate.mean, estimate.error, fmt=".-", markersize=3, linewidth=1)
        axes.set(xlabel=estimate.axis, ylabel=quantity)
    return figure_bytes(figure, form)
