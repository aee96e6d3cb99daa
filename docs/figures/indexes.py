"""The table of broad phases of others in docs/conformance.md: what the kit finds of those whose packages are
installed (shapely, rtree, scipy, pymunk, Box2D).

    python docs/figures/indexes.py [EXAMPLES]
"""

import re
import resource
import shlex
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from kinetile_conformance import check_engine

ENGINES = Path(__file__).parents[1] / "examples" / "engines"
JUDGED = {
    "sweep and prune, in plain Python": ("../../../tests/foreign/engines/plain.py", ""),
    "STRtree": ("indexes.py strtree", "shapely"),
    "R-tree": ("indexes.py rtree", "rtree"),
    "cKDTree": ("indexes.py ckdtree", "scipy"),
    "Chipmunk": ("chipmunk.py", "pymunk"),
    "Box2D": ("box2d.py", "Box2D"),
}
CHECKS = ("pairs", "pairs-on-lattices", "pairs-in-a-scaled-swarm")


def row(name: str, words: str, package: str, examples: int) -> list[str]:
    """Return a row: name, version, verdict, candidates for each pair that touches, CPU seconds."""
    try:
        found = f"{package} {version(package)}" if package else ""
    except PackageNotFoundError:
        return [name, "not installed", "", *[""] * len(CHECKS), ""]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    program, *rest = words.split()
    command = shlex.join([sys.executable, str(ENGINES / program), *rest])
    report = check_engine(command, asked="pairs", examples=examples)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    counts = {}
    for result in report.results:
        numbers = [int(each.replace(",", "")) for each in re.findall(r"[\d,]*\d", result.said)]
        counts[result.check] = f"{numbers[0] / numbers[1]:.2f}" if len(numbers) >= 2 else result.status
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    verdict = "conforms" if report.conforms else "fails"
    return [name, found, verdict, *(counts[check] for check in CHECKS), f"{cpu:.1f}"]


def main(examples: int = 20) -> None:
    """Print the table, in Markdown."""
    print(f"| broad phase | package | verdict | {' | '.join(CHECKS)} | CPU s |")
    print("|---|---|---|" + "---|" * (len(CHECKS) + 1))
    for name, (words, package) in JUDGED.items():
        print(f"| {' | '.join(row(name, words, package, examples))} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
