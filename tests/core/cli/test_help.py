"""Help of every command: an example that can be run, no types of Python, 80 columns, no padding in a pipe."""

import re
import shlex

import pytest
import typer
from typer.testing import CliRunner

from command_line import kinetile
from kinetile.cli import app


def commands(group, *before):
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        yield " ".join([*before, name]), command
        if isinstance(command, typer.core.TyperGroup):
            yield from commands(command, *before, name)


COMMANDS = dict(commands(typer.main.get_command(app)))


def test_the_list_of_commands_has_whole_sentences_under_headings():
    shown = kinetile("--help").stdout
    assert "...\n" not in shown.partition("\n")[2]
    assert "Conformance:\n" in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command(name):
    shown = kinetile(f"{name} --help").stdout
    lines = shown.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines == [line.rstrip() for line in lines]
    assert not re.findall(r"<[\w\[\] ]+>|\[x[<>]", shown)
    (example,) = re.findall(r"^  For example: kinetile (.*)$", shown, re.MULTILINE)
    assert example.startswith(name) or name == "bench scene"
    command = COMMANDS[name]
    words = shlex.split(example.removeprefix("bench" if name == "bench scene" else name))
    command.make_context(name, words)  # a wrong option, or one argument too many, is an error


@pytest.mark.parametrize(
    ("words", "found"), [("ru", "run"), ("conf", "conform"), ("conform --na", "--narrow-phase")]
)
def test_the_shell_completes_commands_and_options(words, found):
    """Those of plugins as well."""
    asked = {"COMP_WORDS": f"kinetile {words}", "COMP_CWORD": str(len(words.split()))}
    asked["_KINETILE_COMPLETE"] = "complete_bash"
    done = CliRunner().invoke(app, [], prog_name="kinetile", env=asked)
    assert found in done.stdout.split()
