"""The command behind the page's table asks every question, and has a row for each."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from asked import Asked

COMMAND = Path(__file__).parents[4] / "docs" / "examples" / "time_questions.py"


def test_the_table_has_a_row_for_each_question(capsys, monkeypatch):
    spec = importlib.util.spec_from_file_location("time_questions", COMMAND)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "TIMES", 2)
    module.main([9, 16], lambda scene: Asked(scene, "naive"))
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[-2:] == ["9", "16"]
    assert len(rows) == 9
    assert all(float(number) > 0.0 for row in rows for number in row.split()[-2:])
