"""The test vectors and the certifier are of use where there is neither kinetile nor Numba."""

import hashlib
import subprocess
import sys
import zipfile

import pytest

import distributions
import kinetile as kt

WITHOUT_NUMBA = """
import os, runpy, sys
os.environ.pop("NUMBA_DISABLE_JIT", None)
for name in ("numba", "llvmlite", "typer", "rich"):
    sys.modules[name] = None
sys.argv = sys.argv[1:]
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    assert sys.argv[0] in sys.modules["kinetile"].__file__
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("distributions")
    distributions.main(folder)
    return folder


def test_the_sums_are_those_of_the_files_and_the_same_again(made, tmp_path):
    for line in (made / "SHA256SUMS").read_text(encoding="utf-8").splitlines():
        digest, name = line.split()
        assert hashlib.sha256((made / name).read_bytes()).hexdigest() == digest
    distributions.main(tmp_path)
    assert (tmp_path / "SHA256SUMS").read_bytes() == (made / "SHA256SUMS").read_bytes()


def test_an_engine_is_checked_by_the_vectors_alone(made, tmp_path):
    (file,) = made.glob("kinetile-vectors-*.zip")
    with zipfile.ZipFile(file) as archive:
        archive.extractall(tmp_path)
    (folder,) = tmp_path.iterdir()
    command = [sys.executable, "checkers/check.py", "--exact", "discs.txt"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "exact: 265 right" in done.stdout


@pytest.mark.small
def test_the_certifier_names_a_wrong_line(made, tmp_path):
    (program,) = made.glob("kinetile-certifier-*.pyz")
    sim = kt.Simulation(kt.make_scene("cradle"))
    sim.run(until=3.0)
    kt.save_scene(sim.scene, tmp_path / "scene.toml")
    lines = [" ".join(map(str, row)) for row in sim.contacts[["epoch", "tick", "a", "b"]].tolist()]
    lines.append(f"fingerprint {sim.fingerprint}")
    wrong = [*lines[:2], lines[2].replace(" ", " 1", 1), *lines[3:]]
    for said, code in ((lines, 0), (wrong, 1)):
        (tmp_path / "contacts.txt").write_text("\n".join(said), encoding="utf-8")
        words = [str(program), "scene.toml", "contacts.txt", "3.0"]
        command = [sys.executable, "-c", WITHOUT_NUMBA, *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (code, "")
        assert ("all lines are right" if code == 0 else "line 3 is wrong") in done.stdout
