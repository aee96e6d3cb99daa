"""Displays of a notebook: IPython receives the names of the types that have one, and calls ``show.html``.
They are registered when a running IPython imports kinetile, or by ``%load_ext kinetile.show.notebook``."""

import sys
from typing import Any

TYPES = (
    ("kinetile.scene.scene", "Scene"),
    ("kinetile.run.simulation", "Simulation"),
    ("kinetile.run.readings", "Readings"),
    ("kinetile.statistics", "Observed"),
)
"""The modules and names of the types that have a display."""


def load_ipython_extension(shell: Any) -> None:
    """Registers the displays with an IPython shell."""
    formatters = shell.display_formatter.formatters
    for module, name in TYPES:
        formatters["text/html"].for_type_by_name(module, name, _html)
        if name in ("Scene", "Simulation"):  # others are only numbers
            formatters["image/svg+xml"].for_type_by_name(module, name, _svg)


def register_where_ipython_runs() -> None:
    """Registers the displays, if IPython runs in this process."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is not None:
        load_ipython_extension(shell)


def _html(thing: Any) -> str:
    from kinetile.show.html import as_html  # drawing is imported when it is first needed

    return as_html(thing)


def _svg(thing: Any) -> str | None:
    from kinetile.show.html import as_svg

    return as_svg(thing)
