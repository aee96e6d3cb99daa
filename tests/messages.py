"""Messages as tables: a row of ``messages.toml`` is a call and its final sentence.

``test_NAME.py`` has the test of the rows of ``NAME.toml`` beside it. A table there is a law of its rows, and
``error`` is their error; without it, the message is the value of the call. A row is ``[call, part of the
message, later part, ...]``; the message of an error begins with the name of its class. If the table has a
``sentence``, all rows have its parts first; if it has a ``call``, its ``...`` stands for theirs. A call is
Python: it uses the names of the module, the imports of ``uses`` at the top, fixtures by their names, the
errors of kinetile, and files of an empty folder.
"""

import ast
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from kinetile import errors

LONGEST = 400
"""Letters in a line of a message."""


class Row(NamedTuple):
    """A call, and the parts of its sentence in their order."""

    uses: str
    error: str
    call: str
    parts: list[str]


def rows(path: Path) -> list[Any]:
    """Returns the rows of a file as parameters, named by their table and the sentence."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    uses, found = tables.pop("uses", ""), []
    for law, table in tables.items():
        assert table.keys() <= {"error", "call", "sentence", "marks", "rows"}, (path, law)
        for call, *parts in table["rows"]:
            whole = table.get("call", "...").replace("...", call, 1)
            row = Row(uses, table.get("error", ""), whole, [*table.get("sentence", ()), *parts])
            assert any(row.parts), (path, row)
            marks = [getattr(pytest.mark, mark) for mark in table.get("marks", ())]
            found.append(pytest.param(row, marks=marks, id=f"{law}: {[*parts, call][0][:60]}"))
    return found


def message_of(row: Row, names: dict[str, Any], request: Any) -> str:
    """Runs the call of a row; returns the message of its error, or else its value."""
    names = {**vars(errors), **names}
    exec(row.uses, names)
    used = {node.id for node in ast.walk(ast.parse(row.call)) if isinstance(node, ast.Name)}
    for name in sorted(used):
        with suppress(pytest.FixtureLookupError):
            names[name] = request.getfixturevalue(name)
    if not row.error:
        return str(eval(row.call, names))
    with pytest.raises(eval(row.error, names)) as caught:
        exec(row.call, names)
    text = f"{caught.type.__name__}: {caught.value}"
    assert max(map(len, text.split("\n"))) <= LONGEST, text
    return text


def table(names: dict[str, Any]) -> Any:
    """Returns the test of the rows beside the module that has these names."""
    module = Path(names["__file__"])

    @pytest.mark.parametrize("row", rows(module.with_name(f"{module.stem.removeprefix('test_')}.toml")))
    def test(row: Row, request: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        message, at = message_of(row, names, request), 0
        for part in row.parts:
            assert part in message[at:], message
            at = message.index(part, at) + len(part)

    return test
