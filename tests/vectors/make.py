"""Make the test vectors of docs/specification.md, or look whether they are what would be made.

    python tests/vectors/make.py            writes all files
    python tests/vectors/make.py --check    writes none; says which differ, and ends with 1 if any does

The answers come from the rules alone, in whole numbers (``making/rules.py``, ``making/whole_runs.py``):
nothing of kinetile is imported, nor anything that does not come with Python. README.md has the files' form.
"""

from __future__ import annotations

import sys
from pathlib import Path

from making import answers, discs, running

HERE = Path(__file__).parent


def main(arguments: list[str]) -> int:
    """Write or compare all files; return the exit code."""
    if arguments not in ([], ["--check"]):
        print(__doc__)
        return 2
    wrong = 0
    for name, text in {**answers.files(), **discs.files(), **running.files()}.items():
        path = HERE / name
        if not arguments:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="ascii", newline="\n")
        elif not path.exists() or path.read_bytes() != text.encode("ascii"):
            print(f"{name} is not what would be made")
            wrong += 1
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
