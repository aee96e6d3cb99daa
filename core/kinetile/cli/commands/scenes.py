"""The command ``kinetile scenes``: the recipes, and their parameters."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json
from kinetile.cli.terminal import exit_codes
from kinetile.errors import KinetileError

__all__ = ["scenes"]


def scenes(
    name: Annotated[str | None, typer.Argument(help="Show the parameters of this recipe.")] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """List the recipes for scenes and their parameters."""
    from kinetile.plugin.by_name import recipe_parameters
    from kinetile.plugin.registry import registry

    with exit_codes():
        if name is None:
            recipes = [_recipe(each) for each in registry().names("scene")]
        else:
            recipe_parameters(name)
            recipes = [_recipe(registry().spec("scene", name).name)]
    result, rows = (recipes, recipes) if name is None else (recipes[0], recipes[0]["parameters"])
    if printed(result, rows, json=json, csv=csv):
        return
    from kinetile.cli.tables import parameters_table, scenes_table, show

    if name is None:
        hint = "`kinetile scenes NAME` shows a recipe's parameters with their types and defaults."
        show(scenes_table(recipes), hint)
        return
    (recipe,) = recipes
    parameters = recipe["parameters"]
    show(f"{recipe['name']}: {recipe['summary']}", parameters_table(parameters))
    settings = "".join(f" -s {each['name']}={each.get('default', '...')}" for each in parameters[:2])
    show(f"for example: kinetile run {recipe['name']}{settings}")


def _recipe(name: str) -> dict[str, Any]:
    """Return a recipe's listing; one that cannot be imported is listed with its error."""
    from kinetile.plugin.by_name import REQUIRED, recipe_parameters
    from kinetile.plugin.registry import registry

    spec = registry().spec("scene", name)
    listing: dict[str, Any] = {"name": name, "summary": spec.summary, "aliases": list(spec.aliases)}
    try:
        known = recipe_parameters(name)
    except KinetileError as error:
        return listing | {"parameters": [], "error": str(error)}
    parameters = []
    for each in known:
        required = each.default is REQUIRED
        parameters.append({"name": each.name, "type": each.type, "required": required})
        parameters[-1] |= {} if required else {"default": each.default}
    return listing | {"parameters": parameters}
