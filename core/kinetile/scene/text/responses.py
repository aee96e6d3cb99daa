"""The responses of a scene file: ``[[responses]]`` tables, each for two kinds, or for one and the walls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from kinetile.errors import Mistake
from kinetile.scene.checks import ANY, WALL, is_kind, shown
from kinetile.scene.responses import Pair, Response
from kinetile.scene.scene import Scene
from kinetile.scene.text.schema import Place, expected

__all__ = ["read_response_tables", "written_responses"]


class Names(Protocol):
    """Whoever knows which responses there are."""

    def mistakes(self, where: str, name: str, *kinds: Any) -> list[Mistake]:
        """Return the mistake of naming something that none of these kinds has, if it is one."""
        ...

    def option_mistakes(self, name: str, options: Mapping[str, Any]) -> list[Mistake]:
        """Return the options that it does not have; if it has them all, why it cannot use a value."""
        ...


def read_response_tables(
    tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake], names: Names
) -> dict[Pair, Response]:
    """Return the rules of a file's tables; append what is wrong with them. What cannot be read is left
    out."""
    if ("responses",) in faults:
        return {}
    found: dict[Pair, Response] = {}
    for number, row in enumerate(tables.get("responses", ())):
        if any(place[:2] == ("responses", number) for place in faults):
            continue
        where = f"responses[{number}]"
        name, options = row["response"], row.get("options", {})
        wrong = names.mistakes(f"{where}.response", name, "response")
        wrong = wrong or names.option_mistakes(name, options)
        pair: Pair = (row["between"][0], row["between"][1])
        if not all(is_kind(each) or each in (WALL, ANY) for each in pair):
            mistakes.append(Mistake(f"{where}.between", shown(row["between"]), expected("between")))
            continue
        response = Response(name, **options)
        response.found = True  # or its mistake is told here, in the place of the file
        if found.setdefault(pair, response) != response:
            wrong.append(
                Mistake(f"{where}.between", repr(list(pair)), "two kinds that nothing is said of yet")
            )
        mistakes += wrong
    return found


def written_responses(scene: Scene, toml: Callable[..., str]) -> list[str]:
    """Return the lines for a scene's responses; ``toml`` writes a value."""
    lines = []
    for pair, response in scene.responses:
        lines += ["", "[[responses]]", f"between = {toml(list(pair))}", f"response = {toml(response.name)}"]
        if response.options:
            lines.append(f"options = {toml(response.options, f'responses.{response.name}')}")
    return lines
