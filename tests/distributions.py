"""Distributions for use without kinetile, each as one file: the test vectors, and the certifier.

``python tests/distributions.py DIR`` writes into a folder ``kinetile-vectors-VERSION.zip``, the folder
``vectors`` without the files that need kinetile; ``kinetile-certifier-VERSION.pyz``, a program for a Python
with NumPy, pluggy and pydantic, and without Numba, which checks a list of contacts by docs/specification.md;
and ``SHA256SUMS`` of both. The same tree gives the same bytes.
"""

import hashlib
import json
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

VECTORS = Path(__file__).parent / "vectors"
NEEDS_KINETILE = ("make.py", "test_*.py")

PROGRAM = '''\
"""Checks a list of contacts: ``python kinetile-certifier.pyz SCENE.toml CONTACTS.txt [UNTIL]``.

The scene lists its bodies, as ``kinetile run --save-scene`` writes it; the list has lines ``epoch tick a b``,
and at its end perhaps ``fingerprint`` with 64 hexadecimal digits. Exit code 1: a line is wrong, and is named.
"""

import sys

from kinetile.errors import KinetileError
from kinetile.records.contacts import read_contacts
from kinetile.scene.files import load_scene
from kinetile_accuracy import certify_log


def main(words):
    if len(words) not in (2, 3):
        print(__doc__)
        return 2
    try:
        scene = load_scene(words[0])
        with open(words[1], encoding="utf-8") as lines:
            rows, fingerprint = read_contacts(lines, words[1])
        until = float(words[2]) if len(words) == 3 else scene.settings.until
        found = certify_log(scene, rows, until, fingerprint=fingerprint)
    except (KinetileError, OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{words[1]}: {found}")
    return 0 if found.right else 1


sys.exit(main(sys.argv[1:]))
'''

IMPORTED = """
import json, os, sys
os.environ.pop("NUMBA_DISABLE_JIT", None)  # interpreted, nothing imports Numba
for name in ("numba", "llvmlite", "typer", "rich"):
    sys.modules[name] = None
from kinetile.records.contacts import read_contacts
from kinetile.scene.files import load_scene
from kinetile_accuracy import certify_log
certify_log(load_scene(sys.argv[1]), read_contacts([], "").rows, 0.0)
print(json.dumps({name: each.__file__ for name, each in sys.modules.items() if name.startswith("kinetile")}))
"""
"""Prints the modules of kinetile that the certifier imports."""

SCENE = Path(__file__).parents[1] / "docs" / "scenes" / "sinai.toml"
"""A scene with shapes and walls: it needs all imports of the certifier."""


def certifier() -> dict[str, bytes]:
    """Returns the files of the program, by their names in it."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED, str(SCENE)], capture_output=True, text=True, check=True
    )
    found = {"__main__.py": PROGRAM.encode()}
    for name, file in json.loads(done.stdout).items():
        path = name.replace(".", "/") + ("/__init__.py" if file.endswith("__init__.py") else ".py")
        found[path] = Path(file).read_bytes()
    return found


def vectors(name: str) -> dict[str, bytes]:
    """Returns the files of the test vectors, in a folder of this name."""
    files = (file for file in VECTORS.rglob("*") if file.is_file() and "__pycache__" not in file.parts)
    kept = (file for file in files if not any(file.match(each) for each in NEEDS_KINETILE))
    return {f"{name}/{file.relative_to(VECTORS).as_posix()}": file.read_bytes() for file in kept}


def write(path: Path, files: Mapping[str, bytes]) -> str:
    """Writes an archive, and returns its line of SHA256SUMS."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n"


def main(folder: Path) -> None:
    """Writes all archives into a folder."""
    from kinetile import __version__

    folder.mkdir(parents=True, exist_ok=True)
    name = f"kinetile-vectors-{(VECTORS / 'VERSION').read_text().strip()}"
    sums = write(folder / f"{name}.zip", vectors(name))
    sums += write(folder / f"kinetile-certifier-{__version__}.pyz", certifier())
    (folder / "SHA256SUMS").write_text(sums, encoding="utf-8")
    print(sums, end="")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
