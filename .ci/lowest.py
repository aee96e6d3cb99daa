"""Print the lowest versions that pyproject.toml declares, as pins for pip: ``lowest.py EXTRA ...``.

What has no lower bound of its own, because others depend on it, pip chooses.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

_REQUIREMENT = re.compile(r"([A-Za-z0-9_.-]+)(?:\[([\w,]+)\])?>=([\w.]+)(?:,<[\w.]+)?(?:;.*)?")


def lowest(*extras: str) -> list[str]:
    """Return "name==version" for each dependency of kinetile, and of these of its extras."""
    path = Path(__file__).parent.parent / "pyproject.toml"
    project = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
    wanted = list(project["dependencies"])
    pending = list(extras)
    while pending:
        for each in project["optional-dependencies"][pending.pop()]:
            own = re.fullmatch(rf"{project['name']}\[([\w,]+)\]", each)
            if own:
                pending += own[1].split(",")
            else:
                wanted.append(each)
    pins = []
    for each in wanted:
        match = _REQUIREMENT.fullmatch(each)
        if match is None:
            raise SystemExit(f"pyproject.toml: {each!r} has no lower bound that could be installed")
        pins.append(f"{match[1]}=={match[3]}")
    return sorted(set(pins))


if __name__ == "__main__":
    print("\n".join(lowest(*sys.argv[1:])))
