"""The commands ``compare``, ``plugins``, ``scenes`` and ``bench events``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import typer

from kinetile.cli.commands.run import as_json, narrow_choice, scene_summary, until_or_default
from kinetile.cli.terminal import DIFFERENT, FAULT, Bar, exit_codes, make_ready, notice
from kinetile.cli.values import find_scene, read_numbers
from kinetile.errors import KinetileError
from kinetile.plugin.by_name import REQUIRED, recipe_parameters
from kinetile.plugin.choices import read_phase, read_phases

if TYPE_CHECKING:
    from kinetile.bench.events import Bench
    from kinetile.conformance.compare import Comparison
    from kinetile.run.simulation import Simulation

__all__ = ["bench", "compare_phases", "list_plugins", "list_scenes"]


def compare_phases(
    scene_name: str,
    parameters: Sequence[str],
    phases: str,
    narrow_phases: Sequence[str],
    until: float | None,
    max_contacts: int | None,
    json: bool,
) -> None:
    """Compare phases on a scene and print what came of it; raises typer.Exit(DIFFERENT) if they differ."""
    from kinetile.conformance.compare import Comparison, Outcome, compare

    done: list[Outcome] = []
    with exit_codes():
        scene = find_scene(scene_name, parameters)
        end = until_or_default(scene, until, max_contacts)
        choices = [read_phase(text) for text in read_phases(phases)]
        with Bar("comparing", scene.start, max_contacts) as bar:

            def start(label: str, simulation: Simulation) -> None:
                bar.what = label
                make_ready(simulation)

            try:
                comparison = compare(
                    scene,
                    choices,
                    end,
                    max_contacts=max_contacts,
                    narrow_phases=narrow_choice(narrow_phases),
                    start=start,
                    finish=done.append,
                    progress=bar,
                )
            except KeyboardInterrupt:
                _print_comparison(Comparison(tuple(done)), None, json)
                raise
    run = {"until": end, "max_contacts": max_contacts}
    _print_comparison(comparison, {"scene": scene_summary(scene), "run": run}, json)
    if not comparison.identical:
        raise typer.Exit(DIFFERENT)
    if comparison.fault is not None:
        notice("kinetile: the phases agree, but none of them came to the end that was asked for")
        raise typer.Exit(FAULT)


def _print_comparison(comparison: Comparison, head: dict[str, Any] | None, json: bool) -> None:
    """Print what came of a comparison; of one that was interrupted (no head), how the finished runs went."""
    if json:
        from kinetile.records.versions import versions

        status = {"status": "complete" if head else "interrupted", "versions": versions()}
        found = comparison.as_dict() | ({} if head else {"identical": None})
        typer.echo(as_json(status | (head or {}) | found))
        return
    from kinetile.cli.tables import comparison_table, show

    show(comparison_table(comparison.outcomes))
    if head and comparison.identical:
        contacts = comparison.outcomes[0].contacts
        show(f"identical: {contacts:,} contacts, the end and every body's state agree bit for bit")
        if comparison.fault is not None:
            show(f"but every run ended in a fault: {comparison.fault}")
    show(*map(str, comparison.divergences))


def list_plugins(json: bool) -> None:
    """Print what can be chosen by name, who brings it, and what failed to load."""
    from kinetile.plugin.registry import registry

    with exit_codes():
        listing = registry().as_dicts()
        failures = [str(failure) for failure in registry().failures]
    if json:
        typer.echo(as_json(listing))
        return
    from kinetile.cli.tables import plugins_table, show

    show(plugins_table(listing), *(f"not loaded: {failure}" for failure in failures))


def list_scenes(name: str | None, json: bool) -> None:
    """Print the recipes, or one recipe's parameters."""
    from kinetile.plugin.registry import registry

    with exit_codes():
        if name is None:
            recipes = [_recipe(each) for each in registry().names("scene")]
        else:
            recipe_parameters(name)
            recipes = [_recipe(registry().spec("scene", name).name)]
    if json:
        typer.echo(as_json(recipes if name is None else recipes[0]))
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


def bench(phases: str | None, bodies: str, densities: str, seconds: float, repeats: int, json: bool) -> None:
    """Measure and print; after Ctrl-C, what has been measured until then."""
    from kinetile.bench.events import Bench, BenchRow, bench_events, conditions

    done: list[BenchRow] = []
    with exit_codes(), Bar("measuring") as bar:
        try:
            bench_events(
                None if phases is None else [read_phase(text) for text in read_phases(phases)],
                read_numbers(bodies, int, "--bodies"),
                read_numbers(densities, float, "--densities"),
                seconds=seconds,
                repeats=repeats,
                start=lambda label, simulation: make_ready(simulation),
                finish=done.append,
                progress=bar.count,
            )
        finally:
            bar.close()
            if done:
                _print_bench(Bench(tuple(done), conditions(seconds, repeats)), json)


def _print_bench(measured: Bench, json: bool) -> None:
    if json:
        typer.echo(as_json(measured.as_dict()))
        return
    from kinetile.cli.tables import bench_table, show

    where = measured.conditions
    show(
        bench_table(measured),
        f"{where['processor']}; medians of {where['repeats']} runs of about {where['seconds']:g} CPU s each",
    )


def _recipe(name: str) -> dict[str, Any]:
    """Return a recipe's listing; one that cannot be imported is listed with its error."""
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
