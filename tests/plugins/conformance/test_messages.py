"""Phases that the kit cannot judge: the rows of ``messages.toml``."""

from pathlib import Path

from messages import table

SCENE = (Path(__file__).parents[2] / "scenes" / "H05.toml").read_text(encoding="utf-8")


def touched(line: str) -> str:
    Path("a-file").touch()
    return line


def judged_before(line: str) -> str:
    Path("old").mkdir()
    Path("old/judge.json").touch()
    return line


def case(head: str) -> str:
    Path("case.toml").write_text(head + SCENE, encoding="utf-8")
    return "case.toml"


test_message = table(globals())
