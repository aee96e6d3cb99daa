"""The commands about plugins: ``kinetile plugins`` and ``scenes`` list the names that a user can choose, and
``new-plugin`` writes a package to begin with."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from kinetile.cli.options import Csv, Json, argument, option
from kinetile.cli.output import printed, rows_table, show
from kinetile.cli.terminal import echo
from kinetile.errors import KinetileError
from kinetile.versions import __version__

if TYPE_CHECKING:
    from rich.table import Table

    from kinetile.plugin.specs import PluginKind


def plugins(json: Json = False, csv: Csv = False) -> None:
    """Lists installed phases and recipes with their options, and the plugins that failed to load.

    For example: kinetile plugins --json
    """
    from kinetile.plugin.registry import registry

    listing = registry().as_dicts()
    for row in listing["provided"]:
        row |= _options(row["kind"], row["name"], "options")
    failures = [f"not loaded: {failure}" for failure in registry().failures]
    if not printed(listing, listing["provided"], json=json, csv=csv):
        show(plugins_table(listing), options_table(listing), *failures)


def plugins_table(listing: Mapping[str, Sequence[Mapping[str, Any]]]) -> Table:
    """Returns a table of all phases and recipes that can be chosen by name, with their packages."""
    rows = []
    for row in sorted(listing["provided"], key=lambda row: str(row["kind"]).split()[::-1]):
        notes = [f"also called {', '.join(row['aliases'])}"] if row["aliases"] else []
        notes += [f"features: {', '.join(row['features'])}"] if row["features"] else []
        notes += [f"shapes: {', '.join(row['shapes'])}"] if "shapes" in row else []
        summary = " ".join([row["summary"], *(f"({note})" for note in notes)])
        if row["distribution"] != "kinetile":
            source = " ".join(filter(None, (row["distribution"], row["version"])))
            summary += f" (from {source or 'this process'})"
        rows.append((row["kind"], row["name"], summary))
    return rows_table(("| kind", "| name", f"what it does (from kinetile {__version__})"), rows, shared=1)


def options_table(listing: Mapping[str, Sequence[Mapping[str, Any]]]) -> Table:
    """Returns a table of all options, with types and defaults; options of every recipe appear once."""
    from kinetile.scene.by_name import SHARED_PARAMETERS

    shared = [each.name for each in SHARED_PARAMETERS]
    rows = [
        ("scene", "(each)", each.name, _type(each.type), str(each.default) or "(empty)")
        for each in SHARED_PARAMETERS
    ]
    for row in listing["provided"]:
        own = [each for each in row["options"] if row["kind"] != "scene" or each["name"] not in shared]
        options = [(each["name"], _type(each["type"]), _default(each)) for each in own]
        options += [(row["error"], "", "")] if "error" in row else []
        rows += [(row["kind"], row["name"], *each) for each in options]
    return rows_table(("| kind", "| name", "option", "| type", "default"), rows, shared=2)


def scenes(
    name: Annotated[str | None, argument("Show the parameters of this recipe.", "NAME")] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Lists the recipes for scenes and their parameters.

    For example: kinetile scenes grid
    """
    from kinetile.plugin.registry import registry
    from kinetile.scene.by_name import recipe_parameters

    if name is None:
        recipes = [_recipe(each) for each in registry().names("scene")]
        if not printed(recipes, recipes, json=json, csv=csv):
            rows = [(each["name"], each["summary"], _names(each)) for each in recipes]
            further = "`kinetile scenes NAME` shows what each parameter of a recipe means."
            show(rows_table(("| recipe", "what it makes", "parameters"), rows), further)
        return
    recipe_parameters(name)  # raises for a recipe that is unknown or cannot be imported
    recipe = _recipe(registry().spec("scene", name).name)
    parameters = recipe["parameters"]
    if not printed(recipe, parameters, json=json, csv=csv):
        cells = (
            (each["name"], _type(each["type"]), _default(each), each.get("meaning", ""))
            for each in parameters
        )
        head = f"{recipe['name']}: {recipe['summary']}"
        settings = "".join(f" -s {each['name']}={each.get('default', '...')}" for each in parameters[:2])
        example = f"for example: kinetile run {recipe['name']}{settings}"
        show(head, rows_table(("| parameter", "| type", "default", "meaning"), cells))
        show(example)


def _names(recipe: Mapping[str, Any]) -> str:
    return str(recipe.get("error", ", ".join(each["name"] for each in recipe["parameters"])))


def _recipe(name: str) -> dict[str, Any]:
    from kinetile.plugin.registry import registry

    spec = registry().spec("scene", name)
    listing = {"name": name, "summary": spec.summary, "aliases": list(spec.aliases)}
    return listing | _options("scene", name, "parameters")


def _options(kind: PluginKind, name: str, key: str) -> dict[str, Any]:
    from kinetile.plugin.parameters import REQUIRED, parameters_of
    from kinetile.scene.by_name import accepted_parameters

    try:
        known = accepted_parameters(name) if kind == "scene" else parameters_of(kind, name)
    except KinetileError as error:
        return {key: [], "error": str(error)}
    found = []
    for each in known:
        required = each.default is REQUIRED
        found.append({"name": each.name, "type": each.type, "required": required})
        found[-1] |= {} if required else {"default": each.default}
        found[-1] |= {"meaning": each.meaning} if each.meaning else {}
    return {key: found}


def _type(written: str) -> str:
    """Returns a type in fewer letters: several numbers as ``float, ...``."""
    return written.removeprefix("tuple[").removesuffix("]")


def _default(parameter: Mapping[str, Any]) -> str:
    return str(parameter.get("default", "(none: must be given)")) or "(empty)"


def new_plugin(
    name: Annotated[str, argument("The name of the new plugin.", "NAME")],
    kind: Annotated[str, option("A broad-phase, response, observable or recipe.", "KIND")] = "broad-phase",
    into: Annotated[Path, option("The folder to write the package into.", "DIR")] = Path(),
) -> None:
    """Writes a package with a working broad phase, or another plugin, as a start for your own.

    For example: kinetile new-plugin stripes --into plugins
    """
    from kinetile.plugin.new_plugin import new_plugin as write_package

    folder = write_package(name, into, kind)
    written = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    echo(f"{folder}: {', '.join(written)}")
    echo("to install it here, and test it:")
    echo(f"  cd {shlex.quote(str(folder))}\n  pip install -e '.[test]'\n  pytest")
