"""The keys of a study file and the types of their values, compared by pydantic, strictly, as a scene's are.

What a value means (a recipe's name, a range, a phase with options) is for ``reading`` to say.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kinetile.errors import Mistake, one_of
from kinetile.scene.checks import shown
from kinetile.scene.text.schema import Place, written

__all__ = ["AXES", "MEASURES", "FigureTable", "SceneTable", "StudyTable", "find_faults"]

MEASURES = {
    "timings": "the run is done again until there is enough CPU time to measure",
    "rate": "a run of so many seconds of CPU time is done, and its events and contacts a second are noted",
    "stages": "time and memory of another run are noted stage by stage, in a process of its own",
    "pairs": "candidate pairs are counted at 17 moments of the run",
    "construction": "what the static construction did is counted apart",
    "certified": "the list of contacts is checked by the specification, in exact arithmetic",
}
"""What can be measured beside the readings, which every row has."""

AXES = ("bodies", "density")
"""The parameters that a figure's axis and a fit prefer, where a study has them."""

_Few = Field(max_length=100)
_Texts = Annotated[list[str], Field(min_length=1, max_length=1000)]


class _Table(BaseModel):
    model_config = ConfigDict(
        extra="forbid", strict=True, alias_generator=lambda name: name.replace("_", "-"), defer_build=True
    )


class SceneTable(_Table):
    """``[[scenes]]``: a recipe, with values, lists and ranges of its parameters; or a scene file."""

    recipe: str | None = None
    file: str | None = None
    parameters: Annotated[dict[str, Any], _Few] = {}
    together: list[_Texts] = []
    until: float | None = None
    contacts: Annotated[int, Field(ge=1)] | None = None


class FigureTable(_Table):
    """``[[figures]]``: what is drawn of the rows."""

    name: str
    kind: Literal["lines", "shares"] = "lines"
    y: str = "cpu_seconds"
    x: str | None = None
    logarithmic: bool = True
    title: str | None = None


class StudyTable(_Table):
    """A whole study file."""

    results: str | None = None
    phases: _Texts
    seeds: Any = None
    repeats: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    until: float | None = None
    contacts: Annotated[int, Field(ge=1)] | None = None
    measure: Annotated[list[str], _Few] = []
    seconds: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)] = 0.05
    limit: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    scenes: Annotated[list[SceneTable], Field(min_length=1, max_length=1000)]
    figures: Annotated[list[FigureTable], _Few] = []


_EXPECTED = {
    "results": "the name of a folder",
    "phases": 'a list of broad phases, such as ["naive", "sap-1d:axis=y"]',
    "repeats": "a whole number, at least 1",
    "until": "a finite number",
    "contacts": "a whole number, at least 1",
    "measure": f"a list of some of {', '.join(MEASURES)}",
    "seconds": "a number greater than 0, at most 3600",
    "limit": "CPU seconds, greater than 0",
    "scenes": "[[scenes]] tables",
    "recipe": "the name of a recipe",
    "file": "the name of a scene file",
    "parameters": "a table of the recipe's parameters",
    "together": 'lists of parameters that go together, such as [["bodies", "density"]]',
    "figures": "[[figures]] tables",
    "name": "the name of the figure's file, without its ending",
    "kind": '"lines" or "shares"',
    "y": "the name of a column",
    "x": "the name of a parameter",
    "logarithmic": "true or false",
    "title": "text",
}


def find_faults(tables: Mapping[str, Any]) -> tuple[list[Mistake], set[Place]]:
    """Compare a file's tables with what a study may hold.

    Returns the mistakes, and the places of the values that are missing or of a wrong type, and so of no use.
    """
    try:
        StudyTable.model_validate(tables)
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
    else:
        found = []
    mistakes: dict[Place, Mistake] = {}
    faults: set[Place] = set()
    for detail in found:
        kind, place = detail["type"], detail["loc"]
        if kind == "extra_forbidden":
            mistakes[place] = Mistake(
                written(place), "a key that is not known here", one_of(str(place[-1]), _keys(place))
            )
            continue
        while isinstance(place[-1], int) and (len(place) > 2 or place[0] not in ("scenes", "figures")):
            place = place[:-1]  # the whole list is meant, not its second entry
        faults.add(place)
        expected = "a table" if isinstance(place[-1], int) else _EXPECTED[str(place[-1])]
        value = "nothing" if kind == "missing" else shown(_at(tables, place))
        mistakes[place] = Mistake(written(place), value, expected)
    return list(mistakes.values()), faults


def _keys(place: Place) -> list[str]:
    """Return the keys of the table in which the last step of ``place`` stands."""
    models: dict[str | int, type[_Table]] = {"scenes": SceneTable, "figures": FigureTable}
    model = models.get(place[0], StudyTable) if len(place) > 1 else StudyTable
    return [field.alias or name for name, field in model.model_fields.items()]


def _at(tables: Any, place: Place) -> Any:
    for step in place:
        tables = tables[step]
    return tables
