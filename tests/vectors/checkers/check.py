"""Checks a time of impact against the vectors: python check.py [--exact] [FILE ...]

Put your engine's call in place of ``time_of_impact``: it has the parameters of the imported one.
README.md describes the files and the errors.
"""

import json
import sys
from itertools import chain
from math import floor
from pathlib import Path

from exact import time_of_impact

HERE = Path(__file__).parent.parent
KINDS = ("right", "hits missed", "misses hit", "ticks wrong")


def body(row):
    """Returns a body of the rows of discs, x y vx vy radius anchor, or of shapes: core, radius, plan."""
    core, radius, plan = row if len(row) == 3 else ([["0x0p+0"] * 2], row[4], [*row[:4], row[5]])
    x, y, vx, vy = map(float.fromhex, plan[:4])
    corners = [tuple(map(float.fromhex, corner)) for corner in core]
    return corners, float.fromhex(radius), (x, y), (vx, vy), int(plan[4])


def questions(path):
    """Yields grade, e, the two bodies, and the tick or None, of a file."""
    if path.suffix == ".txt":
        for line in path.read_text().splitlines():
            grade, _, e, tick, *words = line.split()
            a, b = body([*words[:5], "0"]), body([*words[5:], "0"])
            yield grade, int(e), a, b, None if tick == "-" else int(tick)
        return
    for e, a, b, answer in chain(*json.loads(path.read_text())["families"].values()):
        yield "clear", e, body(a), body(b), None if answer is None else int(answer)


def main(words):
    files = [Path(word) for word in words if word != "--exact"]
    files = files or [*sorted((HERE / "contacts").iterdir()), HERE / "shapes.json", HERE / "discs.txt"]
    wrong = 0
    for path in files:
        counts = {}
        for grade, e, a, b, right in questions(path):
            time = time_of_impact(e, a, b)
            found = None if time is None else floor(time)
            kind = 0 if found == right else 1 if found is None else 2 if right is None else 3
            counts.setdefault(grade, [0] * 4)[kind] += 1
            if kind and ("--exact" in words or grade == "exact" or (grade == "clear" and kind < 3)):
                wrong += 1
        for grade, row in counts.items():
            told = (f"{count} {kind}" for count, kind in zip(row, KINDS, strict=True))
            print(f"{path.name}, {grade}: {', '.join(told)}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
