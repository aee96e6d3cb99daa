"""The commands ``kinetile cache``: compiled loops on disk, unused ones, damaged ones.

A cache on a user's disk is the user's: they can see how large it is, empty it, and find out whether a disk
has damaged it. Only files that the compile cache writes are touched, because ``NUMBA_CACHE_DIR`` may name a
folder that holds other things as well.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from kinetile.cli.options import Csv, Json
from kinetile.cli.output import as_json, printed, table_of
from kinetile.cli.output import show as show_tables
from kinetile.cli.terminal import FAULT, echo, exit_codes, notice

app = typer.Typer(no_args_is_help=True, help="Show or clean the cache of compiled loops.")

_FOLDER = re.compile(r"numba-(?P<numba>[\w.+]+)-llvmlite-(?P<llvmlite>[\w.+]+)")
_FILE = re.compile(r"(?P<entry>.+?)(\.\d+\.nbc|\.nbi)(?P<cut_off>\.tmp\.\w+)?")

_DAY = 86400.0

_WRITING = 3600.0
"""Seconds after which a temporary file of an unfinished write is unused."""


class CacheFile(NamedTuple):
    """A file of the cache: an index, machine code, or the rest of an unfinished write."""

    path: Path
    entry: str
    """The function, with the fingerprint of its sources and Python's version."""
    bytes: int
    last_used: float
    cut_off: bool


def _files(folder: Path) -> Iterator[CacheFile]:
    for path in sorted(folder.iterdir()):
        named = _FILE.fullmatch(path.name)
        try:
            if named and path.is_file() and not path.is_symlink():
                found = path.stat()
                used = max(found.st_atime, found.st_mtime)
                yield CacheFile(path, named["entry"], found.st_size, used, named["cut_off"] is not None)
        except FileNotFoundError:  # another process has removed it
            continue


def _kept() -> tuple[Path, str, dict[str, list[CacheFile]]]:
    """Returns the folder of all machine code, the folder of these versions, and the files of each folder."""
    from kinetile.kernel.compiled.cache import folder

    root = folder().parent
    folders = sorted(each for each in root.iterdir() if _FOLDER.fullmatch(each.name)) if root.is_dir() else []
    return root, folder().name, {each.name: list(_files(each)) for each in folders if each.is_dir()}


@app.command()
def show(json: Json = False, csv: Csv = False) -> None:
    """Show where compiled loops are kept, how many for which versions, their size and last use."""
    with exit_codes():
        root, used, kept = _kept()
    rows = [_row(name, files, name == used) for name, files in kept.items()]
    result = {"folder": str(root), "bytes": sum(row["bytes"] for row in rows), "versions": rows}
    if printed(result, rows, json=json, csv=csv):
        return
    columns: dict[str, Callable[[Any], str]] = {
        "| Numba": lambda row: row["numba"],
        "| llvmlite": lambda row: row["llvmlite"],
        "> entries": lambda row: f"{row['entries']:,}",
        "> MB": lambda row: _megabytes(row["bytes"]),
        "| last used": lambda row: (row["last_used"] or "-").partition("T")[0],
        "": lambda row: "in use by this installation" if row["used_here"] else "",
    }
    table = table_of(rows, columns) if rows else "nothing is kept: no loop has been compiled yet"
    show_tables(f"folder: {root}", table)


def _row(name: str, files: list[CacheFile], used_here: bool) -> dict[str, Any]:
    """Returns the contents for one pair of versions."""
    named = _FOLDER.fullmatch(name)
    assert named is not None
    last = max((each.last_used for each in files), default=None)
    return {
        "numba": named["numba"],
        "llvmlite": named["llvmlite"],
        "entries": len({each.entry for each in files}),
        "files": len(files),
        "bytes": sum(each.bytes for each in files),
        "last_used": last and datetime.fromtimestamp(last, UTC).isoformat(timespec="seconds"),
        "used_here": used_here,
    }


@app.command()
def clean(
    everything: Annotated[
        bool, typer.Option("--all", help="Remove everything: the next run of each phase compiles again.")
    ] = False,
    unused: Annotated[
        float, typer.Option(min=0.0, metavar="DAYS", help="Remove files not used for this number of days.")
    ] = 30.0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would be removed.")] = False,
    json: Json = False,
) -> None:
    """Remove compiled loops that were not used for 30 days, of any version, and damaged files; or all."""
    with exit_codes():
        root, _, kept = _kept()
        removed: list[dict[str, Any]] = []
        failed: list[str] = []
        for name, files in kept.items():
            for file in files:
                why = "--all" if everything else _why_useless(file, unused)
                if why is None:
                    continue
                try:
                    if not dry_run:
                        file.path.unlink(missing_ok=True)
                except OSError as error:  # on Windows, of a file that another process has open
                    failed.append(f"{file.path}: {error.strerror or error}")
                    continue
                removed.append({"file": f"{name}/{file.path.name}", "bytes": file.bytes, "why": why})
            if not dry_run:
                with suppress(OSError):  # it is not empty
                    (root / name).rmdir()
    total = sum(each["bytes"] for each in removed)
    if json:
        echo(as_json({"folder": str(root), "dry_run": dry_run, "bytes": total, "removed": removed}))
    else:
        for why in dict.fromkeys(each["why"] for each in removed):
            sizes = [each["bytes"] for each in removed if each["why"] == why]
            echo(f"{why}: {len(sizes):,} files, {_megabytes(sum(sizes))} MB")
        verb = "would be removed" if dry_run else "removed"
        echo(f"{verb} from {root}: {len(removed):,} files, {_megabytes(total)} MB")
    for said in failed:
        notice(f"kinetile: cannot be removed: {said}")
    if failed:
        raise typer.Exit(FAULT)


def _why_useless(file: CacheFile, days: float) -> str | None:
    """Returns why a file of the cache is unused, or None if it is used."""
    unused = time.time() - file.last_used
    if file.cut_off:
        return "left by a write that was cut off" if unused > _WRITING else None
    if unused >= days * _DAY:
        return f"not used for {days:g} days"
    return "damaged" if _damage(file.path) else None


def _damage(path: Path) -> str:
    """Returns the error of a file, or an empty text."""
    from kinetile.kernel.compiled.cache import is_whole

    try:
        return "" if is_whole(path) else "its content does not match its checksum"
    except FileNotFoundError:  # another process has removed it
        return ""
    except OSError as error:
        return f"it cannot be read: {error.strerror or error}"


def _megabytes(size: float) -> str:
    return f"{size / 1e6:,.1f}"
