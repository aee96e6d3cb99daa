"""The command line, run in this process: words as a shell splits them, then others, such as paths."""

import json
import shlex
from functools import cache
from pathlib import Path
from typing import Any

import typer.testing
from typer.testing import CliRunner, Result

from kinetile.cli import app

typer.testing._get_command = cache(typer.main.get_command)  # it takes 40 ms, and is the same at each call


def kinetile(line: str, *more: object, code: int | None = None, stdin: str | None = None) -> Result:
    """Runs a command, which ends with an exit code; any other error is raised here."""
    result = CliRunner().invoke(app, [*shlex.split(line), *map(str, more)], input=stdin)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert code in (None, result.exit_code), result.stderr
    return result


def printed(line: str, *more: object) -> Any:
    """Runs a command that succeeds, and reads the JSON that it prints."""
    return json.loads(kinetile(line, *more, "--json", code=0).stdout)


def refused(line: str, *more: object) -> str:
    """Runs an invalid command; returns the message, its only output."""
    result = kinetile(line, *more, code=2)
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return result.stderr


def left_alone(line: str) -> str:
    """Runs an invalid command, which leaves all files here as they are; returns its message as one line."""
    before = _files()
    text = refused(line)
    assert _files() == before
    return " ".join(text.replace("│", " ").split())


def _files() -> dict[Path, bytes | None]:
    return {each: each.read_bytes() if each.is_file() else None for each in Path().rglob("*")}
