"""The command ``kinetile cache``: the folder of compiled loops and hooks, with versions; their removal, and
``kinetile cache warm``, their compilation in advance.

Only files of the compile cache are removed: ``NUMBA_CACHE_DIR`` may name a folder with other things in it.
"""

import re
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from kinetile.cli import options as cli
from kinetile.cli.options import Csv, Json, flag
from kinetile.cli.output import printed, show, table_of
from kinetile.cli.terminal import EXIT_FAULT, echo, notice
from kinetile.errors import BadOption

_FOLDER = re.compile(r"numba-(?P<numba>[\w.+]+)-llvmlite-(?P<llvmlite>[\w.+]+)")
# .tmp: a write that was cut off
_FILE = re.compile(r"(?P<entry>.+?)(\.\d+\.nbc|\.nbi|(?P<hook>\.nbh))(\.tmp\.\w+)?")

app = typer.Typer(cls=cli.CommandGroup)


@app.callback(invoke_without_command=True)
def cache(
    context: typer.Context,
    clear: Annotated[
        bool, flag("Remove them all: the next run of each phase compiles again.", "--clear")
    ] = False,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Shows the folder of compiled loops and hooks, their versions, sizes and last use; or removes them.

    For example: kinetile cache --clear
    """
    if context.invoked_subcommand is not None:
        if clear or json or csv:
            raise BadOption("kinetile cache has options before `warm`; expected them after it")
        return
    from kinetile.kernel.compiled.cache import folder, problem
    from kinetile.run.engine.meanwhile import is_compiling

    here, wrong = folder(), problem()
    root = here.parent
    folders = [each for each in sorted(root.iterdir()) if each.is_dir()] if root.is_dir() else []
    versions = {each: found for each in folders if (found := _FOLDER.fullmatch(each.name))}
    rows = [_row(each, found) | {"used_here": each == here} for each, found in versions.items()]
    left = [sentence for each in versions for sentence in _cleared(each)] if clear else []
    result = {
        "folder": str(root),
        "removed": clear,
        "bytes": sum(row["bytes"] for row in rows),
        "versions": rows,
        "problem": wrong or None,
        "compiling": is_compiling(),
    }
    below = "a loop is being compiled" if result["compiling"] else wrong if rows else ""
    if not printed(result, rows, json=json, csv=csv):
        columns: dict[str, Callable[[Any], str]] = {
            "| Numba": lambda row: row["numba"],
            "| llvmlite": lambda row: row["llvmlite"],
            "> entries": lambda row: f"{row['entries']:,}",
            "> hooks": lambda row: f"{row['hooks']:,}",
            "> MB": lambda row: f"{row['bytes'] / 1e6:,.1f}",
            "| last used": lambda row: (row["last_used"] or "-").partition("T")[0],
            "": lambda row: "in use by this installation" if row["used_here"] else "",
        }
        table = table_of(rows, columns) if rows else wrong or "nothing is kept: no loop has been compiled yet"
        show(f"{'removed from' if clear else 'folder'}: {root}", table, below)
    for sentence in left:
        notice(f"kinetile: cannot be removed: {sentence}")
    if left:
        raise typer.Exit(EXIT_FAULT)


@app.command()
def warm(
    scenes: Annotated[list[str], cli.argument("Recipes' names or .toml files.", "SCENE")],
    parameters: cli.Parameters = None,
    broad_phase: cli.BroadPhase = None,
    option: cli.Options = None,
    narrow_phase: cli.NarrowPhases = None,
    live: Annotated[bool, flag("With all commands, as by `live=True`.", "--live")] = False,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Compiles the loops of scenes in advance, for example for a container image or a lesson.

    For example: kinetile cache warm grid cradle
    """
    from kinetile.run.simulation import Simulation

    name, options = cli.broad_choice(broad_phase, option)
    how: Any = {"options": options or None, "narrow_phases": cli.narrow_choice(narrow_phase), "live": live}
    simulations = [Simulation(cli.find_scene(each, parameters), name, **how) for each in scenes]
    rows = []
    for scene, simulation in zip(scenes, simulations, strict=True):
        phases, there = [simulation.broad_phase, *simulation.narrow_phases], simulation.cached
        if there is None:
            raise BadOption("NUMBA_DISABLE_JIT is set, so nothing is compiled: unset it")
        seconds = simulation.compile()
        kept = bool(simulation.cached)
        it = {"scene": scene, "phases": phases, "was_there": there, "kept": kept, "cpu_seconds": seconds}
        rows.append(it)
        if not (json or csv):
            said = "was there already" if there else f"compiled in {seconds:.1f} CPU s"
            echo(f"{scene}: {', '.join(phases)}: {said}")
    printed(rows, rows, json=json, csv=csv)
    if not all(row["kept"] for row in rows):
        raise typer.Exit(EXIT_FAULT)  # the log has said why


def _files(folder: Path) -> dict[Path, re.Match[str]]:
    """Returns the files of the cache in a folder, each with its function and fingerprint."""
    named = {path: _FILE.fullmatch(path.name) for path in folder.iterdir() if path.is_file()}
    return {path: found for path, found in named.items() if found and not path.is_symlink()}


def _row(folder: Path, named: re.Match[str]) -> dict[str, Any]:
    files, found = _files(folder), []
    hooks = {each["entry"] for each in files.values() if each["hook"]}
    loops = {each["entry"] for each in files.values() if not each["hook"]}
    for path in files:
        with suppress(FileNotFoundError):  # another process has removed it
            found.append(path.stat())
    last = max((max(each.st_atime, each.st_mtime) for each in found), default=None)
    return {
        **named.groupdict(),
        "entries": len(loops),
        "hooks": len(hooks),
        "files": len(files),
        "bytes": sum(each.st_size for each in found),
        "last_used": last and datetime.fromtimestamp(last, UTC).isoformat(timespec="seconds"),
    }


def _cleared(folder: Path) -> list[str]:
    """Removes the files of the cache in a folder, and a folder that is then empty; returns what failed."""
    failed = []
    for path in _files(folder):
        try:
            path.unlink(missing_ok=True)
        except OSError as error:  # on Windows, if another process has the file open
            failed.append(f"{path}: {error.strerror or error}")
    with suppress(OSError):  # it is not empty
        folder.rmdir()
    return failed
