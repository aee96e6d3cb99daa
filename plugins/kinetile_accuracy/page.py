"""The accuracy report as one self-contained page, made from ``templates``: no script, no other file.

The verdict comes first, as a table of what must hold; then a list of the parts, and each part with its
findings, figures and tables. Figures are in the page twice, for wide and for narrow windows.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from kinetile_accuracy.parts import Budget, Claim, Picture, Section, Table, needed
from kinetile_accuracy.wording import cells

__all__ = ["Drawn", "command", "page", "verdict"]


class Drawn(NamedTuple):
    """A figure as SVG, for a wide page and for a narrow one."""

    wide: bytes
    narrow: bytes


def page(
    sections: Sequence[Section],
    drawn: Mapping[tuple[str, str], Drawn],
    budget: Budget,
    conditions: Mapping[str, Any],
) -> str:
    """Return the page.

    Args:
        sections: what was measured, in order.
        drawn: each figure, by the names of its section and picture.
        budget: how much was measured.
        conditions: versions and machine.

    Raises MissingExtra without Jinja2.
    """
    jinja = needed("Writing the report", "Jinja2", "accuracy", "jinja2")
    environment = jinja.Environment(
        loader=jinja.PackageLoader("kinetile_accuracy"),
        autoescape=True,
        undefined=jinja.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    def image(section: Section, picture: Picture, width: str) -> str:
        svg = getattr(drawn[section.name, picture.name], width)
        return "data:image/svg+xml;base64," + b64encode(svg).decode("ascii")

    claims = [claim for section in sections for claim in section.claims]
    text: str = environment.get_template("page.html").render(
        sections=sections,
        claims=claims,
        verdict=verdict(claims),
        command=command(budget),
        conditions=conditions,
        image=image,
        body=_body,
    )
    return text


def command(budget: Budget) -> str:
    """Return the command that measures within a budget."""
    return "kinetile accuracy" if budget == "normal" else f"kinetile accuracy --{budget}"


def verdict(claims: Sequence[Claim]) -> str:
    """Return what is to be said of all claims together."""
    fail = sum(not claim.holds for claim in claims)
    if not claims:
        return "Nothing was measured that could hold or fail."
    if fail:
        return f"{fail} of {len(claims)} statements do not hold in what was measured."
    return f"All {len(claims)} statements hold in what was measured."


def _body(table: Table) -> list[list[tuple[str, bool]]]:
    """Return the rows of a table: each cell as text, and whether it is a number."""
    columns = []
    for name in table.heads:
        values = [getattr(row, name) for row in table.rows]
        numbers = any(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        columns.append([(text, numbers) for text in cells(values)])
    return [list(row) for row in zip(*columns, strict=True)]
