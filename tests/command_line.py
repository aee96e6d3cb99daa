"""The command line, run in this process: words as a shell splits them, then others, such as paths."""

import json
import shlex
from typing import Any

from click.testing import Result
from typer.testing import CliRunner

from kinetile.cli import app


def kinetile(line: str, *more: object, stdin: str | None = None) -> Result:
    """Run a command; an error that is no exit is raised here."""
    result = CliRunner().invoke(app, [*shlex.split(line), *map(str, more)], input=stdin)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def printed(line: str, *more: object) -> Any:
    """Run a command that succeeds, and read the JSON that it prints."""
    result = kinetile(line, *more, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def refused(line: str, *more: object) -> str:
    """Run a command that cannot be done; return the message, which is all that it prints."""
    result = kinetile(line, *more)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "Traceback" not in result.stderr
    return result.stderr
